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
#include "waymark/recording/mcap/index.hpp"
#include "waymark/recording/mcap/records.hpp"
#include "waymark/recording/mcap/stream.hpp"

namespace waymark::mcap {

/// Which messages: all topics when empty; log times in [from, to) nanoseconds.
struct Selection {
  std::set<std::string> topics{};
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
};

/// Calls visit for the selected messages in order of log time (equal times: in file order). Only chunks that
/// can hold one are read; those that overlap in time are held together, so memory is bounded by the largest
/// such group. A chunk that is damaged ends the visit with its error, or is told to options.on_damage and
/// passed over when that is set.
[[nodiscard]] Status visit_messages(
    const ByteSource& source, const Index& index, const Selection& selection,
    const std::function<Status(const Channel& channel, const Message& message)>& visit,
    const ReaderOptions& options = {});

/// All messages in the order in which they stand in the file; one chunk in memory at a time. Damage as above.
[[nodiscard]] Status visit_as_written(
    const ByteSource& source, const Index& index,
    const std::function<Status(const Channel& channel, const Message& message)>& visit,
    const ReaderOptions& options = {});

/// An attachment, with its checksum checked; the bytes are appended to `data`, which the record's span points
/// into.
[[nodiscard]] Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry,
                                                 Bytes& data, const ReaderOptions& options = {});
/// The same of the content of its record; `place` is where that stands.
[[nodiscard]] Result<Attachment> decode_attachment(ByteSpan content, const Place& place);
[[nodiscard]] Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                                             const ReaderOptions& options = {});

}  // namespace waymark::mcap
