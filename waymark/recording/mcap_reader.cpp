#include "waymark/recording/mcap_reader.hpp"

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"
#include "waymark/recording/mcap_scan.hpp"

namespace waymark::mcap {
Result<Attachment> read_attachment(const ByteSource& source, const AttachmentIndex& entry, Bytes& data,
                                   const ReaderOptions& options) {
  const Result<ByteSpan> content =
      read_content(source, entry.offset, entry.length, Opcode::Attachment, options, data);
  if (!content) return tl::unexpected(content.error());
  return decode_attachment(*content, at(source, entry.offset));
}

Result<Attachment> decode_attachment(ByteSpan content, const Place& place) {
  Result<Attachment> attachment = decode<Attachment>(content);
  if (!attachment) return attachment;
  // All fields before the checksum; what a later version may put behind it is not covered.
  const ByteSpan& last = attachment->data.bytes;
  const ByteSpan covered =
      content.first(static_cast<std::size_t>(last.data() + last.size() - content.data()));
  if (attachment->crc != 0 && crc32(covered) != attachment->crc) {
    return fail(ErrorCode::Unreadable,
                fmt::format("the checksum of attachment '{}' is wrong", attachment->name), place);
  }
  return attachment;
}

Result<Metadata> read_metadata(const ByteSource& source, const MetadataIndex& entry,
                               const ReaderOptions& options) {
  Bytes room;
  const Result<ByteSpan> content =
      read_content(source, entry.offset, entry.length, Opcode::Metadata, options, room);
  if (!content) return tl::unexpected(content.error());
  return decode<Metadata>(*content);
}

}  // namespace waymark::mcap
