#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/cdr.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/export_progress.hpp"
#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/ros2_convert.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark {
namespace {

struct Posed {
  ros2::Time stamp{};
  ros2::Pose pose{};
};

bool has_poses(std::string_view type) {
  return type == ros2::Odometry::kType || type == ros2::PoseStamped::kType ||
         type == ros2::PoseWithCovarianceStamped::kType;
}

template <class Message>
std::optional<Message> decoded(ByteSpan cdr) {
  auto message = cdr::decode<Message>(cdr);
  return message ? std::optional(std::move(*message)) : std::nullopt;
}

std::optional<Posed> pose_of(std::string_view type, ByteSpan cdr) {
  if (type == ros2::PoseStamped::kType) {
    if (const auto m = decoded<ros2::PoseStamped>(cdr)) return Posed{m->header.stamp, m->pose};
  } else if (type == ros2::Odometry::kType) {
    if (const auto m = decoded<ros2::Odometry>(cdr)) return Posed{m->header.stamp, m->pose.pose};
  } else if (const auto m = decoded<ros2::PoseWithCovarianceStamped>(cdr)) {
    return Posed{m->header.stamp, m->pose.pose};
  }
  return std::nullopt;
}

Result<std::string> only_topic(const std::vector<std::string>& topics) {
  if (topics.size() == 1) return topics.front();
  if (topics.empty())
    return fail(
        ErrorCode::NotFound, "no topic of poses in what was chosen", {},
        "A TUM file takes nav_msgs/Odometry, geometry_msgs/PoseStamped or PoseWithCovarianceStamped.");
  return fail(ErrorCode::InvalidArgument,
              fmt::format("several topics have poses: {}", fmt::join(topics, ", ")), {},
              fmt::format("Say which: --topics {}.", topics.front()));
}

class TumExport {
 public:
  TumExport(MessageLog& log, std::unique_ptr<ByteSink> sink, const ExportOptions& options)
      : log_(log), sink_(std::move(sink)), options_(options), progress_(log, options) {}

  Result<ExportReport> run() {
    const bool samples = log_.format() == LogFormat::Lcm || log_.format() == LogFormat::Csv;
    const Status status = samples ? from_samples() : from_messages();
    if (!status) return tl::unexpected(status.error());
    report_.problems = log_.problems();
    noted_.append_to(report_.problems);
    if (report_.messages == 0) return fail(ErrorCode::NotFound, "no poses in what was chosen");
    if (Status written = sink_->write(as_bytes(text_)); !written) return tl::unexpected(written.error());
    return report_;
  }

 private:
  Status from_messages() {
    std::vector<std::string> topics;
    for (const LogChannel& channel : log_.channels()) {
      if (has_poses(channel.type) && options_.selection.takes(channel.topic)) topics.push_back(channel.topic);
    }
    const Result<std::string> topic = only_topic(topics);
    if (!topic) return tl::unexpected(topic.error());
    LogSelection selection = options_.selection;
    selection.topics = {*topic};
    CdrChannels cdr([this](LogProblem::Kind kind, const std::string& key, const Error& error) {
      noted_.add(kind, key, [&] { return error; });
    });
    return log_.visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
      if (Status told = progress_.at(message.log_time); !told) return told;
      const auto converted = cdr.convert(channel, message);
      if (!converted || !converted->channel->known_layout) return {};
      const auto posed = pose_of(converted->channel->channel.type, converted->data);
      return posed ? line(channel.topic, ros2::from_ros(posed->stamp), ros2::from_ros(posed->pose))
                   : Status{};
    });
  }

  Status from_samples() {
    return log_.visit_samples(options_.selection, [&](const Sample& sample) -> Status {
      if (Status told = progress_.at(log_time_of(sample)); !told) return told;
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
  LogProblems noted_;
};

}  // namespace

Result<ExportReport> export_tum(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                const ExportOptions& options) {
  return TumExport(log, std::move(sink), options).run();
}

}  // namespace waymark
