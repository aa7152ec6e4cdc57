#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/export_progress.hpp"
#include "waymark/recording/logged_poses.hpp"

namespace waymark {
namespace {

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
    const bool samples = poses_are_samples(log_);
    const Status status = samples ? from_samples() : from_messages();
    if (!status) return tl::unexpected(status.error());
    if (samples) report_.problems = log_.problems();
    if (report_.messages == 0) return fail(ErrorCode::NotFound, "no poses in what was chosen");
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
};

}  // namespace

Result<ExportReport> export_tum(MessageLog& log, std::unique_ptr<ByteSink> sink,
                                const ExportOptions& options) {
  return TumExport(log, std::move(sink), options).run();
}

}  // namespace waymark
