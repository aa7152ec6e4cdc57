#include "waymark/recording/mcap/recover.hpp"

#include <algorithm>
#include <iterator>
#include <system_error>

#include <fmt/format.h>

#include "waymark/recording/mcap/index.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

/// Receives the records of a damaged file and writes a complete one.
class Salvage {
 public:
  Salvage(const ByteSource& source, std::unique_ptr<ByteSink> sink)
      : source_(source), output_(std::move(sink)), scan_(index_) {}

  /// `known` contains channels from the summary, for a file whose first records are lost.
  Status begin(const Index& known, bool begin_is_lost) {
    Status status = output_.put(kMagic);
    if (!begin_is_lost) return status;
    const auto cdr = [](const auto& entry) { return entry.second.message_encoding == "cdr"; };
    const bool ros2 = std::ranges::any_of(known.channels, cdr);
    if (status) status = write(Header{.profile = ros2 ? "ros2" : "", .library = "waymark"});
    for (const auto& [id, schema] : known.schemas)
      if (status)
        status =
            write(Schema{.id = id, .name = schema.name, .encoding = schema.encoding, .data = {schema.data}});
    for (const auto& [id, channel] : known.channels)
      if (status) status = write(channel);
    return status;
  }

  Status add(const RecordView& view) {
    if (ended_) return {};
    if (view.in_chunk) {
      on_inner(view);
      return {};
    }
    if (is<MessageIndex>(view.opcode)) return {};  // written again, because the last one may be truncated
    if (Status status = end_chunk(); !status) return status;
    ended_ = is<DataEnd>(view.opcode) || is<Footer>(view.opcode);
    return ended_ || is_damaged(view) ? Status{} : copy(view);
  }

  Status finish() {
    if (Status status = end_chunk(); !status) return status;
    scan_.finish();
    return output_.finish(index_);
  }
  Status sync() { return output_.sync(); }

  [[nodiscard]] const Index& index() const { return index_; }
  [[nodiscard]] const std::vector<Error>& problems() const { return problems_; }
  [[nodiscard]] std::uint64_t left_out_bytes() const { return left_out_bytes_; }
  [[nodiscard]] std::uint64_t position() const { return output_.position(); }

 private:
  template <class Record>
  Status write(const Record& record) {
    Bytes content;
    encode_content(content, record);
    return copy({.opcode = static_cast<std::uint8_t>(Record::kOpcode), .content = content});
  }

  bool is_damaged(const RecordView& view) {
    if (!is<Attachment>(view.opcode)) return false;
    const Result<Attachment> attachment = decode_attachment(view.content, at(source_, view.offset));
    if (attachment) return false;
    problems_.push_back(attachment.error());
    left_out_bytes_ += kRecordPrefixSize + view.content.size();
    return true;
  }

  Status copy(const RecordView& view) {
    RecordView moved = view;
    moved.offset = output_.position();
    Bytes prefix = {view.opcode};
    append_little_endian(prefix, static_cast<std::uint64_t>(view.content.size()));
    if (Status status = output_.put(prefix); !status) return status;
    if (Status status = output_.put(view.content); !status) return status;
    scan_.add(moved);
    in_chunk_ = is<Chunk>(view.opcode);
    return {};
  }

  void on_inner(const RecordView& view) {
    scan_.add(view);
    if (!is<Message>(view.opcode)) return;
    const Result<Message> message = decode<Message>(view.content);
    if (!message) return;
    MessageIndex& messages = messages_[message->channel_id];
    messages.channel_id = message->channel_id;
    messages.records.emplace_back(message->log_time, view.inner_offset);
  }

  /// Ends a chunk with its message indexes.
  Status end_chunk() {
    if (!in_chunk_) return {};
    in_chunk_ = false;
    ChunkIndex& entry = index_.chunks.back();
    Bytes bytes;
    for (const auto& [channel_id, messages] : messages_) {
      entry.message_index_offsets[channel_id] = output_.position() + bytes.size();
      encode(bytes, messages);
    }
    entry.message_index_length = bytes.size();
    messages_.clear();
    return output_.put(bytes);
  }

  const ByteSource& source_;
  Output output_;
  Index index_;
  std::vector<Error> problems_;
  std::uint64_t left_out_bytes_ = 0;
  Scan scan_;
  std::map<std::uint16_t, MessageIndex> messages_;
  bool in_chunk_ = false;
  bool ended_ = false;
};

/// The offsets of records from the summary, in order; empty if there is no summary.
std::vector<KnownRecord> known_records(const Index& index) {
  std::vector<KnownRecord> known;
  if (!index.from_summary) return known;
  const auto add = [&known](std::uint64_t offset, Opcode opcode) {
    known.push_back({offset, static_cast<std::uint8_t>(opcode)});
  };
  for (const ChunkIndex& chunk : index.chunks) add(chunk.chunk_start_offset, Opcode::Chunk);
  for (const AttachmentIndex& attachment : index.attachments) add(attachment.offset, Opcode::Attachment);
  for (const MetadataIndex& metadata : index.metadata) add(metadata.offset, Opcode::Metadata);
  std::ranges::sort(known);
  return known;
}

bool begins_with_magic(const ByteSource& source) {
  std::uint8_t magic[sizeof(kMagic)] = {};
  return source.read(0, magic) && std::ranges::equal(magic, kMagic);
}

}  // namespace

Result<Recovery> recover(const ByteSource& source, std::unique_ptr<ByteSink> sink,
                         const ReaderOptions& options) {
  const Result<std::uint64_t> size = source.size();
  if (!size) return tl::unexpected(size.error());
  ReaderOptions damaged = options;
  damaged.begin_may_be_lost = true;
  Result<Index> before = read_index(source, damaged);
  if (!before) before = Index{};  // read_stream() finds out whether there are chunks
  Salvage salvage(source, std::move(sink));
  if (Status status = salvage.begin(*before, !begins_with_magic(source)); !status)
    return tl::unexpected(status.error());
  const Result<StreamSummary> stream = read_stream(
      source, options, [&](const RecordView& view) { return salvage.add(view); }, known_records(*before),
      !before->from_summary);
  if (!stream) return tl::unexpected(stream.error());
  Recovery recovery{.kept_bytes = salvage.position(),
                    .lost_bytes = stream->skipped_bytes + salvage.left_out_bytes() + *size -
                                  (stream->complete ? *size : stream->good_bytes),
                    .problems = stream->problems};
  std::ranges::copy(salvage.problems(), std::back_inserter(recovery.problems));
  if (before->from_summary && recovery.problems.empty()) recovery.problems = before->problems;
  recovery.was_whole = stream->complete && recovery.problems.empty() && before->from_summary;
  Status status = salvage.finish();
  if (status) status = salvage.sync();
  if (!status) return tl::unexpected(status.error());
  recovery.messages = salvage.index().statistics.message_count;
  recovery.chunks = salvage.index().chunks.size();
  return recovery;
}

Result<Recovery> recover_file(const std::filesystem::path& in, const std::filesystem::path& out,
                              const ReaderOptions& options) {
  const auto source = open_file(in);
  if (!source) return tl::unexpected(source.error());
  std::error_code ignored;
  if (std::filesystem::exists(out, ignored)) {
    return fail(ErrorCode::Unwritable, "the file already exists", {.source = out.string()},
                "Files are never overwritten: choose another name.");
  }
  const std::filesystem::path part = out.string() + ".part";
  const auto named = [&](Error error) {  // errors must not mention the .part file
    if (error.place.source == part.string()) error = named_output(std::move(error), out);
    return tl::unexpected(std::move(error));
  };
  auto sink = create_file(part);
  if (!sink) return named(sink.error());
  Result<Recovery> recovery = recover(**source, std::move(*sink), options);
  if (recovery && recovery->messages == 0 && !recovery->was_whole)
    recovery = fail(ErrorCode::NotFound, "no complete message found; nothing to recover",
                    {.source = in.string()}, "Recorders write a chunk each second or each 1 MiB.");
  if (recovery) {
    if (Status status = rename_to_new(part, out); !status) recovery = tl::unexpected(status.error());
  }
  if (recovery) return recovery;
  std::filesystem::remove(part, ignored);
  return named(recovery.error());
}

}  // namespace waymark::mcap
