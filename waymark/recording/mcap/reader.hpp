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

/// Selects messages by topic (all topics if empty) and by log time in the interval [from, to), in
/// nanoseconds.
struct Selection {
  std::set<std::string> topics{};
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
};

/// Calls visit for the selected messages in order of log time (in file order if times are equal). Reads only
/// chunks that may contain such messages. Chunks that overlap in time are held together, so memory is bounded
/// by the largest such group. A damaged chunk is passed to options.on_damage and skipped; without on_damage
/// it ends the visit with its error.
[[nodiscard]] Status visit_messages(
    const ByteSource& source, const Index& index, const Selection& selection,
    const std::function<Status(const Channel& channel, const Message& message)>& visit,
    const ReaderOptions& options = {});

/// Visits all messages in file order, with one chunk in memory at a time. Damage is handled as in
/// visit_messages().
[[nodiscard]] Status visit_as_written(
    const ByteSource& source, const Index& index,
    const std::function<Status(const Channel& channel, const Message& message)>& visit,
    const ReaderOptions& options = {});

/// Reads an attachment and verifies its checksum. The bytes are appended to `data`, and the record's span
/// points into `data`.
[[nodiscard]] Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry,
                                                 Bytes& data, const ReaderOptions& options = {});
/// Decodes an attachment from the content of its record; `place` is the record's location.
[[nodiscard]] Result<Attachment> decode_attachment(ByteSpan content, const Place& place);
[[nodiscard]] Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                                             const ReaderOptions& options = {});

}  // namespace waymark::mcap
