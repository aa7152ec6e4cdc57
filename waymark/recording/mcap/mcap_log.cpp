#include "waymark/recording/mcap/mcap_log.hpp"

#include <fmt/format.h>

#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros_definition.hpp"
#include "waymark/recording/ros_log.hpp"

namespace waymark {
namespace {

class McapLog final : public RosLog {
 public:
  McapLog(std::unique_ptr<ByteSource> source, mcap::Index index, const mcap::ReaderOptions& options)
      : source_(std::move(source)), index_(std::move(index)), options_(options) {
    for (const auto& [id, channel] : index_.channels) {
      position_[id] = channels_.size();
      channels_.push_back(described(channel));
    }
    opened_.damages("mcap.damage", index_.problems);
    note_times();
  }

  LogFormat format() const override { return LogFormat::Mcap; }
  std::string description() const override {
    return fmt::format("MCAP{}{}", index_.header.profile.empty() ? "" : ", profile " + index_.header.profile,
                       index_.from_summary ? "" : ", without a usable summary");
  }
  const std::vector<LogChannel>& channels() const override { return channels_; }
  LogSummary summary() const override {
    const mcap::Statistics& statistics = index_.statistics;
    LogSummary summary{.messages = statistics.message_count,
                       .size_bytes = source_->size().value_or(0),
                       .files = {source_->name()},
                       .library = index_.header.library,
                       .profile = index_.header.profile,
                       .chunks = index_.chunks.size(),
                       .complete = index_.from_summary};
    if (statistics.message_count > 0) {
      summary.start = statistics.message_start_time;
      summary.end = statistics.message_end_time;
    }
    return summary;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    return mcap::visit_messages(*source_, index_,
                                {.topics = selection.topics, .from = selection.from, .to = selection.to},
                                each(visit), noting_damage());
  }
  Status visit_as_written(const Visitor& visit) override {
    return mcap::visit_as_written(*source_, index_, each(visit), noting_damage());
  }

  std::vector<LogAttachment> attachments() const override {
    std::vector<LogAttachment> list;
    list.reserve(index_.attachments.size());
    for (const mcap::AttachmentIndex& entry : index_.attachments)
      list.push_back({entry.name, entry.media_type, entry.data_size});
    return list;
  }
  Status visit_attachments(const std::function<Status(const Attachment&)>& visit) override {
    attached_.clear();
    for (const mcap::AttachmentIndex& entry : index_.attachments) {
      Bytes bytes;
      const Result<mcap::Attachment> found = mcap::read_attachment(*source_, entry, bytes, options_);
      if (!found) {
        attached_.damages("mcap.attachment", {found.error()});
        continue;
      }
      if (Status status = visit({found->name, found->media_type, found->log_time, found->data.bytes});
          !status)
        return status;
    }
    return {};
  }

  std::vector<LogProblem> problems() const override {
    std::vector<LogProblem> all = joined(opened_, attached_);
    visited_.append_to(all);
    return all;
  }

  Result<std::map<std::string, std::map<std::string, std::string>>> metadata() override {
    std::map<std::string, std::map<std::string, std::string>> blocks;
    for (const mcap::MetadataIndex& entry : index_.metadata) {
      Result<mcap::Metadata> block = mcap::read_metadata(*source_, entry, options_);
      if (!block) return tl::unexpected(block.error());
      blocks[block->name] = std::move(block->metadata);
    }
    return blocks;
  }

 private:
  [[nodiscard]] std::function<Status(const mcap::Channel&, const mcap::Message&)> each(
      const Visitor& visit) const {
    return [this, &visit](const mcap::Channel& channel, const mcap::Message& message) {
      return visit(channels_[position_.at(channel.id)],
                   {message.log_time, message.publish_time, message.data.bytes});
    };
  }
  /// Reader options for a new visit that notes damage.
  mcap::ReaderOptions noting_damage() {
    visited_.clear();
    mcap::ReaderOptions options = options_;
    options.on_damage = [this](const Error& error) { visited_.damage("mcap.chunk", [&] { return error; }); };
    return options;
  }
  /// Notes chunks that begin before the previous one ended, as happens after a backward clock jump.
  void note_times() {
    constexpr std::uint64_t kJump_ns = 500'000'000;
    for (std::size_t i = 1; i < index_.chunks.size(); ++i) {
      const std::uint64_t before = index_.chunks[i - 1].message_end_time;
      const std::uint64_t start = index_.chunks[i].message_start_time;
      const bool empty = index_.chunks[i].message_end_time == 0 || before == 0;
      if (empty || start + kJump_ns >= before) continue;
      opened_.trap("mcap.time_back", [&] {
        return Error{
            ErrorCode::Unreadable,
            fmt::format("log times decrease by {:.2f} s: the clock was set back, some messages (images) were "
                        "late, or several recorders wrote the file; messages are read in order of log time",
                        static_cast<double>(before - start) * 1e-9),
            {.source = source_->name(),
             .byte = static_cast<std::int64_t>(index_.chunks[i].chunk_start_offset)},
            {}};
      });
    }
  }
  [[nodiscard]] LogChannel described(const mcap::Channel& channel) const {
    LogChannel out{
        .topic = channel.topic, .encoding = channel.message_encoding, .metadata = channel.metadata};
    if (const auto schema = index_.schemas.find(channel.schema_id); schema != index_.schemas.end()) {
      const std::string& name = schema->second.name;
      out.type = channel.message_encoding == "ros1" ? ros::ros2_type(name) : name;
      out.schema_encoding = schema->second.encoding;
      out.schema = as_text(schema->second.data);
    }
    const auto& counts = index_.statistics.channel_message_counts;
    if (const auto count = counts.find(channel.id); count != counts.end()) out.messages = count->second;
    return out;
  }

  std::unique_ptr<ByteSource> source_;
  mcap::Index index_;
  mcap::ReaderOptions options_;
  std::vector<LogChannel> channels_;
  std::map<std::uint16_t, std::size_t> position_;
  LogProblems opened_;
  LogProblems attached_;  ///< damaged attachments in the last visit_attachments()
};

}  // namespace

Result<std::unique_ptr<MessageLog>> open_mcap_log(std::unique_ptr<ByteSource> source,
                                                  const LogOptions& options) {
  const mcap::ReaderOptions reader{.max_record_bytes = options.max_record_bytes};
  Result<mcap::Index> index = mcap::read_index(*source, reader);
  if (!index) return tl::unexpected(index.error());
  return std::make_unique<McapLog>(std::move(source), std::move(*index), reader);
}

}  // namespace waymark
