#pragma once
// Inside the room: a file as it grows, with its position and the checksum of its data section.

#include <memory>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/mcap_index.hpp"

namespace waymark::mcap {

class Output {
 public:
  explicit Output(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}

  [[nodiscard]] std::uint64_t position() const { return position_; }

  /// Appends bytes; position and checksum move only when all of them were taken.
  Status put(ByteSpan bytes) { return put(bytes, crc32(bytes)); }
  /// The same with their checksum, where it is known.
  Status put(ByteSpan bytes, std::uint32_t crc) {
    if (Status status = sink_->write(bytes); !status) return status;
    position_ += bytes.size();
    crc_ = crc32_of_both(crc_, crc, bytes.size());
    return {};
  }
  Status sync() { return sink_->sync(); }
  /// The end of the data section, and the summary.
  Status finish(const Index& index, const SummaryParts& parts = {}) {
    Bytes bytes;
    encode(bytes, DataEnd{.data_section_crc = crc_});
    append(bytes, encode_summary(index, position_ + bytes.size(), parts));
    return sink_->write(bytes);
  }

 private:
  std::unique_ptr<ByteSink> sink_;
  std::uint64_t position_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace waymark::mcap
