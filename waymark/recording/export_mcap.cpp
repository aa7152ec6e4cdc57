#include <map>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/export_progress.hpp"
#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/mcap_writer.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

/// Channels of the source as they are called in the file that is written.
class McapExport {
 public:
  McapExport(mcap::Writer writer, MessageLog& log, const ExportOptions& options)
      : writer_(std::move(writer)),
        qos_(options.qos),
        progress_(log, options),
        cdr_([this](LogProblem::Kind kind, const std::string& key, const Error& error) {
          noted_.add(kind, key, [&] { return error; });
        }) {}
  McapExport(const McapExport&) = delete;
  McapExport& operator=(const McapExport&) = delete;
  ~McapExport() = default;

  Status add(const LogChannel& channel, const LogMessage& message) {
    if (Status status = progress_.at(message.log_time); !status) return status;
    const LogChannel* as = &channel;
    ByteSpan data = message.data;
    if (channel.encoding == "ros1") {
      const auto converted = cdr_.convert(channel, message);
      if (!converted) return {};  // noted
      as = &converted->channel->channel;
      data = converted->data;
      if (converted->channel->transcoder->drops_sequence_numbers()) {
        noted_.trap("ros1.header_seq", [&] {
          return Error{ErrorCode::Unsupported,
                       "headers lose the sequence number (seq) that ROS 1 counts in them: ROS 2 has none",
                       {.key = channel.topic},
                       {}};
        });
      }
    }
    const Result<std::uint16_t> id = channel_id(channel, *as);
    if (!id) return tl::unexpected(id.error());
    ++report_.messages;
    ++report_.by_topic[as->topic];
    return writer_.write(*id, message.log_time, message.publish_time, data);
  }

  mcap::Writer& writer() { return writer_; }
  ExportReport& report() { return report_; }
  [[nodiscard]] const LogProblems& noted() const { return noted_; }

 private:
  Result<std::uint16_t> channel_id(const LogChannel& source, const LogChannel& as) {
    if (const auto known = ids_.find(&source); known != ids_.end()) return known->second;
    std::uint16_t schema = 0;
    if (!as.type.empty()) {
      const auto added = writer_.add_schema(as.type, as.schema_encoding, as_bytes(as.schema));
      if (!added) return added;
      schema = *added;
    }
    std::map<std::string, std::string> metadata = as.metadata;
    if (qos_) {
      std::string& qos = metadata["offered_qos_profiles"];
      if (const auto offered = parse_offered_qos(qos); !offered.empty()) qos = to_yaml(offered, *qos_);
    }
    const auto id = writer_.add_channel(as.topic, schema, as.encoding, metadata);
    if (id) ids_[&source] = *id;
    return id;
  }

  mcap::Writer writer_;
  std::optional<QosNotation> qos_;
  ExportProgress progress_;
  CdrChannels cdr_;
  std::map<const LogChannel*, std::uint16_t> ids_;
  ExportReport report_;
  LogProblems noted_;
};

using Blocks = std::map<std::string, std::map<std::string, std::string>>;

/// Blocks of metadata: the source's, the caller's, and what was noticed on the way.
Blocks blocks_of(MessageLog& log, const ExportReport& report, const ExportOptions& options) {
  Blocks blocks = options.metadata;
  for (const LogProblem& problem : report.problems)
    blocks["waymark_import"][problem.key] = fmt::format("{} x: {}", problem.count, problem.error.message);
  if (const Result<RecordingSetup> setup = log.setup())
    blocks.insert(setup->metadata.begin(), setup->metadata.end());
  return blocks;
}

Status add_attachments(mcap::Writer& writer, MessageLog& log) {
  return log.visit_attachments([&](const MessageLog::Attachment& attachment) {
    return writer.write_attachment({.log_time = attachment.log_time,
                                    .create_time = attachment.log_time,
                                    .name = attachment.name,
                                    .media_type = attachment.media_type,
                                    .data = {attachment.data}});
  });
}

Status add_blocks(mcap::Writer& writer, const Blocks& blocks) {
  for (const auto& [name, values] : blocks) {
    if (Status status = writer.write_metadata({.name = name, .metadata = values}); !status) return status;
  }
  return {};
}

/// Whether the messages of a channel hold until another one follows: ROS publishes them once, to late comers
/// too.
bool is_latched(const LogChannel& channel) {
  const auto qos = channel.metadata.find("offered_qos_profiles");
  const bool said =
      qos != channel.metadata.end() && (qos->second.find("durability: 1") != std::string::npos ||
                                        qos->second.find("transient_local") != std::string::npos);
  return said || channel.topic.ends_with("/tf_static") || channel.type.ends_with("/CameraInfo");
}

/// The part of a recording that begins later needs what was published before and still holds: of each topic
/// the newest message, of fixed transforms all of them. They are written at the beginning of the part.
/// O(messages before it on these topics).
Status add_latched(McapExport& exported, MessageLog& log, const LogSelection& selection) {
  LogSelection before{.to = selection.from};
  for (const LogChannel& channel : log.channels())
    if (is_latched(channel) && selection.takes(channel.topic)) before.topics.insert(channel.topic);
  if (selection.from == 0 || before.topics.empty()) return {};
  std::map<const LogChannel*, std::vector<Bytes>> held;
  Status status = log.visit(before, [&](const LogChannel& channel, const LogMessage& message) {
    std::vector<Bytes>& messages = held[&channel];
    if (!channel.topic.ends_with("/tf_static")) messages.clear();
    messages.emplace_back(message.data.begin(), message.data.end());
    return Status();
  });
  for (const auto& [channel, messages] : held) {
    for (const Bytes& data : messages) {
      if (status)
        status = exported.add(
            *channel, {.log_time = selection.from, .publish_time = selection.from, .data = ByteSpan(data)});
    }
  }
  return status;
}

Result<ExportReport> export_messages(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                     const ExportOptions& options) {
  Result<mcap::Writer> writer = mcap::Writer::open(std::move(sink), {});
  if (!writer) return tl::unexpected(writer.error());
  McapExport exported(std::move(*writer), log, options);
  Status status = add_latched(exported, log, options.selection);
  if (status)
    status = log.visit(options.selection, [&](const LogChannel& channel, const LogMessage& message) {
      return exported.add(channel, message);
    });
  if (status) status = add_attachments(exported.writer(), log);
  // Before anything else is asked of the log: a visit forgets what the one before noticed.
  exported.report().problems = log.problems();
  exported.noted().append_to(exported.report().problems);
  if (status) status = add_blocks(exported.writer(), blocks_of(log, exported.report(), options));
  if (status) status = exported.writer().close();
  if (!status) return tl::unexpected(status.error());
  return std::move(exported.report());
}

/// The topic SampleRecorder takes, without the name of a further camera.
const char* topic_of(const Sample& sample) {
  struct Visitor {
    const char* operator()(const TagFrame&) const { return topics::kTags; }
    const char* operator()(const Odometry&) const { return topics::kOdometry; }
    const char* operator()(const WheelTicks&) const { return topics::kWheels; }
    const char* operator()(const ImuSample&) const { return topics::kImu; }
    const char* operator()(const StampedCommand&) const { return topics::kCommand; }
    const char* operator()(const TruthPose&) const { return topics::kTruth; }
    const char* operator()(const CameraFrame&) const { return topics::kImage; }
    const char* operator()(const TagPoseFrame&) const { return topics::kTagPoses; }
    const char* operator()(const RangeBearing&) const { return topics::kRangeBearing; }
    const char* operator()(const LaserScan&) const { return topics::kScan; }
    const char* operator()(const GamepadState&) const { return topics::kGamepad; }
  };
  return std::visit(Visitor{}, sample);
}

/// The topic SampleRecorder takes, with the name of a further camera.
std::string topic_with_camera(const Sample& sample) {
  const char* topic = topic_of(sample);
  return std::visit(
      [&](const auto& value) -> std::string {
        if constexpr (requires { value.camera; }) return topic_of_camera(value.camera, topic);
        return topic;
      },
      sample);
}

Result<ExportReport> export_samples(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                    const ExportOptions& options) {
  Result<SampleRecorder> recorder = SampleRecorder::open(std::move(sink));
  if (!recorder) return tl::unexpected(recorder.error());
  if (options.qos) recorder->set_qos_notation(*options.qos);
  ExportProgress progress(log, options);
  ExportReport report;
  const auto setup = log.setup();
  bool begun = false;
  Status status = log.visit_samples(options.selection, [&](const Sample& sample) -> Status {
    if (Status told = progress.at(log_time_of(sample)); !told) return told;
    if (!std::exchange(begun, true)) {
      const auto camera = options.camera || !setup ? options.camera : setup->camera;
      const auto base_T_cam = options.base_T_cam || !setup ? options.base_T_cam : setup->base_T_cam;
      if (camera && base_T_cam)
        if (Status added = recorder->add_camera(stamp_of(sample), *camera, *base_T_cam); !added) return added;
    }
    ++report.messages;
    ++report.by_topic[topic_with_camera(sample)];
    return recorder->add(sample);
  });
  if (status)
    status = log.visit_attachments([&](const MessageLog::Attachment& attachment) {
      return recorder->add_attachment(attachment.name, attachment.media_type,
                                      SensorTime(Duration(attachment.log_time)), as_text(attachment.data));
    });
  report.problems = log.problems();
  for (const auto& [name, values] : blocks_of(log, report, options)) {
    if (status) status = recorder->add_metadata(name, values);
  }
  if (status) status = recorder->close();
  if (!status) return tl::unexpected(status.error());
  return report;
}

}  // namespace

Result<ExportReport> export_mcap(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                 const ExportOptions& options) {
  return gives_samples(log.format()) ? export_samples(log, std::move(sink), options)
                                     : export_messages(log, std::move(sink), options);
}

}  // namespace waymark
