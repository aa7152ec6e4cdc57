#include "waymark/recording/logged_poses.hpp"

#include <algorithm>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

constexpr const char* kOdometryOfSamples = "/odom";
constexpr const char* kTruthOfSamples = "/truth/pose";

bool has_poses(std::string_view type) {
  return type == ros2::Odometry::kType || type == ros2::PoseStamped::kType ||
         type == ros2::PoseWithCovarianceStamped::kType;
}

/// Covariance of x, y and the rotation about z. Empty if all elements are zero, which publishers write for an
/// unknown covariance.
std::optional<Eigen::Matrix3d> planar_covariance(const std::array<double, 36>& covariance) {
  constexpr Eigen::Index kRow[3] = {0, 1, 5};
  const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> full(covariance.data());
  Eigen::Matrix3d planar;
  for (Eigen::Index i = 0; i < 3; ++i)
    for (Eigen::Index j = 0; j < 3; ++j) planar(i, j) = full(kRow[i], kRow[j]);
  return planar.isZero(0) ? std::nullopt : std::optional(planar);
}

EstimatedPose estimate(const ros2::Header& header, const ros2::PoseWithCovariance& pose) {
  return {ros2::from_ros(header.stamp), ros2::from_ros(pose.pose), planar_covariance(pose.covariance)};
}

template <class Message>
Result<EstimatedPose> decode_as(ByteSpan cdr) {
  const Result<Message> message = cdr::decode<Message>(cdr);
  if (!message) return tl::unexpected(message.error());
  if constexpr (std::is_same_v<Message, ros2::PoseStamped>) {
    return estimate(message->header, {message->pose, {}});
  } else {
    return estimate(message->header, message->pose);
  }
}

Result<EstimatedPose> decode_pose(std::string_view type, ByteSpan cdr) {
  if (type == ros2::PoseStamped::kType) return decode_as<ros2::PoseStamped>(cdr);
  if (type == ros2::Odometry::kType) return decode_as<ros2::Odometry>(cdr);
  return decode_as<ros2::PoseWithCovarianceStamped>(cdr);
}

bool finite(const EstimatedPose& pose) {
  return pose.map_T_base.translation().allFinite() &&
         pose.map_T_base.rotation().quaternion().coeffs().allFinite();
}

Status visit_messages(MessageLog& log, const LogSelection& selection, const PoseVisitor& visit,
                      LogProblems& noted, const LogTimeVisitor& at) {
  CdrChannels channels([&](LogProblem::Kind kind, const std::string& key, const Error& error) {
    noted.add(kind, key, [&] { return error; });
  });
  return log.visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (Status reported = at ? at(message.log_time) : Status{}; !reported) return reported;
    const auto converted = channels.convert(channel, message);
    if (!converted || !converted->channel->known_layout) return {};
    const Result<EstimatedPose> pose = decode_pose(converted->channel->channel.type, converted->data);
    if (pose && finite(*pose)) return visit(*pose);
    noted.damage("poses.message", [&] {
      return pose ? Error{ErrorCode::InvalidArgument, "non-finite pose", {.source = channel.topic}, {}}
                  : pose.error();
    });
    return {};
  });
}

Status visit_samples_of(MessageLog& log, const std::string& topic, const LogSelection& selection,
                        const PoseVisitor& visit, const LogTimeVisitor& at) {
  return log.visit_samples(selection, [&](const Sample& sample) -> Status {
    if (Status reported = at ? at(log_time_of(sample)) : Status{}; !reported) return reported;
    const auto* odometry = std::get_if<Odometry>(&sample);
    if (odometry != nullptr && topic == kOdometryOfSamples)
      return visit({odometry->stamp, lift(odometry->odom_T_base), {}});
    const auto* truth = std::get_if<TruthPose>(&sample);
    if (truth != nullptr && topic == kTruthOfSamples) return visit({truth->stamp, truth->map_T_base, {}});
    return {};
  });
}

}  // namespace

bool poses_are_samples(const MessageLog& log) {
  if (log.format() != LogFormat::Merged) return gives_samples(log.format());
  return std::ranges::none_of(log.channels(), [](const LogChannel& c) { return has_poses(c.type); });
}

std::vector<std::string> pose_topics(const MessageLog& log) {
  if (poses_are_samples(log)) return {kOdometryOfSamples, kTruthOfSamples};
  std::vector<std::string> topics;
  for (const LogChannel& channel : log.channels())
    if (has_poses(channel.type) && std::ranges::find(topics, channel.topic) == topics.end())
      topics.push_back(channel.topic);
  return topics;
}

Status visit_poses(MessageLog& log, const std::string& topic, LogSelection selection,
                   const PoseVisitor& visit, std::vector<LogProblem>& problems, const LogTimeVisitor& at) {
  LogProblems noted;
  selection.topics = poses_are_samples(log) ? std::set<std::string>{} : std::set{topic};
  const Status status = poses_are_samples(log) ? visit_samples_of(log, topic, selection, visit, at)
                                               : visit_messages(log, selection, visit, noted, at);
  for (const LogProblem& problem : log.problems()) problems.push_back(problem);
  noted.append_to(problems);
  return status;
}

}  // namespace waymark
