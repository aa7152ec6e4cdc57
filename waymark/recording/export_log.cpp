#include "waymark/recording/export_log.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/logged_poses.hpp"
#include "waymark/recording/mcap/writer.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/rosbag2_writer.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

constexpr const char* kContentsHint = "`waymark info` lists the contents of a recording.";

/// Derives the progress of a visit from log times and periodically calls the caller's function.
class ExportProgress {
 public:
  ExportProgress(const MessageLog& log, const ExportOptions& options) : report_(options.progress) {
    const LogSummary summary = log.summary();
    begin_ = std::max(summary.start.value_or(0), options.selection.from);
    end_ = std::min(summary.end.value_or(0), options.selection.to);
  }

  Status at(std::uint64_t log_time) {
    constexpr std::uint64_t kEvery = 256;
    if (!report_ || ++count_ % kEvery != 0) return {};
    const double whole = end_ > begin_ ? static_cast<double>(end_ - begin_) : 1;
    const double done = log_time > begin_ ? static_cast<double>(log_time - begin_) / whole : 0;
    return report_(std::clamp(done, 0.0, 1.0));
  }

 private:
  std::function<Status(double)> report_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  std::uint64_t count_ = 0;
};

/// Maps channels in the source to channels in the file being written.
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
      if (!converted) return {};  // already noted
      as = &converted->channel->channel;
      data = converted->data;
      if (converted->channel->transcoder->drops_sequence_numbers()) {
        noted_.trap("ros1.header_seq", [&] {
          return Error{ErrorCode::Unsupported,
                       "message headers lose their sequence number (seq), which ROS 2 does not have",
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

/// Metadata blocks from the source, from the caller and from the export itself.
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

/// Whether messages on a channel stay valid until the next one. ROS delivers them to late subscribers too.
bool is_latched(const LogChannel& channel) {
  const auto qos = channel.metadata.find("offered_qos_profiles");
  const bool latched =
      qos != channel.metadata.end() && (qos->second.find("durability: 1") != std::string::npos ||
                                        qos->second.find("transient_local") != std::string::npos);
  return latched || channel.topic.ends_with("/tf_static") || channel.type.ends_with("/CameraInfo");
}

/// For a part that begins later, writes earlier messages that are still valid to its beginning: the newest
/// message of each latched topic and all fixed transforms. O(earlier messages on these topics).
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
  // Copied before the log is read again, because each visit clears the problems of the previous one.
  exported.report().problems = log.problems();
  exported.noted().append_to(exported.report().problems);
  if (status) status = add_blocks(exported.writer(), blocks_of(log, exported.report(), options));
  if (status) status = exported.writer().close();
  if (!status) return tl::unexpected(status.error());
  return std::move(exported.report());
}

/// The topic that SampleRecorder uses, without the name of an additional camera.
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

/// The topic that SampleRecorder uses, with the name of an additional camera.
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
    if (Status reported = progress.at(log_time_of(sample)); !reported) return reported;
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

namespace {

namespace fs = std::filesystem;

Result<ExportReport> export_to(MessageLog& log, const fs::path& path, const ExportOptions& options) {
  Result<std::unique_ptr<ByteSink>> sink = create_file(path);
  return sink ? export_mcap(log, std::move(*sink), options) : tl::unexpected(sink.error());
}

BagContents contents_of(const MessageLog& log, std::string file) {
  const LogSummary summary = log.summary();
  return {.file = std::move(file),
          .channels = log.channels(),
          .start_ns = summary.start.value_or(0),
          .end_ns = summary.end.value_or(0)};
}

Status write_text(const fs::path& path, const std::string& text) {
  const Result<std::unique_ptr<ByteSink>> sink = create_file(path);
  return sink ? (*sink)->write(as_bytes(text)) : tl::unexpected(sink.error());
}

/// Notes that a SQLite bag cannot store metadata and attachments.
void note_omitted_metadata(MessageLog& log, LogProblems& noted) {
  const auto setup = log.setup();
  if (log.attachments().empty() && (!setup || setup->metadata.empty())) return;
  noted.trap("rosbag2.no_metadata_blocks", [] {
    return Error{ErrorCode::Unsupported,
                 "a bag stored as sqlite3 cannot hold metadata and attachments of the recording (tag size, "
                 "calibration); they are omitted",
                 {},
                 "Use storage mcap to keep them."};
  });
}

Status store_as_sqlite(const fs::path& mcap, const fs::path& folder, const BagFormat& format,
                       const std::string& file, const ExportOptions& options, LogProblems& noted) {
  const Result<std::unique_ptr<MessageLog>> log = open_log(mcap);
  if (!log) return tl::unexpected(log.error());
  ExportProgress progress(**log, {.progress = options.progress});
  const BagContents contents = contents_of(**log, file);
  if (Status status = write_sqlite_bag(**log, folder / file, format, contents,
                                       [&](std::uint64_t log_time) { return progress.at(log_time); });
      !status)
    return status;
  note_omitted_metadata(**log, noted);
  return write_text(folder / "metadata.yaml", bag_metadata(format, contents));
}

}  // namespace

Result<ExportReport> export_rosbag2(MessageLog& log, const fs::path& folder, const std::string& name,
                                    const BagFormat& format, const ExportOptions& options) {
  std::error_code error;
  if (!fs::create_directory(folder, error))
    return fail(ErrorCode::Unwritable, error ? error.message() : "the folder already exists",
                {.source = folder.string()});
  const std::string file = fmt::format("{}_0{}", name, format.suffix());
  ExportOptions as_bag = options;
  as_bag.qos = format.qos();
  // MCAP is always written first, so that channels, their counts and times are available before the first
  // message is stored.
  const bool is_final = format.storage == BagStorage::Mcap;
  const fs::path mcap = folder / (is_final ? file : "messages.mcap");
  Result<ExportReport> report = export_to(log, mcap, as_bag);
  if (!report) return report;
  LogProblems noted;
  Status status;
  if (is_final) {
    const Result<std::unique_ptr<MessageLog>> written = open_log(mcap);
    status = written
                 ? write_text(folder / "metadata.yaml", bag_metadata(format, contents_of(**written, file)))
                 : tl::unexpected(written.error());
  } else {
    status = store_as_sqlite(mcap, folder, format, file, options, noted);
    fs::remove(mcap, error);
  }
  if (!status) return tl::unexpected(status.error());
  noted.append_to(report->problems);
  return report;
}

namespace {

constexpr std::size_t kFlushBytes = 1 << 16;

/// Buffered lines of a text file.
class Lines {
 public:
  explicit Lines(std::unique_ptr<ByteSink> sink) : sink_(std::move(sink)) {}
  template <class... Args>
  Status add(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    return text_.size() >= kFlushBytes ? flush() : Status{};
  }
  Status flush() {
    Status status = sink_->write(as_bytes(text_));
    text_.clear();
    return status;
  }

 private:
  std::unique_ptr<ByteSink> sink_;
  std::string text_;
};

struct TextKind {
  const char* name;
  const char* columns;
};
constexpr std::array kKinds = {
    TextKind{
        "detections",
        "t_ns,camera,tag,hamming,decision_margin,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_"
        "y_px"},
    TextKind{"odometry", "t_ns,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s"},
    TextKind{"imu", "t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2"},
    TextKind{"range-bearing", "t_ns,landmark,range_m,bearing_rad"}};

const char* kind_of(const Sample& sample) {
  if (std::holds_alternative<TagFrame>(sample)) return kKinds[0].name;
  if (std::holds_alternative<Odometry>(sample)) return kKinds[1].name;
  if (std::holds_alternative<ImuSample>(sample)) return kKinds[2].name;
  if (std::holds_alternative<RangeBearing>(sample)) return kKinds[3].name;
  return "";
}

/// Writes the rows of one sample; a tag frame has one row per tag with usable corners. Programs that read the
/// table thus never use unreliable corners.
struct RowWriter {
  Lines& lines;
  ExportReport& report;
  std::uint64_t& unreliable;  ///< number of tags without a row

  static std::int64_t t_ns(SensorTime stamp) { return stamp.time_since_epoch().count(); }
  Status counted(Status status) const {
    ++report.messages;
    return status;
  }
  Status operator()(const TagFrame& s) const {
    unreliable += count_unreliable(s.detections);
    for (const TagDetection& d : s.detections) {
      if (!usable_corners(d)) continue;
      const auto& c = d.corners_px;
      Status status = counted(lines.add("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", t_ns(s.stamp), s.camera,
                                        to_string(d.tag), d.hamming, d.decision_margin, c[0].x(), c[0].y(),
                                        c[1].x(), c[1].y(), c[2].x(), c[2].y(), c[3].x(), c[3].y()));
      if (!status) return status;
    }
    return {};
  }
  Status operator()(const Odometry& s) const {
    const Eigen::Vector2d p = s.odom_T_base.translation();
    return counted(lines.add("{},{},{},{},{},{}\n", t_ns(s.stamp), p.x(), p.y(),
                             s.odom_T_base.rotation().log()(0), s.speed_m_s, s.yaw_rate_rad_s));
  }
  Status operator()(const ImuSample& s) const {
    const Eigen::Vector3d& g = s.angular_velocity_rad_s;
    const Eigen::Vector3d& a = s.linear_acceleration_m_s2;
    return counted(
        lines.add("{},{},{},{},{},{},{}\n", t_ns(s.stamp), g.x(), g.y(), g.z(), a.x(), a.y(), a.z()));
  }
  Status operator()(const RangeBearing& s) const {
    return counted(lines.add("{},{},{},{}\n", t_ns(s.stamp), s.landmark, s.range_m, s.bearing_rad));
  }
  template <class Other>
  Status operator()(const Other& /*sample*/) const {
    return {};
  }
};

constexpr const char* kKeepUnreliable = "Write .mcap to keep them, marked as unreliable.";

LogProblem unreliable_problem(std::uint64_t tags) {
  return {LogProblem::Kind::Trap, "csv.unreliable_corners",
          Error{ErrorCode::Unsupported,
                "a detection with unreliable corners is not in the table",
                {},
                kKeepUnreliable},
          tags};
}

/// The kind to export if none is given; the recording must contain exactly one kind that fits a table.
Result<std::string> only_kind(MessageLog& log, const LogSelection& selection) {
  std::set<std::string> found;
  Status status = log.visit_samples(selection, [&](const Sample& sample) {
    if (const std::string kind = kind_of(sample); !kind.empty()) found.insert(kind);
    return Status{};
  });
  if (!status) return tl::unexpected(status.error());
  if (found.size() == 1) return *found.begin();
  if (found.empty())
    return fail(ErrorCode::NotFound,
                "the recording has no detections, odometry, imu or range-bearing to export as a table");
  return fail(ErrorCode::InvalidArgument,
              fmt::format("the recording contains {}, but a table holds one kind", fmt::join(found, ", ")),
              {}, fmt::format("Choose one, for example `kind={}`.", *found.begin()));
}

}  // namespace

Result<ExportReport> export_csv(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                const ExportOptions& options) {
  std::string wanted = options.kind;
  if (wanted.empty()) {
    Result<std::string> only = only_kind(log, options.selection);
    if (!only) return tl::unexpected(only.error());
    wanted = *only;
  }
  const auto kind = std::ranges::find_if(kKinds, [&](const TextKind& k) { return k.name == wanted; });
  if (kind == kKinds.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("no table for kind '{}'", wanted), {},
                "Known: detections, odometry, imu, range-bearing.");
  Lines lines(std::move(sink));
  ExportReport report;
  std::uint64_t unreliable = 0;
  ExportProgress progress(log, options);
  Status status = lines.add("{}\n", kind->columns);
  if (status)
    status = log.visit_samples(options.selection, [&](const Sample& sample) -> Status {
      if (Status reported = progress.at(log_time_of(sample)); !reported) return reported;
      return kind_of(sample) == wanted ? std::visit(RowWriter{lines, report, unreliable}, sample) : Status{};
    });
  if (status) status = lines.flush();
  if (!status) return tl::unexpected(status.error());
  if (report.messages == 0 && unreliable > 0)
    return fail(
        ErrorCode::NotFound,
        fmt::format("all {} detections have unreliable corners, so the table would be empty", unreliable), {},
        kKeepUnreliable);
  if (report.messages == 0)
    return fail(ErrorCode::NotFound, fmt::format("the selection contains no {}", wanted), {}, kContentsHint);
  report.by_topic[wanted] = report.messages;
  report.problems = log.problems();
  if (unreliable > 0) report.problems.push_back(unreliable_problem(unreliable));
  return report;
}

namespace {

Result<std::string> only_topic(const std::vector<std::string>& topics) {
  if (topics.size() == 1) return topics.front();
  if (topics.empty())
    return fail(ErrorCode::NotFound, "the selection contains no topic with poses", {},
                "TUM files are written from nav_msgs/Odometry, geometry_msgs/PoseStamped or "
                "PoseWithCovarianceStamped.");
  return fail(ErrorCode::InvalidArgument,
              fmt::format("several topics contain poses: {}", fmt::join(topics, ", ")), {},
              fmt::format("Choose one, for example `topics={}`.", topics.front()));
}

class TumExport {
 public:
  TumExport(MessageLog& log, std::unique_ptr<ByteSink> sink, const ExportOptions& options)
      : log_(log), sink_(std::move(sink)), options_(options), progress_(log, options) {}

  Result<ExportReport> run() {
    const bool samples = poses_are_samples(log_);
    const Status status = samples ? from_samples() : from_messages();
    if (!status) return tl::unexpected(status.error());
    if (samples) report_.problems = log_.problems();
    if (report_.messages == 0)
      return fail(ErrorCode::NotFound, "the selection contains no poses", {}, kContentsHint);
    if (Status written = sink_->write(as_bytes(text_)); !written) return tl::unexpected(written.error());
    return report_;
  }

 private:
  Status from_messages() {
    std::vector<std::string> topics;
    for (const std::string& topic : pose_topics(log_))
      if (options_.selection.takes(topic)) topics.push_back(topic);
    const Result<std::string> topic = only_topic(topics);
    if (!topic) return tl::unexpected(topic.error());
    return visit_poses(
        log_, *topic, options_.selection,
        [&](const EstimatedPose& pose) { return line(*topic, pose.stamp, pose.map_T_base); },
        report_.problems, [&](std::uint64_t log_time) { return progress_.at(log_time); });
  }

  Status from_samples() {
    return log_.visit_samples(options_.selection, [&](const Sample& sample) -> Status {
      if (Status reported = progress_.at(log_time_of(sample)); !reported) return reported;
      if (const auto* o = std::get_if<Odometry>(&sample))
        return line("/odom", o->stamp, lift(o->odom_T_base));
      if (const auto* t = std::get_if<TruthPose>(&sample))
        return line("/truth/pose", t->stamp, t->map_T_base);
      return {};
    });
  }

  Status line(const std::string& topic, SensorTime stamp, const SE3& pose) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    constexpr std::size_t kPieceOfLines = 1 << 16;
    const std::int64_t ns = std::max<std::int64_t>(0, stamp.time_since_epoch().count());
    const Eigen::Vector3d p = pose.translation();
    const Eigen::Quaterniond q = pose.rotation().quaternion();
    if (!p.allFinite() || !q.coeffs().allFinite()) return {};
    text_ += fmt::format("{}.{:09} {} {} {} {} {} {} {}\n", ns / kSecond, ns % kSecond, p.x(), p.y(), p.z(),
                         q.x(), q.y(), q.z(), q.w());
    ++report_.messages;
    ++report_.by_topic[topic];
    if (text_.size() < kPieceOfLines) return {};
    Status status = sink_->write(as_bytes(text_));
    text_.clear();
    return status;
  }

  MessageLog& log_;
  std::unique_ptr<ByteSink> sink_;
  const ExportOptions& options_;
  ExportProgress progress_;
  std::string text_;
  ExportReport report_;
};

}  // namespace

Result<ExportReport> export_tum(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                const ExportOptions& options) {
  return TumExport(log, std::move(sink), options).run();
}

}  // namespace waymark
