#include "waymark/robots/ignition/values.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <ignition/msgs/clock.pb.h>
#include <ignition/msgs/imu.pb.h>
#include <ignition/msgs/joy.pb.h>
#include <ignition/msgs/laserscan.pb.h>
#include <ignition/msgs/odometry.pb.h>
#include <ignition/msgs/pose_v.pb.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/ros2/convert.hpp"

namespace waymark {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::int64_t kMaxSeconds = std::int64_t{1} << 32;  // keeps the timestamp from overflowing

void put(ignition::msgs::Header& header, const char* key, const std::string& value) {
  if (value.empty()) return;
  ignition::msgs::Header::Map& entry = *header.add_data();
  entry.set_key(key);
  entry.add_value(value);
}

}  // namespace

SensorTime from_ignition(const ignition::msgs::Time& time) {
  if (time.sec() < 0 || time.sec() > kMaxSeconds) return {};
  return SensorTime(Duration(time.sec() * kNanoseconds + time.nsec()));
}

ignition::msgs::Time to_ignition(SensorTime stamp) {
  ignition::msgs::Time time;
  const std::int64_t ns = stamp.time_since_epoch().count();
  time.set_sec(ns / kNanoseconds);
  time.set_nsec(static_cast<std::int32_t>(ns % kNanoseconds));
  return time;
}

ignition::msgs::Header header(SensorTime stamp, const std::string& frame, const std::string& child_frame) {
  ignition::msgs::Header made;
  *made.mutable_stamp() = to_ignition(stamp);
  put(made, "frame_id", frame);
  put(made, "child_frame_id", child_frame);
  return made;
}

std::string header_value(const ignition::msgs::Header& header, const std::string& key) {
  for (const auto& entry : header.data())
    if (entry.key() == key && entry.value_size() > 0) return entry.value(0);
  return {};
}

Result<SE3> from_ignition(const ignition::msgs::Pose& pose) {
  const Eigen::Vector3d place(pose.position().x(), pose.position().y(), pose.position().z());
  if (!pose.has_orientation()) return SE3(SO3(), place);
  const auto& q = pose.orientation();
  const auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()));
  if (!rotation) return tl::unexpected(rotation.error());
  return SE3(*rotation, place);
}

ignition::msgs::Pose to_ignition(const SE3& pose) {
  ignition::msgs::Pose message;
  message.mutable_position()->set_x(pose.translation().x());
  message.mutable_position()->set_y(pose.translation().y());
  message.mutable_position()->set_z(pose.translation().z());
  const Eigen::Quaterniond& q = pose.rotation().quaternion();
  message.mutable_orientation()->set_w(q.w());
  message.mutable_orientation()->set_x(q.x());
  message.mutable_orientation()->set_y(q.y());
  message.mutable_orientation()->set_z(q.z());
  return message;
}

VelocityCommand from_ignition(const ignition::msgs::Twist& twist) {
  return {twist.linear().x(), twist.angular().z()};
}

ignition::msgs::Twist to_ignition(const VelocityCommand& velocity) {
  ignition::msgs::Twist message;
  message.mutable_linear()->set_x(velocity.speed_m_s);
  message.mutable_angular()->set_z(velocity.yaw_rate_rad_s);
  return message;
}

namespace {

/// The ROS name for a pixel format; empty if it is not supported.
std::string encoding_of(ignition::msgs::PixelFormatType format) {
  switch (format) {
    case ignition::msgs::L_INT8:
      return "mono8";
    case ignition::msgs::L_INT16:
      return "mono16";
    case ignition::msgs::RGB_INT8:
      return "rgb8";
    case ignition::msgs::BGR_INT8:
      return "bgr8";
    case ignition::msgs::RGBA_INT8:
      return "rgba8";
    case ignition::msgs::BGRA_INT8:
      return "bgra8";
    default:
      return {};
  }
}

/// Copies as many elements as the shorter array has.
template <class From, class To>
void copy_numbers(const From& from, To& to) {
  std::copy_n(from.begin(), std::min<std::size_t>(to.size(), static_cast<std::size_t>(from.size())),
              to.begin());
}

}  // namespace

Result<CameraFrame> from_ignition(const ignition::msgs::Image& message) {
  const std::string encoding = encoding_of(message.pixel_format_type());
  if (encoding.empty())
    return fail(ErrorCode::Unsupported,
                fmt::format("unsupported image format {}",
                            ignition::msgs::PixelFormatType_Name(message.pixel_format_type())),
                {}, "Set <format>R8G8B8</format> or <format>L8</format> for the camera.");
  const std::string& data = message.data();
  return ros2::from_ros(ros2::Image{.header = {ros2::to_ros(from_ignition(message.header().stamp())), ""},
                                    .height = message.height(),
                                    .width = message.width(),
                                    .encoding = encoding,
                                    .is_bigendian = 0,
                                    .step = message.step(),
                                    .data = {data.begin(), data.end()}});
}

ignition::msgs::Image to_ignition(const CameraFrame& frame) {
  constexpr std::size_t kChannels = 3;
  const Image& image = frame.image;
  ignition::msgs::Image message;
  *message.mutable_header() = header(frame.stamp, frame.camera);
  message.set_width(static_cast<std::uint32_t>(image.width()));
  message.set_height(static_cast<std::uint32_t>(image.height()));
  message.set_step(static_cast<std::uint32_t>(image.width()) * kChannels);
  message.set_pixel_format_type(ignition::msgs::RGB_INT8);
  std::string& data = *message.mutable_data();
  data.reserve(static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()) *
               kChannels);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) data.append(kChannels, static_cast<char>(image.row(y)[x]));
  return message;
}

Result<GazeboCamera> from_ignition(const ignition::msgs::CameraInfo& message) {
  if (message.distortion().model() != ignition::msgs::CameraInfo::Distortion::PLUMB_BOB)
    return fail(ErrorCode::Unsupported, "unsupported distortion model; only PLUMB_BOB is supported");
  ros2::CameraInfo info{.height = message.height(),
                        .width = message.width(),
                        .distortion_model = "plumb_bob",
                        .d = {message.distortion().k().begin(), message.distortion().k().end()}};
  copy_numbers(message.intrinsics().k(), info.k);
  copy_numbers(message.projection().p(), info.p);
  copy_numbers(message.rectification_matrix(), info.r);
  const auto camera = ros2::from_ros(info);
  if (!camera) return tl::unexpected(camera.error());
  return GazeboCamera{from_ignition(message.header().stamp()), *camera};
}

ignition::msgs::CameraInfo to_ignition(const GazeboCamera& camera) {
  const ros2::CameraInfo info = ros2::to_ros(camera.camera, camera.stamp);
  ignition::msgs::CameraInfo message;
  *message.mutable_header() = header(camera.stamp, "camera");
  message.set_width(info.width);
  message.set_height(info.height);
  message.mutable_distortion()->mutable_k()->Add(info.d.begin(), info.d.end());
  message.mutable_intrinsics()->mutable_k()->Add(info.k.begin(), info.k.end());
  message.mutable_projection()->mutable_p()->Add(info.p.begin(), info.p.end());
  message.mutable_rectification_matrix()->Add(info.r.begin(), info.r.end());
  return message;
}

namespace {

namespace msgs = ignition::msgs;

Eigen::Vector3d vector(const msgs::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

void put(const Eigen::Vector3d& from, msgs::Vector3d& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

/// The pose with the name of the model or, for a part, with the child frame that PosePublisher writes.
Result<GazeboPose> named(const msgs::Pose& pose) {
  const auto place = from_ignition(pose);
  if (!place) return tl::unexpected(place.error());
  const std::string child = header_value(pose.header(), "child_frame_id");
  return GazeboPose{child.empty() ? pose.name() : child, *place};
}

Result<GazeboValue> read(const msgs::Odometry& message) {
  const auto pose = from_ignition(message.pose());
  if (!pose) return tl::unexpected(pose.error());
  const VelocityCommand velocity = from_ignition(message.twist());
  return Odometry{from_ignition(message.header().stamp()), project_to_plane(*pose), velocity.speed_m_s,
                  velocity.yaw_rate_rad_s};
}

Result<GazeboValue> read(const msgs::IMU& message) {
  return ImuSample{from_ignition(message.header().stamp()), vector(message.angular_velocity()),
                   vector(message.linear_acceleration())};
}

Result<GazeboValue> read(const msgs::LaserScan& message) {
  if (message.vertical_count() > 1)
    return fail(ErrorCode::Unsupported,
                fmt::format("it has {} rows of rays; only one is supported", message.vertical_count()), {},
                "Set one vertical sample for the lidar.");
  LaserScan scan{.stamp = from_ignition(message.header().stamp()),
                 .angle_min_rad = message.angle_min(),
                 .angle_increment_rad = message.angle_step(),
                 .range_min_m = message.range_min(),
                 .range_max_m = message.range_max()};
  scan.ranges_m.assign(message.ranges().begin(), message.ranges().end());
  return scan;
}

Result<GazeboValue> read(const msgs::Joy& message) {
  return GamepadState{from_ignition(message.header().stamp()),
                      {message.axes().begin(), message.axes().end()},
                      {message.buttons().begin(), message.buttons().end()}};
}

Result<GazeboValue> read(const msgs::Clock& message) { return GazeboClock{from_ignition(message.sim())}; }

Result<GazeboValue> read(const msgs::Twist& message) {
  return StampedCommand{from_ignition(message.header().stamp()), from_ignition(message)};
}

Result<GazeboValue> read(const msgs::Pose& message) {
  const auto pose = named(message);
  if (!pose) return tl::unexpected(pose.error());
  return GazeboPoses{from_ignition(message.header().stamp()), {*pose}};
}

Result<GazeboValue> read(const msgs::Pose_V& message) {
  GazeboPoses poses{.stamp = from_ignition(message.header().stamp())};
  for (const msgs::Pose& one : message.pose()) {
    const auto pose = named(one);
    if (!pose) return tl::unexpected(pose.error());
    poses.poses.push_back(*pose);
  }
  return poses;
}

template <class Message>
Result<GazeboValue> read_converted(const Message& message) {
  auto value = from_ignition(message);
  if (!value) return tl::unexpected(value.error());
  return std::move(*value);
}
Result<GazeboValue> read(const msgs::Image& message) { return read_converted(message); }
Result<GazeboValue> read(const msgs::CameraInfo& message) { return read_converted(message); }

template <class Message>
Result<GazeboValue> parse(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return fail(ErrorCode::Unreadable,
                fmt::format("its {} bytes are not a valid {}", bytes.size(), message.GetTypeName()));
  return read(message);
}

/// A supported type and its parser.
struct TypeParser {
  std::string_view type;
  Result<GazeboValue> (*parse)(std::string_view bytes);
};
constexpr TypeParser kTypeParsers[] = {{"ignition.msgs.Odometry", parse<msgs::Odometry>},
                                       {"ignition.msgs.IMU", parse<msgs::IMU>},
                                       {"ignition.msgs.LaserScan", parse<msgs::LaserScan>},
                                       {"ignition.msgs.Image", parse<msgs::Image>},
                                       {"ignition.msgs.CameraInfo", parse<msgs::CameraInfo>},
                                       {"ignition.msgs.Joy", parse<msgs::Joy>},
                                       {"ignition.msgs.Pose", parse<msgs::Pose>},
                                       {"ignition.msgs.Pose_V", parse<msgs::Pose_V>},
                                       {"ignition.msgs.Clock", parse<msgs::Clock>},
                                       {"ignition.msgs.Twist", parse<msgs::Twist>}};

msgs::Odometry message_of(const Odometry& odometry) {
  msgs::Odometry message;
  *message.mutable_header() = header(odometry.stamp, "odom", "base_link");
  *message.mutable_pose() = to_ignition(lift(odometry.odom_T_base));
  *message.mutable_twist() = to_ignition(VelocityCommand{odometry.speed_m_s, odometry.yaw_rate_rad_s});
  return message;
}

msgs::IMU message_of(const ImuSample& imu) {
  msgs::IMU message;
  *message.mutable_header() = header(imu.stamp, "imu");
  message.mutable_orientation()->set_w(1);
  put(imu.angular_velocity_rad_s, *message.mutable_angular_velocity());
  put(imu.linear_acceleration_m_s2, *message.mutable_linear_acceleration());
  return message;
}

msgs::LaserScan message_of(const LaserScan& scan) {
  msgs::LaserScan message;
  *message.mutable_header() = header(scan.stamp, "lidar");
  message.set_angle_min(scan.angle_min_rad);
  message.set_angle_step(scan.angle_increment_rad);
  const double steps = scan.ranges_m.empty() ? 0 : static_cast<double>(scan.ranges_m.size() - 1);
  message.set_angle_max(scan.angle_min_rad + steps * scan.angle_increment_rad);
  message.set_range_min(scan.range_min_m);
  message.set_range_max(scan.range_max_m);
  message.set_count(static_cast<std::uint32_t>(scan.ranges_m.size()));
  message.set_vertical_count(1);
  message.mutable_ranges()->Add(scan.ranges_m.begin(), scan.ranges_m.end());
  return message;
}

msgs::Joy message_of(const GamepadState& state) {
  msgs::Joy message;
  *message.mutable_header() = header(state.stamp, "");
  message.mutable_axes()->Add(state.axes.begin(), state.axes.end());
  message.mutable_buttons()->Add(state.buttons.begin(), state.buttons.end());
  return message;
}

msgs::Clock message_of(const GazeboClock& clock) {
  msgs::Clock message;
  *message.mutable_sim() = to_ignition(clock.stamp);
  return message;
}

msgs::Twist message_of(const StampedCommand& command) {
  return to_ignition(command.command);  // without a timestamp, like Gazebo's own programs
}

msgs::Pose_V message_of(const GazeboPoses& poses) {
  msgs::Pose_V message;
  *message.mutable_header() = header(poses.stamp, "");
  for (const GazeboPose& one : poses.poses) {
    msgs::Pose& pose = *message.add_pose();
    pose = to_ignition(one.world_T_model);
    *pose.mutable_header() = header(poses.stamp, "world", one.name);
    pose.set_name(one.name);
  }
  return message;
}

msgs::Image message_of(const CameraFrame& frame) { return to_ignition(frame); }
msgs::CameraInfo message_of(const GazeboCamera& camera) { return to_ignition(camera); }

}  // namespace

Result<GazeboValue> parse_gazebo(std::string_view type, std::string_view bytes) {
  for (const TypeParser& parser : kTypeParsers)
    if (parser.type == type) return parser.parse(bytes);
  return fail(ErrorCode::Unsupported, fmt::format("unsupported message type {}", type));
}

std::string type_of(const GazeboValue& value) {
  return std::visit([](const auto& one) { return message_of(one).GetTypeName(); }, value);
}

std::string serialize_gazebo(const GazeboValue& value) {
  return std::visit([](const auto& one) { return message_of(one).SerializeAsString(); }, value);
}

}  // namespace waymark
