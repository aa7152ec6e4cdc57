#include <cmath>

#include <nlohmann/json.hpp>

#include "waymark/geometry/planar.hpp"
#include "waymark/robots/process/base64.hpp"
#include "waymark/robots/process/robot_messages.hpp"

namespace waymark {
namespace {

using nlohmann::ordered_json;

ordered_json headed(const char* type, SensorTime stamp) {
  return {{"type", type}, {"stamp_ns", stamp.time_since_epoch().count()}};
}

void add_pose(ordered_json& line, const SE2& pose) {
  line["x_m"] = pose.x();
  line["y_m"] = pose.y();
  line["yaw_rad"] = pose.rotation().angle();
}

ordered_json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

ordered_json of(const Odometry& odometry) {
  ordered_json line = headed("odometry", odometry.stamp);
  add_pose(line, odometry.odom_T_base);
  line["speed_m_s"] = odometry.speed_m_s;
  line["yaw_rate_rad_s"] = odometry.yaw_rate_rad_s;
  return line;
}

ordered_json of(const TruthPose& truth) {
  ordered_json line = headed("truth", truth.stamp);
  add_pose(line, project_to_plane(truth.map_T_base));
  return line;
}

ordered_json of(const WheelTicks& wheels) {
  ordered_json line = headed("wheels", wheels.stamp);
  line["left_rad"] = wheels.left_rad;
  line["right_rad"] = wheels.right_rad;
  return line;
}

ordered_json of(const ImuSample& imu) {
  ordered_json line = headed("imu", imu.stamp);
  line["angular_velocity_rad_s"] = vector(imu.angular_velocity_rad_s);
  line["linear_acceleration_m_s2"] = vector(imu.linear_acceleration_m_s2);
  return line;
}

ordered_json of(const LaserScan& scan) {
  ordered_json line = headed("scan", scan.stamp);
  line["angle_min_rad"] = scan.angle_min_rad;
  line["angle_increment_rad"] = scan.angle_increment_rad;
  line["time_increment_s"] = scan.time_increment_s;
  line["range_min_m"] = scan.range_min_m;
  line["range_max_m"] = scan.range_max_m;
  ordered_json ranges = ordered_json::array();
  for (const float range_m : scan.ranges_m)
    ranges.push_back(std::isfinite(range_m) ? ordered_json(range_m) : ordered_json());
  line["ranges_m"] = std::move(ranges);
  return line;
}

ordered_json of(const GamepadState& pad) {
  ordered_json line = headed("gamepad", pad.stamp);
  line["axes"] = pad.axes;
  line["buttons"] = pad.buttons;
  return line;
}

/// A robot with one camera need not name it.
void add_camera(ordered_json& line, const std::string& camera) {
  if (camera != "cam") line["camera"] = camera;
}

ordered_json of(const TagFrame& frame) {
  ordered_json line = headed("detections", frame.stamp);
  add_camera(line, frame.camera);
  ordered_json tags = ordered_json::array();
  for (const TagDetection& detection : frame.detections) {
    ordered_json corners = ordered_json::array();
    for (const Eigen::Vector2d& corner : detection.corners_px)
      corners.push_back(ordered_json{corner.x(), corner.y()});
    ordered_json tag = {{"tag", to_string(detection.tag)},
                        {"hamming", detection.hamming},
                        {"decision_margin", detection.decision_margin},
                        {"corners_px", std::move(corners)}};
    if (detection.corner_covariance_px2)
      tag["corner_sigma_px"] = std::sqrt(detection.corner_covariance_px2->trace() / 8);
    tags.push_back(std::move(tag));
  }
  line["tags"] = std::move(tags);
  return line;
}

ordered_json of(const TagPoseFrame& frame) {
  ordered_json line = headed("tag_poses", frame.stamp);
  add_camera(line, frame.camera);
  ordered_json tags = ordered_json::array();
  for (const SeenTagPose& seen : frame.tags) {
    const Eigen::Quaterniond q = seen.cam_T_tag.rotation().quaternion();
    tags.push_back({{"tag", to_string(seen.tag)},
                    {"position_m", vector(seen.cam_T_tag.translation())},
                    {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}});
  }
  line["tags"] = std::move(tags);
  return line;
}

ordered_json of(const RobotHello& hello) {
  ordered_json line = {{"type", "hello"},
                       {"protocol_version", hello.protocol_version},
                       {"name", hello.name},
                       {"sends", hello.sends},
                       {"lockstep", hello.lockstep}};
  if (hello.simulated_time) line["simulated_time"] = true;
  if (hello.simulated) line["simulated"] = true;
  return line;
}

ordered_json of(const RobotStep& step) {
  ordered_json line = headed("step", step.stamp);
  line["step"] = step.step;
  return line;
}

ordered_json of(const RobotLog& log) { return {{"type", "log"}, {"text", log.text}}; }

template <class Anything>
ordered_json of(const Anything& /*has no line*/) {
  return {};
}

}  // namespace

std::string to_line(const RobotMessage& message, const std::vector<std::uint8_t>& picture) {
  ordered_json line;
  if (const auto* sample = std::get_if<Sample>(&message)) {
    line = std::visit([](const auto& value) { return of(value); }, *sample);
    if (const auto* frame = std::get_if<CameraFrame>(sample)) {
      line = headed("image", frame->stamp);
      add_camera(line, frame->camera);
      line["jpeg_base64"] = encode_base64(picture);
    }
  } else {
    line = std::visit([](const auto& value) { return of(value); }, message);
  }
  if (line.is_null() || line.empty()) return {};
  // Words may quote bytes of a network that are no UTF-8.
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace waymark
