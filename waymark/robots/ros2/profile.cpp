#include "waymark/robots/ros2/profile.hpp"

#include <algorithm>
#include <map>
#include <type_traits>

#include <fmt/format.h>

#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/robots/dds/discovery.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/dds/ros_names.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxProfileBytes = std::size_t{1} << 20U;
constexpr int kImageDepth = 2;  // only the newest is used
constexpr int kSampleDepth = 100;

tl::unexpected<Error> wrong(const std::string& source, std::string message, std::string key) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.source = source, .key = std::move(key)},
              "See the examples in docs/formats/ros2-profile.md.");
}

/// Visits the key and name of each topic in a profile.
template <class Visitor>
void each_topic(const Ros2Profile& profile, Visitor&& visit) {
  Ros2Profile::fields(profile, [&](const auto& value, const auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(value)>, std::string>)
      if (std::string_view(field.name).ends_with("_topic") && !value.empty())
        visit(std::string(field.name), value);
  });
}

Status check_topics(const Ros2Profile& profile, const std::string& source) {
  std::map<std::string, std::string> keys;  // by topic
  Status status;
  each_topic(profile, [&](const std::string& key, const std::string& topic) {
    if (!status) return;
    if (!is_topic_name(topic)) {
      status = wrong(source, fmt::format("invalid topic name '{}'", topic), key);
      return;
    }
    const auto [first, is_new] = keys.try_emplace(topic.starts_with('/') ? topic : "/" + topic, key);
    if (!is_new)
      status = wrong(
          source,
          fmt::format("topic '{}' is already used for {}, which has another type", topic, first->second),
          key);
  });
  return status;
}

}  // namespace

Result<Ros2Profile> parse_ros2_profile(std::string_view text, const std::string& source) {
  auto profile = parse_fields<Ros2Profile>(text, source);
  if (!profile) return profile;
  if (text.find(':') ==
      std::string_view::npos)  // the defaults alone could drive any robot that subscribes to /cmd_vel
    return wrong(source, "empty profile; the robot and its topics are required", "");
  if (profile->odometry_topic.empty())
    return wrong(source, "empty topic; a robot cannot be driven without odometry", "odometry_topic");
  if (profile->command_topic.empty())
    return wrong(source, "empty topic; commands cannot be sent", "command_topic");
  if (Status status = check_topics(*profile, source); !status) return tl::unexpected(status.error());
  const int tag_sources = (profile->image_topic.empty() ? 0 : 1) +
                          (profile->compressed_image_topic.empty() ? 0 : 1) +
                          (profile->detections_topic.empty() ? 0 : 1);
  if (tag_sources > 1)
    return wrong(source, "image_topic, compressed_image_topic and detections_topic exclude each other",
                 "image_topic");
  if (!profile->ros_distro.empty())
    if (auto node = ros_node_description(profile->ros_distro, "waymark"); !node) {
      node.error().place = {.source = source, .key = "ros_distro"};
      return tl::unexpected(node.error());
    }
  profile->text = text;
  profile->source = source;
  return profile;
}

Result<Ros2Profile> find_ros2_profile(const std::string& name) {
  if (name.empty())
    return fail(ErrorCode::InvalidArgument, "no profile given", {.key = "profile"},
                "Use ros2:limo, ros2:turtlebot3, or ros2: with the path of a .yaml file "
                "(docs/formats/ros2-profile.md).");
  const auto path = find_shared("ros2", name);
  if (!path) return tl::unexpected(path.error());
  const auto text = read_text_file(*path, kMaxProfileBytes);
  if (!text) return tl::unexpected(text.error());
  auto profile = parse_ros2_profile(*text, path->string());
  if (profile) profile->robot = named_beside(*path, profile->robot);
  return profile;
}

Status use_interface_of(const Ros2Profile& profile, BusOptions& options) {
  if (profile.interface.empty() || options.localhost_only || !options.interfaces.empty()) return {};
  Status there = use_interface(options, profile.interface);
  if (!there) there.error().place = {.source = profile.source, .key = "interface"};
  return there;
}

Result<BusOptions> network_of(const Ros2Profile& profile, const std::string& node) {
  BusOptions options{.node = node};
  Status status = apply_ros_environment(options, process_environment());
  if (status) status = use_interface_of(profile, options);
  if (!status) return tl::unexpected(status.error());
  return options;
}

std::vector<Ros2Subscription> subscriptions_of(const Ros2Profile& profile) {
  std::vector<Ros2Subscription> all;
  const bool reliable = profile.reliable_sensors;
  const auto add = [&](const std::string& topic, std::string_view type, const TopicQos& qos) {
    if (!topic.empty()) all.push_back({topic, std::string(type), qos});
  };
  const TopicQos samples{.reliable = reliable, .depth = kSampleDepth};
  const TopicQos images{.reliable = reliable, .depth = kImageDepth};
  add(profile.odometry_topic, ros2::Odometry::kType, samples);
  add(profile.imu_topic, ros2::Imu::kType, samples);
  add(profile.wheels_topic, ros2::JointState::kType, samples);
  add(profile.scan_topic, ros2::LaserScan::kType, samples);
  add(profile.image_topic, ros2::Image::kType, images);
  add(profile.compressed_image_topic, ros2::CompressedImage::kType, images);
  add(profile.detections_topic, ros2::AprilTagDetectionArray::kType, samples);
  add(profile.camera_info_topic, ros2::CameraInfo::kType, images);
  add(profile.gamepad_topic, ros2::Joy::kType, samples);
  add(profile.truth_topic, ros2::PoseStamped::kType, samples);
  add("/tf_static", ros2::TFMessage::kType, {.transient_local = true, .depth = kSampleDepth});
  add("/tf", ros2::TFMessage::kType, {.reliable = false, .depth = kSampleDepth});
  if (profile.use_sim_time) add("/clock", ClockMessage::kType, {.reliable = false, .depth = kSampleDepth});
  return all;
}

TopicUse command_use(const Ros2Profile& profile) {
  const std::string_view type = profile.command_stamped ? ros2::TwistStamped::kType : ros2::Twist::kType;
  return {true, dds_topic(profile.command_topic, type), {.depth = 1}};
}

std::vector<TopicUse> uses_of(const Ros2Profile& profile) {
  std::vector<TopicUse> all = {command_use(profile)};
  for (const Ros2Subscription& one : subscriptions_of(profile))
    all.push_back({false, dds_topic(one.topic, one.type), one.qos});
  return all;
}

bool is_published(const std::string& topic, const std::vector<BusEndpoint>& others, std::string_view type) {
  const BusTopic wanted = dds_topic(topic, type);
  return std::ranges::any_of(others, [&](const BusEndpoint& one) {
    return one.publishes && one.name.topic == wanted.topic && (type.empty() || one.name.type == wanted.type);
  });
}

std::vector<std::string> missing_publishers(const Ros2Profile& profile,
                                            const std::vector<BusEndpoint>& others) {
  std::vector<std::string> missing;
  for (const std::string* topic :
       {&profile.image_topic, &profile.compressed_image_topic, &profile.detections_topic})
    if (!topic->empty() && !is_published(*topic, others) && !is_published(*topic + "/compressed", others))
      missing.push_back(fmt::format("{} has no publisher: check its name in the profile", *topic));
  if (profile.use_sim_time && !is_published("/clock", others))
    missing.emplace_back("/clock has no publisher, but the profile requires it (use_sim_time)");
  return missing;
}

}  // namespace waymark
