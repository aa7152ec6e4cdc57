#include "waymark/app/convert/sample_words.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using Json = nlohmann::ordered_json;

struct Kind {
  const char* operator()(const TagFrame& /**/) const { return "tags"; }
  const char* operator()(const Odometry& /**/) const { return "odometry"; }
  const char* operator()(const WheelTicks& /**/) const { return "wheels"; }
  const char* operator()(const ImuSample& /**/) const { return "imu"; }
  const char* operator()(const StampedCommand& /**/) const { return "commands"; }
  const char* operator()(const TruthPose& /**/) const { return "truth"; }
  const char* operator()(const CameraFrame& /**/) const { return "pictures"; }
  const char* operator()(const TagPoseFrame& /**/) const { return "tag_poses"; }
  const char* operator()(const RangeBearing& /**/) const { return "range_bearing"; }
  const char* operator()(const LaserScan& /**/) const { return "scans"; }
  const char* operator()(const GamepadState& /**/) const { return "gamepad"; }
};

std::string planar(const SE2& a_T_b) {
  return fmt::format("x {:.3f} m, y {:.3f} m, yaw {:.2f} deg", a_T_b.translation().x(),
                     a_T_b.translation().y(), a_T_b.rotation().angle() * 180 / M_PI);
}

std::size_t echoes(const LaserScan& scan) {
  std::size_t n = 0;
  for (const float range : scan.ranges_m)
    n += range >= scan.range_min_m && range <= scan.range_max_m ? 1U : 0U;
  return n;
}

struct Words {
  std::string operator()(const TagFrame& s) const {
    std::vector<std::string> tags;
    for (const TagDetection& d : s.detections) tags.push_back(to_string(d.tag));
    return tags.empty() ? "none" : fmt::format("{}", fmt::join(tags, " "));
  }
  std::string operator()(const Odometry& s) const {
    return fmt::format("{}, {:.3f} m/s, {:.3f} rad/s", planar(s.odom_T_base), s.speed_m_s, s.yaw_rate_rad_s);
  }
  std::string operator()(const WheelTicks& s) const {
    return fmt::format("left {:.3f} rad, right {:.3f} rad", s.left_rad, s.right_rad);
  }
  std::string operator()(const ImuSample& s) const {
    const auto& w = s.angular_velocity_rad_s;
    const auto& a = s.linear_acceleration_m_s2;
    return fmt::format("{:.4f} {:.4f} {:.4f} rad/s, {:.3f} {:.3f} {:.3f} m/s^2", w.x(), w.y(), w.z(), a.x(),
                       a.y(), a.z());
  }
  std::string operator()(const StampedCommand& s) const {
    return fmt::format("{:.3f} m/s, {:.3f} rad/s", s.command.speed_m_s, s.command.yaw_rate_rad_s);
  }
  std::string operator()(const TruthPose& s) const { return planar(project_to_plane(s.map_T_base)); }
  std::string operator()(const CameraFrame& s) const {
    return fmt::format("{}: {} x {} px", s.camera, s.image.width(), s.image.height());
  }
  std::string operator()(const TagPoseFrame& s) const {
    std::vector<std::string> tags;
    for (const SeenTagPose& t : s.tags)
      tags.push_back(fmt::format("{} at {:.3f} m", to_string(t.tag), t.cam_T_tag.translation().norm()));
    return tags.empty() ? "none" : fmt::format("{}", fmt::join(tags, ", "));
  }
  std::string operator()(const RangeBearing& s) const {
    return fmt::format("landmark {}: {:.3f} m, {:.2f} deg", s.landmark, s.range_m,
                       s.bearing_rad * 180 / M_PI);
  }
  std::string operator()(const LaserScan& s) const {
    return fmt::format("{} rays, {} echoes", s.ranges_m.size(), echoes(s));
  }
  std::string operator()(const GamepadState& s) const {
    return fmt::format("axes {:.2f}, buttons {}", fmt::join(s.axes, " "), fmt::join(s.buttons, " "));
  }
};

/// JSON has no infinity; null says the same of a number that is none.
template <class Number>
Json number(Number value) {
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}
Json list(const Eigen::Vector3d& v) { return {number(v.x()), number(v.y()), number(v.z())}; }
Json list(const std::vector<float>& values) {
  Json out = Json::array();
  for (const float value : values) out.push_back(number(value));
  return out;
}
Json pose(const SE3& a_T_b) {
  const Eigen::Quaterniond q = a_T_b.rotation().quaternion();
  return {{"translation_m", list(a_T_b.translation())}, {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}
Json pose(const SE2& a_T_b) {
  return {{"x_m", number(a_T_b.translation().x())},
          {"y_m", number(a_T_b.translation().y())},
          {"yaw_rad", number(a_T_b.rotation().angle())}};
}

struct Fields {
  Json& out;

  void operator()(const TagFrame& s) const {
    out["camera"] = s.camera;
    Json tags = Json::array();
    for (const TagDetection& d : s.detections) {
      Json corners = Json::array();
      for (const Eigen::Vector2d& corner : d.corners_px)
        corners.push_back({number(corner.x()), number(corner.y())});
      tags.push_back({{"tag", to_string(d.tag)}, {"corners_px", corners}});
    }
    out["detections"] = tags;
  }
  void operator()(const Odometry& s) const {
    out["odom_T_base"] = pose(s.odom_T_base);
    out["speed_m_s"] = number(s.speed_m_s);
    out["yaw_rate_rad_s"] = number(s.yaw_rate_rad_s);
  }
  void operator()(const WheelTicks& s) const {
    out["left_rad"] = number(s.left_rad);
    out["right_rad"] = number(s.right_rad);
  }
  void operator()(const ImuSample& s) const {
    out["angular_velocity_rad_s"] = list(s.angular_velocity_rad_s);
    out["linear_acceleration_m_s2"] = list(s.linear_acceleration_m_s2);
  }
  void operator()(const StampedCommand& s) const {
    out["speed_m_s"] = number(s.command.speed_m_s);
    out["yaw_rate_rad_s"] = number(s.command.yaw_rate_rad_s);
  }
  void operator()(const TruthPose& s) const { out["map_T_base"] = pose(s.map_T_base); }
  void operator()(const CameraFrame& s) const {
    out["camera"] = s.camera;
    out["width_px"] = s.image.width();
    out["height_px"] = s.image.height();
  }
  void operator()(const TagPoseFrame& s) const {
    out["camera"] = s.camera;
    Json tags = Json::array();
    for (const SeenTagPose& t : s.tags)
      tags.push_back({{"tag", to_string(t.tag)}, {"cam_T_tag", pose(t.cam_T_tag)}});
    out["tags"] = tags;
  }
  void operator()(const RangeBearing& s) const {
    out["landmark"] = s.landmark;
    out["range_m"] = number(s.range_m);
    out["bearing_rad"] = number(s.bearing_rad);
  }
  void operator()(const LaserScan& s) const {
    out["angle_min_rad"] = number(s.angle_min_rad);
    out["angle_increment_rad"] = number(s.angle_increment_rad);
    out["ranges_m"] = list(s.ranges_m);
  }
  void operator()(const GamepadState& s) const {
    out["axes"] = list(s.axes);
    out["buttons"] = s.buttons;
  }
};

}  // namespace

const char* kind_of(const Sample& sample) { return std::visit(Kind{}, sample); }

std::string to_text(const Sample& sample, SensorTime start) {
  return fmt::format("{:>10.3f}  {:<13}  {}\n", to_seconds(stamp_of(sample) - start), kind_of(sample),
                     std::visit(Words{}, sample));
}

Json to_json(const Sample& sample) {
  Json out = {{"kind", kind_of(sample)}, {"stamp_ns", stamp_of(sample).time_since_epoch().count()}};
  std::visit(Fields{out}, sample);
  return out;
}

}  // namespace waymark
