#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/mcap_records.hpp"
#include "waymark/recording/mcap_stream.hpp"

namespace waymark::mcap {

/// A schema that owns its text.
struct StoredSchema {
  std::string name{};
  std::string encoding{};
  Bytes data{};
};

/// What is in a file and where, from its summary or, when that is missing, from one pass over the file.
struct Index {
  Header header{};
  std::map<std::uint16_t, StoredSchema> schemas{};
  std::map<std::uint16_t, Channel> channels{};
  std::vector<ChunkIndex> chunks{};  ///< in file order
  std::vector<AttachmentIndex> attachments{};
  std::vector<MetadataIndex> metadata{};
  Statistics statistics{};
  bool from_summary = false;      ///< false: the writer did not finish; rebuilt by reading the whole file
  std::vector<Error> problems{};  ///< what was damaged or cut
};

/// The index of a file. O(summary) when there is one, else one pass over the file.
[[nodiscard]] Result<Index> read_index(const ByteSource& source, const ReaderOptions& options = {});

/// Which messages: all topics when empty; log times in [from, to) nanoseconds.
struct Selection {
  std::set<std::string> topics{};
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
};

/// Calls visit for the selected messages in order of log time (equal times: in file order). Only chunks that
/// can hold one are unpacked; those that overlap in time are held together, so memory is bounded by the
/// largest such group. Messages outside chunks are not visited (our writer makes none): use read_stream() for
/// such a file.
[[nodiscard]] Status visit_messages(
    const ByteSource& source, const Index& index, const Selection& selection,
    const std::function<Status(const Channel& channel, const Message& message)>& visit,
    const ReaderOptions& options = {});

/// An attachment, with its checksum checked; the bytes are appended to `data`, which the record's span points
/// into.
[[nodiscard]] Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry,
                                                 Bytes& data, const ReaderOptions& options = {});
[[nodiscard]] Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                                             const ReaderOptions& options = {});

}  // namespace waymark::mcap
