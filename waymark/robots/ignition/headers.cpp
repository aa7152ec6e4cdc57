#include "waymark/robots/ignition/headers.hpp"

namespace waymark {
namespace {

constexpr std::int64_t kNanoseconds = 1'000'000'000;
constexpr std::int64_t kMostSeconds = std::int64_t{1} << 32;  // of simulated time; more would not fit either

void put(ignition::msgs::Header& header, const char* key, const std::string& value) {
  if (value.empty()) return;
  ignition::msgs::Header::Map& entry = *header.add_data();
  entry.set_key(key);
  entry.add_value(value);
}

}  // namespace

SensorTime from_ignition(const ignition::msgs::Time& time) {
  if (time.sec() < 0 || time.sec() > kMostSeconds) return {};
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

}  // namespace waymark
