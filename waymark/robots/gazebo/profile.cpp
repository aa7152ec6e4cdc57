#include "waymark/robots/gazebo/profile.hpp"

#include <set>

#include <fmt/format.h>

#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxProfileBytes = std::size_t{1} << 20U;

tl::unexpected<Error> wrong(const std::string& source, std::string message, const char* key) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.source = source, .key = key},
              "See the example in docs/howto/gazebo.md.");
}

}  // namespace

Result<GazeboProfile> parse_gazebo_profile(std::string_view text, const std::string& source) {
  if (text.find(':') == std::string_view::npos)  // the defaults alone could drive the wrong robot
    return wrong(source, "empty profile; the robot and its topics are required", "");
  auto profile = parse_fields<GazeboProfile>(text, source);
  if (!profile) return profile;
  if (profile->odometry_topic.empty())
    return wrong(source, "empty topic; a robot cannot be driven without odometry", "odometry_topic");
  if (profile->command_topic.empty())
    return wrong(source, "empty topic; commands cannot be sent", "command_topic");
  std::set<std::string> topics = {profile->command_topic};
  for (const GazeboSubscription& one : subscriptions_of(*profile))
    if (!topics.insert(one.topic).second)
      return wrong(source, fmt::format("duplicate topic {}", one.topic), "");
  return profile;
}

Result<GazeboProfile> find_gazebo_profile(const std::string& name) {
  const auto path = find_shared("gazebo", name);
  if (!path) return tl::unexpected(path.error());
  const auto text = read_text_file(*path, kMaxProfileBytes);
  if (!text) return tl::unexpected(text.error());
  auto profile = parse_gazebo_profile(*text, path->string());
  if (profile) profile->robot = named_beside(*path, profile->robot);
  return profile;
}

std::vector<GazeboSubscription> subscriptions_of(const GazeboProfile& profile) {
  constexpr int kSamples = 100;
  constexpr int kImages = 2;  // only the newest is used
  const std::vector<GazeboSubscription> all = {
      {GazeboKind::Odometry, profile.odometry_topic, "ignition.msgs.Odometry", kSamples},
      {GazeboKind::Imu, profile.imu_topic, "ignition.msgs.IMU", kSamples},
      {GazeboKind::Scan, profile.scan_topic, "ignition.msgs.LaserScan", kSamples},
      {GazeboKind::Image, profile.image_topic, "ignition.msgs.Image", kImages},
      {GazeboKind::CameraInfo, profile.camera_info_topic, "ignition.msgs.CameraInfo", kImages},
      {GazeboKind::Gamepad, profile.gamepad_topic, "ignition.msgs.Joy", kSamples},
      {GazeboKind::Truth, profile.truth_topic, "ignition.msgs.Pose", kSamples},
      {GazeboKind::Clock, profile.clock_topic, "ignition.msgs.Clock", 1}};
  std::vector<GazeboSubscription> used;
  for (const GazeboSubscription& one : all)
    if (!one.topic.empty()) used.push_back(one);
  return used;
}

}  // namespace waymark
