#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/message_log.hpp"

/// Records of a ROS 1 bag, version 2.0 (ROS wiki, "Bags/Format/2.0"): a header of named fields, and data.
namespace waymark::ros1bag {

inline constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

enum class Op : std::uint8_t {
  Message = 0x02,
  BagHeader = 0x03,
  IndexData = 0x04,
  Chunk = 0x05,
  ChunkInfo = 0x06,
  Connection = 0x07,
};

/// The fields of a header, which refer to bytes owned by the caller.
class Fields {
 public:
  /// Empty unless the bytes are a list of name=value.
  static std::optional<Fields> parse(ByteSpan header);
  [[nodiscard]] std::optional<ByteSpan> find(std::string_view name) const;
  [[nodiscard]] std::string text(std::string_view name) const;
  /// Empty if the field is missing or has a different size.
  template <class T>
  [[nodiscard]] std::optional<T> number(std::string_view name) const {
    const auto bytes = find(name);
    if (!bytes || bytes->size() != sizeof(T)) return std::nullopt;
    return from_little_endian<T>(bytes->data());
  }
  /// Seconds and nanoseconds, combined in nanoseconds.
  [[nodiscard]] std::optional<std::uint64_t> time(std::string_view name) const;

 private:
  std::vector<std::pair<std::string_view, ByteSpan>> fields_;
};

/// Two 32-bit numbers as stored in the file, seconds first, combined in nanoseconds.
[[nodiscard]] std::uint64_t time_ns(const std::uint8_t* bytes);

/// A record in memory.
struct Record {
  Op op{};
  Fields fields{};
  ByteSpan data{};
};

/// The next record; empty at the end or if the bytes are not a record.
[[nodiscard]] std::optional<Record> next_record(ByteReader& bytes);

/// Location of a record in a file, and its header.
struct RecordPlace {
  Bytes header{};  ///< bytes of the fields
  std::uint64_t offset = 0;
  std::uint64_t data_offset = 0;
  std::uint32_t data_size = 0;
  [[nodiscard]] std::uint64_t end() const { return data_offset + data_size; }
};

/// Reads the header of the record at an offset. Fails, reporting the offset, if there is no record. Does not
/// check whether the data extend past the end of the file.
[[nodiscard]] Result<RecordPlace> read_place(const ByteSource& source, std::uint64_t offset);

/// Contents of a connection record.
struct Connection {
  std::uint32_t id = 0;
  std::string topic{};
  std::string type{};
  std::string md5sum{};
  std::string definition{};
  std::string caller{};
  bool latching = false;
};
[[nodiscard]] std::optional<Connection> connection_of(const Fields& header, ByteSpan data);

}  // namespace waymark::ros1bag

namespace waymark {

/// Opens a ROS 1 bag, version 2.0, with or without its index. Chunks may be uncompressed or compressed with
/// bz2 or lz4.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_ros1_bag(std::unique_ptr<ByteSource> source,
                                                                const LogOptions& options);

}  // namespace waymark
