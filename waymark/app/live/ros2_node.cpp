#include "waymark/app/live/ros2_node.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/plot/annotate.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/robots/dds/ros_names.hpp"
#include "waymark/robots/ros2/initial_pose.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr Duration kMaxWait = std::chrono::seconds(3);

/// The first field of messages for images, calibration and tags.
struct Headed {
  ros2::Header header{};
  WAYMARK_ROS2_FIELDS(self.header)
};

struct HeadedOdometry {
  ros2::Header header{};
  std::string child_frame_id{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id)
};

/// The topic from which the camera frame is read, which is the one with the smallest messages.
std::pair<std::string, std::string_view> camera_topic_of(const Ros2Profile& profile) {
  if (!profile.camera_info_topic.empty()) return {profile.camera_info_topic, ros2::CameraInfo::kType};
  if (!profile.detections_topic.empty())
    return {profile.detections_topic, ros2::AprilTagDetectionArray::kType};
  if (!profile.compressed_image_topic.empty())
    return {profile.compressed_image_topic, ros2::CompressedImage::kType};
  return {profile.image_topic, ros2::Image::kType};
}

}  // namespace

RobotFrames::RobotFrames(NodeRobot robot) : robot_(std::move(robot)) {
  odom_ = robot_.profile ? frame_name(robot_.profile->odom_frame) : "";
  base_ = robot_.profile ? frame_name(robot_.profile->base_frame) : "";
}

Status RobotFrames::listen(Bus& bus, const std::string& topic, std::string_view type, const TopicQos& qos,
                           std::optional<std::size_t>& number) {
  const auto made = bus.subscribe(dds_topic(topic, type), qos);
  if (!made) return tl::unexpected(made.error());
  number = *made;
  return {};
}

Status RobotFrames::join(Bus& bus) {
  constexpr TopicQos kNewest{.reliable = false, .depth = 1};
  constexpr int kLinks = 100;
  Status status =
      listen(bus, "/tf_static", ros2::TFMessage::kType, {.transient_local = true, .depth = kLinks}, fixed_);
  if (status)
    status = listen(bus, "/tf", ros2::TFMessage::kType, {.reliable = false, .depth = kLinks}, moving_);
  if (robot_.profile && status)
    status = listen(bus, robot_.profile->odometry_topic, ros2::Odometry::kType, kNewest, odometry_);
  if (!robot_.profile || !robot_.own_images || !status) return status;
  const auto [topic, type] = camera_topic_of(*robot_.profile);
  return topic.empty() ? status : listen(bus, topic, type, kNewest, images_);
}

bool RobotFrames::take(Bus& bus, const BusMessage& message) {
  const auto is = [&](const std::optional<std::size_t>& number) { return number == message.subscription; };
  if (is(fixed_) || is(moving_)) {
    receive_transforms(message);
  } else if (is(odometry_)) {
    receive_odometry(message);
    end(bus, odometry_);
  } else if (is(images_)) {
    receive_camera(message);
    end(bus, images_);
  } else {
    return false;
  }
  return true;
}

void RobotFrames::receive_odometry(const BusMessage& message) {
  const auto decoded = cdr::decode<HeadedOdometry>(message.bytes);
  if (!decoded) return;
  if (odom_.empty()) odom_ = frame_name(decoded->header.frame_id);
  if (base_.empty()) base_ = frame_name(decoded->child_frame_id);
}

void RobotFrames::receive_camera(const BusMessage& message) {
  if (const auto decoded = cdr::decode<Headed>(message.bytes)) camera_ = frame_name(decoded->header.frame_id);
}

void RobotFrames::receive_transforms(const BusMessage& message) {
  const auto decoded = cdr::decode<ros2::TFMessage>(message.bytes);
  if (!decoded) return;
  for (const ros2::TransformStamped& link : decoded->transforms)
    tree_.add(link.header.frame_id, link.child_frame_id, std::nullopt);  // only the parent and the child
                                                                         // matter
}

void RobotFrames::end(Bus& bus, std::optional<std::size_t>& number) {
  if (number) bus.unsubscribe(*number);
  number.reset();
}

void RobotFrames::robot_started(Duration now) {
  if (!since_) since_ = now;
}

bool RobotFrames::settled(Duration now) const {
  return (!odometry_ && !images_) || (since_ && now - *since_ >= kMaxWait);
}

std::string RobotFrames::odom() const { return odom_.empty() ? std::string(ros2::kOdomFrame) : odom_; }
std::string RobotFrames::base() const { return base_.empty() ? std::string(ros2::kBaseFrame) : base_; }

std::string RobotFrames::camera(std::string_view name) const {
  const bool own = robot_.profile && robot_.own_images && name == "cam";
  return own && !camera_.empty() ? camera_ : ros2::camera_frame(name);
}

std::optional<ros2::TFMessage> RobotFrames::mount(Bus& bus, const std::string& camera, Duration now) {
  if (!since_ || now - *since_ < kMaxWait || !checked_cameras_.insert(camera).second) return std::nullopt;
  end(bus, moving_);
  const MountedCamera* mounted = find_camera(robot_.cameras, camera);
  const std::string frame = this->camera(camera);
  if (mounted == nullptr || tree_.joined(base(), frame)) return std::nullopt;
  mountings_.transforms.push_back(ros2::to_ros_transform({}, base(), frame, mounted->base_T_cam));
  return mountings_;
}

namespace {

constexpr Duration kNodeSlice = std::chrono::milliseconds(5);
constexpr Duration kStatusPeriod = std::chrono::seconds(1);
constexpr std::size_t kOdometryKept = 100;
constexpr std::size_t kMaxPathPoses = 5000;
constexpr const char* kServices[] = {"start_teach", "map", "replay", "pause", "stop"};

/// A phase in which a service has an effect, and the button that it corresponds to.
struct Rule {
  std::string_view service;
  std::string_view phase;
  ViewerOrder::Kind press;
};
using OrderKind = ViewerOrder::Kind;
constexpr Rule kRules[] = {
    {"start_teach", "idle", OrderKind::Teach}, {"start_teach", "ready", OrderKind::Teach},
    {"start_teach", "done", OrderKind::Teach}, {"start_teach", "stopped", OrderKind::Teach},
    {"map", "teaching", OrderKind::Go},        {"replay", "ready", OrderKind::Go},
    {"replay", "done", OrderKind::Go},         {"replay", "stopped", OrderKind::Go},
    {"replay", "paused", OrderKind::Go},       {"pause", "replaying", OrderKind::Go},
    {"stop", "replaying", OrderKind::Stop},    {"stop", "paused", OrderKind::Stop},
    {"stop", "teaching", OrderKind::Stop},
};

/// The newest odometry that is not later than the timestamp, or else the oldest one.
const Odometry* odometry_at(const std::deque<Odometry>& all, SensorTime stamp) {
  const auto later = std::ranges::find_if(all, [&](const Odometry& one) { return one.stamp > stamp; });
  if (all.empty()) return nullptr;
  return later == all.begin() ? &*later : &*std::prev(later);
}

/// Whether two statuses are equal, ignoring values that change continuously during a drive; those are
/// published with the next regular status.
bool is_unchanged(LiveStatus now, const LiveStatus& before) {
  now.driven_m = before.driven_m;
  now.goal_m = before.goal_m;
  now.dropped_images = before.dropped_images;
  return now == before;
}

}  // namespace

ViewerLabels service_labels() {
  const std::string buttons = fmt::format("ROS 2 services /waymark/{}", fmt::join(kServices, ", "));
  const auto of_state = [](OperatorState state) {
    const OrderKind pressed = state == OperatorState::Idle ? OrderKind::Teach : OrderKind::Go;
    const auto go = std::ranges::find_if(
        kRules, [&](const Rule& rule) { return rule.phase == to_string(state) && rule.press == pressed; });
    const std::string_view name = go == std::end(kRules) ? "replay" : go->service;
    return OperatorButtons{fmt::format("/waymark/{}", name), "/waymark/stop", "another program drives"};
  };
  return {.alone = "its buttons are the " + buttons,
          .beside = "the same buttons are the " + buttons,
          .stopped = "stopped by a ROS 2 service",
          .buttons = of_state};
}

ServiceButton button_of_service(const std::string& service, const std::string& phase) {
  for (const Rule& rule : kRules)
    if (rule.service == service && rule.phase == phase)
      return {rule.press, fmt::format("{} in phase {}", service, phase)};
  if (service == "stop") return {OrderKind::Stop, "stop"};  // accepted in every phase
  return {{}, fmt::format("{} has no effect in phase '{}'", service, phase)};
}

Result<std::unique_ptr<Ros2Node>> Ros2Node::start(std::unique_ptr<Bus> bus, LiveFeed& feed, NodeRobot robot) {
  std::unique_ptr<Ros2Node> node(new Ros2Node(std::move(bus), feed, std::move(robot)));
  Status status = node->offer_services();
  if (status) status = node->frames_.join(*node->bus_);
  if (status) status = node->subscribe_initial_pose();
  if (!status) return tl::unexpected(status.error());
  feed.set_listening(true);
  node->thread_ = std::thread([raw = node.get()] { raw->run(); });
  return node;
}

Ros2Node::~Ros2Node() {
  over_ = true;
  if (thread_.joinable()) thread_.join();
}

Status Ros2Node::offer_services() {
  for (const std::string service : kServices) {
    const auto answer = [this, service]() -> TriggerReply {
      const ServiceButton button = button_of_service(service, status_.phase);
      if (button.press) feed_.order({.kind = *button.press});
      return {button.press.has_value(), button.words};
    };
    if (Status status = services_.offer("/waymark/" + service, answer); !status) return status;
  }
  return {};
}

Status Ros2Node::subscribe_initial_pose() {
  const auto number = bus_->subscribe(dds_topic(kInitialPoseTopic, ros2::PoseWithCovarianceStamped::kType),
                                      {.reliable = false, .depth = 1});
  if (!number) return tl::unexpected(number.error());
  initial_pose_ = *number;
  return {};
}

void Ros2Node::receive(const BusMessage& message) {
  if (frames_.take(*bus_, message) || services_.receive(message) || message.subscription != initial_pose_)
    return;
  const Result<GivenPose> given = read_initial_pose(message.bytes);
  if (given) return feed_.order({.kind = ViewerOrder::Kind::GivePose, .pose = *given});
  ++refused_poses_;
  status_published_ = {};  // publish the count immediately
  feed_.order({.kind = ViewerOrder::Kind::Message,
               .message = fmt::format("initial pose rejected ({} so far): {}", refused_poses_,
                                      to_string(given.error()))});
}

void Ros2Node::run() {
  while (!over_) {
    if (const auto message = bus_->next(kNodeSlice)) receive(*message);
    publish_updates();
  }
}

std::optional<std::size_t> Ros2Node::publisher_of(const std::string& topic, std::string_view type,
                                                  const TopicQos& qos) {
  const auto found = publishers_.find(topic);
  if (found != publishers_.end()) return found->second;
  const auto made = bus_->advertise(dds_topic(topic, type), qos);
  if (!made) return std::nullopt;
  publishers_.emplace(topic, *made);
  return *made;
}

template <class Message>
void Ros2Node::publish(const std::string& topic, const Message& message, bool kept) {
  const TopicQos qos{.transient_local = kept, .depth = kept ? 1 : 10};
  if (const auto publisher = publisher_of(topic, Message::kType, qos))
    (void)bus_->publish(*publisher, cdr::encode(message));
}

/// Publishes the newest image with its tags, at most ten times per second and only to subscribers.
void Ros2Node::show(const TagFrame& tags) {
  constexpr Duration kPeriod = std::chrono::milliseconds(100);
  constexpr int kQuality = 80;
  constexpr TopicQos kImages{.reliable = true, .depth = 2, .large = true};
  if (!image_ || image_->stamp != tags.stamp || image_->camera != tags.camera) return;
  const auto publisher = publisher_of("/waymark/image/compressed", ros2::CompressedImage::kType, kImages);
  if (!publisher || steady_now() - shown_ < kPeriod || bus_->matched_subscriptions(*publisher) == 0) return;
  shown_ = steady_now();
  const auto drawn = plot::annotate(image_->image.view(), tags.detections);
  auto jpeg = drawn ? encode_jpeg(*drawn, kQuality) : tl::unexpected(drawn.error());
  if (!jpeg) return;
  const ros2::CompressedImage message{.header = {ros2::to_ros(tags.stamp), frames_.camera(tags.camera)},
                                      .format = "jpeg",
                                      .data = std::move(*jpeg)};
  (void)bus_->publish(*publisher, cdr::encode(message));
}

void Ros2Node::take_back(LiveSample& sample) {
  auto* received = std::get_if<Sample>(&sample.value);
  auto* image = received != nullptr ? std::get_if<CameraFrame>(received) : nullptr;
  if (image == nullptr) return;
  if (image_) feed_.give_back(std::move(*image_));
  image_ = std::move(*image);
}

void Ros2Node::publish_updates() {
  LiveFeed::Updates updates = feed_.take();
  for (LiveSample& sample : updates.samples) {
    std::visit([this](const auto& value) { publish_item(value); }, sample.value);
    keep_clock(sample);
    take_back(sample);
  }
  if (updates.shapes && updates.shapes != std::exchange(shapes_, updates.shapes))
    publish("/waymark/markers", *shapes_, true);
  const Duration now = steady_now();
  if (is_unchanged(updates.status, status_) && now - status_published_ < kStatusPeriod) return;
  if (updates.status.phase != status_.phase) path_.poses.clear();
  status_ = updates.status;
  status_published_ = now;
  publish_status(status_);
}

void Ros2Node::publish_item(const Sample& sample) {
  frames_.robot_started(steady_now());
  if (const auto* odometry = std::get_if<Odometry>(&sample)) {
    odometry_.push_back(*odometry);
    if (odometry_.size() > kOdometryKept) odometry_.pop_front();
  }
  if (const auto* tags = std::get_if<TagFrame>(&sample)) publish_item(*tags);
}

/// Waits for the frame names of the robot, because subscribers cannot place tags in an unknown frame.
void Ros2Node::publish_item(const TagFrame& tags) {
  if (!frames_.settled(steady_now())) return;
  mount(tags.camera);
  unreliable_tags_ += count_unreliable(tags.detections);
  ros2::AprilTagDetectionArray message = ros2::to_ros(tags);
  message.header.frame_id = frames_.camera(tags.camera);
  publish("/waymark/tags", message);
  show(tags);
}

void Ros2Node::mount(const std::string& camera) {
  if (const auto mountings = frames_.mount(*bus_, camera, steady_now()))
    publish("/tf_static", *mountings, true);
}

/// Uses the smallest difference, because transport only ever adds delay.
void Ros2Node::keep_clock(const LiveSample& sample) {
  const auto* received = std::get_if<Sample>(&sample.value);
  const auto* odometry = received != nullptr ? std::get_if<Odometry>(received) : nullptr;
  if (odometry == nullptr) return;
  behind_s_.push_back(1e-9 *
                      static_cast<double>(sample.host_ns - odometry->stamp.time_since_epoch().count()));
  if (behind_s_.size() > kOdometryKept) behind_s_.pop_front();
}

void Ros2Node::publish_item(const ros2::PoseWithCovarianceStamped& estimate) {
  publish("/waymark/pose", estimate);
  const SensorTime stamp = ros2::from_ros(estimate.header.stamp);
  if (const Odometry* odometry = odometry_at(odometry_, stamp)) {
    const SE3 map_T_odom = ros2::from_ros(estimate.pose.pose) * lift(odometry->odom_T_base).inverse();
    if (frames_.settled(steady_now()))
      publish("/tf",
              ros2::TFMessage{{ros2::to_ros_transform(stamp, ros2::kMapFrame, frames_.odom(), map_T_odom)}});
  }
  if (path_.poses.size() >= kMaxPathPoses)
    path_.poses.erase(path_.poses.begin(), path_.poses.begin() + kMaxPathPoses / 2);
  path_.header = estimate.header;
  path_.poses.push_back({estimate.header, estimate.pose.pose});
  constexpr std::size_t kEach = 10;  // publishing the whole path with each estimate is expensive
  if (path_.poses.size() % kEach == 0) publish("/waymark/path", path_);
}

void Ros2Node::publish_item(const ros2::DiagnosticArray& compared) { publish("/waymark/nis", compared); }

void Ros2Node::publish_status(const LiveStatus& status) {
  const bool lost = status.certain && !*status.certain;
  const bool is_halted = !status.reason.empty() || !status.halted.empty();
  ros2::DiagnosticStatus one{
      .level = static_cast<std::uint8_t>(is_halted ? 2
                                         : lost    ? 1
                                                   : 0),
      .name = "waymark: drive",
      .message = is_halted ? (status.halted.empty() ? status.reason : status.halted) : status.phase,
      .hardware_id = "waymark"};
  one.values = {{"phase", status.phase},
                {"certain", !status.certain   ? "unknown"
                            : *status.certain ? "true"
                                              : "false"},
                {"driven_m", std::to_string(status.driven_m)},
                {"goal_m", std::to_string(status.goal_m)},
                {"dropped_images", std::to_string(status.dropped_images)},
                {"robot_clock_behind_s",
                 behind_s_.empty() ? "unknown" : fmt::format("{:.3f}", *std::ranges::min_element(behind_s_))},
                {"unreliable_tags", std::to_string(unreliable_tags_)},
                {"refused_initial_poses", std::to_string(refused_poses_)}};
  ros2::DiagnosticArray message{.status = {std::move(one)}};
  const auto now = std::chrono::duration_cast<Duration>(std::chrono::system_clock::now().time_since_epoch());
  message.header.stamp = ros2::to_ros(SensorTime(now));
  publish("/diagnostics", message);
}

}  // namespace waymark
