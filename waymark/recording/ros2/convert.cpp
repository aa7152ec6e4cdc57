#include "waymark/recording/ros2/convert.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/camera/calibration_numbers.hpp"
#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/raw_pixels.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark::ros2 {
namespace {

constexpr double kHalfPixel = 0.5;  // offset from pixel centres in ROS to those in Waymark

Result<FamilyId> family_of(const std::string& name) {
  if (name.empty() || name == "mit" || name == "tf36h11") return FamilyId::Tag36h11;
  return parse_family(name);
}

}  // namespace

Result<TagFrame> from_ros(const ApriltagArrayStamped& message) {
  TagFrame frame{.stamp = from_ros(message.header.stamp), .camera = camera_of_frame(message.header.frame_id)};
  for (const Apriltag& in : message.apriltags) {
    const Result<FamilyId> family = family_of(in.family);
    if (!family) return tl::unexpected(family.error());
    TagDetection detection{.tag = {*family, in.id}, .hamming = in.hamming};
    for (std::size_t i = 0; i < 4; ++i)
      detection.corners_px[3 - i] = {in.corners[i].x + kHalfPixel, in.corners[i].y + kHalfPixel};
    frame.detections.push_back(detection);
  }
  return frame;
}

namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
constexpr std::string_view kLeftWheel = "left_wheel";
constexpr std::string_view kRightWheel = "right_wheel";
constexpr std::string_view kWheel = "wheel";
constexpr std::string_view kLeft = "left";
constexpr std::string_view kRight = "right";

Header header(SensorTime stamp, std::string_view frame) { return {to_ros(stamp), std::string(frame)}; }
Vector3 vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d vector(const Vector3& v) { return {v.x, v.y, v.z}; }

Quaternion quaternion(const SO3& a_R_b) {
  const Eigen::Quaterniond q = a_R_b.quaternion();
  return {q.x(), q.y(), q.z(), q.w()};
}
SO3 rotation(const Quaternion& q) {
  if (!sound(q)) return {};  // readers of files check sound() first
  return SO3::from_matrix(Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix());
}

/// Sets the image of the tag centre, and the homography as defined in libapriltag. The homography maps the
/// tag square, [-1, 1] x [-1, 1] with y down, to pixels; it is row-major with last element 1. Uses the closed
/// form of Heckbert, "Fundamentals of Texture Mapping and Image Warping", section 2.2.3. If the corners are
/// not a perspective image of a square, sets the homography to zero and the centre to the mean of the
/// corners.
void set_homography(AprilTagDetection& detection) {
  std::array<Eigen::Vector2d, 4> px;  // TL TR BR BL
  for (std::size_t i = 0; i < 4; ++i) px[3 - i] = {detection.corners[i].x, detection.corners[i].y};
  const Eigen::Vector2d sum = px[0] - px[1] + px[2] - px[3];
  const Eigen::Vector2d right = px[1] - px[2];
  const Eigen::Vector2d bottom = px[3] - px[2];
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const double g = cross(sum, bottom) / cross(right, bottom);
  const double h = cross(right, sum) / cross(right, bottom);
  Eigen::Matrix3d px_H_unit;
  px_H_unit << px[1] - px[0] + g * px[1], px[3] - px[0] + h * px[3], px[0], g, h, 1;
  Eigen::Matrix3d unit_H_tag;
  unit_H_tag << 0.5, 0, 0.5, 0, 0.5, 0.5, 0, 0, 1;
  Eigen::Matrix3d px_H_tag = px_H_unit * unit_H_tag;
  px_H_tag /= px_H_tag(2, 2);
  Eigen::Vector2d centre = px_H_tag.col(2).head<2>();
  if (!px_H_tag.allFinite()) {
    px_H_tag.setZero();
    centre = (px[0] + px[1] + px[2] + px[3]) / 4;
  }
  detection.centre = {centre.x(), centre.y()};
  for (int i = 0; i < 9; ++i) detection.homography[static_cast<std::size_t>(i)] = px_H_tag(i / 3, i % 3);
}

}  // namespace

Time to_ros(SensorTime stamp) {
  const std::int64_t ns = stamp.time_since_epoch().count();
  const std::int64_t sec = ns >= 0 ? ns / kSecond : -((-ns + kSecond - 1) / kSecond);
  return {static_cast<std::int32_t>(sec), static_cast<std::uint32_t>(ns - sec * kSecond)};
}

SensorTime from_ros(const Time& stamp) { return SensorTime(Duration(stamp.sec * kSecond + stamp.nanosec)); }

Pose to_ros(const SE3& a_T_b) { return {vector(a_T_b.translation()), quaternion(a_T_b.rotation())}; }

SE3 from_ros(const Pose& pose) { return {rotation(pose.orientation), vector(pose.position)}; }

TransformStamped to_ros_transform(SensorTime stamp, std::string_view parent, std::string_view child,
                                  const SE3& parent_T_child) {
  return {header(stamp, parent), std::string(child), vector(parent_T_child.translation()),
          quaternion(parent_T_child.rotation())};
}

SE3 from_ros(const TransformStamped& transform) {
  return {rotation(transform.rotation), vector(transform.translation)};
}

Odometry to_ros(const waymark::Odometry& odometry) {
  Odometry message;
  message.header = header(odometry.stamp, kOdomFrame);
  message.child_frame_id = kBaseFrame;
  message.pose.pose = to_ros(lift(odometry.odom_T_base));
  message.twist.twist.linear.x = odometry.speed_m_s;
  message.twist.twist.angular.z = odometry.yaw_rate_rad_s;
  return message;
}

waymark::Odometry from_ros(const Odometry& message) {
  return {from_ros(message.header.stamp), project_to_plane(from_ros(message.pose.pose)),
          message.twist.twist.linear.x, message.twist.twist.angular.z};
}

JointState to_ros(const WheelTicks& ticks) {
  return {header(ticks.stamp, kBaseFrame),
          {std::string(kLeftWheel), std::string(kRightWheel)},
          {ticks.left_rad, ticks.right_rad},
          {},
          {}};
}

Result<WheelTicks> from_ros(const JointState& message) {
  WheelTicks ticks{.stamp = from_ros(message.header.stamp)};
  bool left = false;
  bool right = false;
  for (std::size_t i = 0; i < std::min(message.name.size(), message.position.size()); ++i) {
    const std::string& name = message.name[i];
    if (name.find(kWheel) == std::string::npos) continue;
    if (!left && name.find(kLeft) != std::string::npos) {
      ticks.left_rad = message.position[i];
      left = true;
    } else if (!right && name.find(kRight) != std::string::npos) {
      ticks.right_rad = message.position[i];
      right = true;
    }
  }
  if (!left || !right)
    return fail(ErrorCode::Unreadable,
                "JointState without a left and a right wheel (left_wheel, wheel_left_joint, …)");
  return ticks;
}

Imu to_ros(const ImuSample& imu) {
  Imu message;
  message.header = header(imu.stamp, kBaseFrame);
  message.angular_velocity = vector(imu.angular_velocity_rad_s);
  message.linear_acceleration = vector(imu.linear_acceleration_m_s2);
  return message;
}

ImuSample from_ros(const Imu& message) {
  return {from_ros(message.header.stamp), vector(message.angular_velocity),
          vector(message.linear_acceleration)};
}

TwistStamped to_ros(const StampedCommand& command) {
  TwistStamped message;
  message.header = header(command.stamp, kBaseFrame);
  message.twist.linear.x = command.command.speed_m_s;
  message.twist.angular.z = command.command.yaw_rate_rad_s;
  return message;
}

StampedCommand from_ros(const TwistStamped& message) {
  return {from_ros(message.header.stamp), {message.twist.linear.x, message.twist.angular.z}};
}

PoseStamped to_ros(const TruthPose& truth) {
  return {header(truth.stamp, kMapFrame), to_ros(truth.map_T_base)};
}

namespace {

AprilTagDetection message_of(const TagDetection& detection) {
  AprilTagDetection out;
  out.family = to_string(detection.tag.family);
  out.id = detection.tag.number;
  out.hamming = detection.hamming;
  out.decision_margin = static_cast<float>(detection.decision_margin);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d& corner = detection.corners_px[3 - i];
    out.corners[i] = {corner.x() - kHalfPixel, corner.y() - kHalfPixel};
  }
  set_homography(out);
  return out;
}

Result<TagDetection> detection_of(const AprilTagDetection& in) {
  // Older recorders leave the family empty; all of them used tag36h11.
  const Result<FamilyId> family = parse_family(in.family.empty() ? "tag36h11" : in.family);
  if (!family) return tl::unexpected(family.error());
  TagDetection detection{
      .tag = {*family, in.id}, .hamming = in.hamming, .decision_margin = in.decision_margin};
  for (std::size_t i = 0; i < 4; ++i) {
    detection.corners_px[3 - i] = Eigen::Vector2d(in.corners[i].x + kHalfPixel, in.corners[i].y + kHalfPixel);
  }
  return detection;
}

/// Unknown covariances are all zero, a value that no detector produces.
void append_covariance(const TagDetection& detection, std::vector<double>& numbers) {
  const CornerCovariance covariance = detection.corner_covariance_px2.value_or(CornerCovariance::Zero());
  numbers.insert(numbers.end(), covariance.data(), covariance.data() + covariance.size());
}

void take_covariance(const std::vector<double>& numbers, std::size_t entry, TagDetection& detection) {
  const CornerCovariance covariance = Eigen::Map<const CornerCovariance>(numbers.data() + 64 * entry);
  if (!covariance.isZero(0)) detection.corner_covariance_px2 = covariance;
}

}  // namespace

AprilTagDetectionArray to_ros(const TagFrame& frame) {
  AprilTagDetectionArray message{.header = header(frame.stamp, camera_frame(frame.camera))};
  for (const TagDetection& detection : frame.detections)
    if (usable_corners(detection)) message.detections.push_back(message_of(detection));
  return message;
}

TagCornerCovariances covariances_to_ros(const TagFrame& frame) {
  TagCornerCovariances message{.header = header(frame.stamp, camera_frame(frame.camera))};
  for (const TagDetection& detection : frame.detections) {
    if (!usable_corners(detection)) continue;
    message.id.push_back(detection.tag.number);
    append_covariance(detection, message.covariance_px2);
  }
  return message;
}

UnreliableTags unreliable_to_ros(const TagFrame& frame) {
  UnreliableTags message{.header = header(frame.stamp, camera_frame(frame.camera))};
  for (std::size_t i = 0; i < frame.detections.size(); ++i) {
    const TagDetection& detection = frame.detections[i];
    if (usable_corners(detection)) continue;
    message.index.push_back(static_cast<std::int32_t>(i));
    message.detections.push_back(message_of(detection));
    append_covariance(detection, message.covariance_px2);
  }
  return message;
}

Result<TagFrame> from_ros(const AprilTagDetectionArray& message) {
  TagFrame frame{.stamp = from_ros(message.header.stamp), .camera = camera_of_frame(message.header.frame_id)};
  for (const AprilTagDetection& in : message.detections) {
    Result<TagDetection> detection = detection_of(in);
    if (!detection) return tl::unexpected(detection.error());
    frame.detections.push_back(std::move(*detection));
  }
  return frame;
}

Status add_covariances(TagFrame& frame, const TagCornerCovariances& message) {
  const std::size_t count = frame.detections.size();
  bool same = message.id.size() == count && message.covariance_px2.size() == 64 * count;
  for (std::size_t i = 0; same && i < count; ++i) same = message.id[i] == frame.detections[i].tag.number;
  if (!same)
    return fail(ErrorCode::Unreadable, "corner covariances do not match the detections of the frame");
  for (std::size_t i = 0; i < count; ++i) take_covariance(message.covariance_px2, i, frame.detections[i]);
  return {};
}

Status add_unreliable(TagFrame& frame, const UnreliableTags& message) {
  const std::size_t count = message.detections.size();
  bool same = message.index.size() == count && message.covariance_px2.size() == 64 * count;
  std::vector<TagDetection> all = frame.detections;
  for (std::size_t i = 0; same && i < count; ++i) {
    const std::int32_t index = message.index[i];
    same = index >= 0 && static_cast<std::size_t>(index) <= all.size() &&
           (i == 0 || index > message.index[i - 1]);
    if (!same) break;
    Result<TagDetection> detection = detection_of(message.detections[i]);
    if (!detection) return tl::unexpected(detection.error());
    take_covariance(message.covariance_px2, i, *detection);
    detection->corner_state = CornerState::Unreliable;
    all.insert(all.begin() + index, std::move(*detection));
  }
  if (!same) return fail(ErrorCode::Unreadable, "unreliable tags do not match the detections of the frame");
  frame.detections = std::move(all);
  return {};
}

CameraInfo to_ros(const CameraModel& camera, SensorTime stamp, std::string_view name) {
  CameraInfo message;
  message.header = header(stamp, camera_frame(name));
  message.width = static_cast<std::uint32_t>(camera.width_px());
  message.height = static_cast<std::uint32_t>(camera.height_px());
  std::visit(
      [&](const auto& model) {
        message.k = {model.fx, model.skew, model.cx - kHalfPixel, 0, model.fy, model.cy - kHalfPixel, 0,
                     0,        1};
        message.d.assign(model.k.begin(), model.k.end());
      },
      camera.projection());
  if (const auto* radtan = std::get_if<PinholeRadtan>(&camera.projection())) {
    message.distortion_model = radtan->coefficients > 5 ? "rational_polynomial" : "plumb_bob";
    message.d.resize(radtan->coefficients > 5 ? 8 : 5);
  } else {
    message.distortion_model = "equidistant";
  }
  message.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  message.p = {message.k[0], message.k[1], message.k[2], 0, 0, message.k[4], message.k[5], 0, 0, 0, 1, 0};
  return message;
}

Result<CameraModel> from_ros(const CameraInfo& message) {
  const RegionOfInterest& roi = message.roi;
  return camera_from({.model = message.distortion_model,
                      .k = message.k,
                      .distortion = message.d,
                      .width_px = message.width,
                      .height_px = message.height,
                      .part = {.x_px = roi.x_offset,
                               .y_px = roi.y_offset,
                               .width_px = roi.width,
                               .height_px = roi.height,
                               .binning_x = message.binning_x,
                               .binning_y = message.binning_y}});
}

Result<CameraModel> rectified_from_ros(const CameraInfo& message) {
  CameraInfo flat = message;
  flat.distortion_model = "none";
  flat.d.clear();
  flat.k = {message.p[0], message.p[1], message.p[2], 0, message.p[5], message.p[6], 0, 0, 1};
  return from_ros(flat);
}

namespace {

constexpr std::string_view kOpticalSuffix = "_optical";

}  // namespace

std::string camera_frame(std::string_view camera) {
  return camera == "cam" ? std::string(kCameraFrame) : fmt::format("{}{}", camera, kOpticalSuffix);
}

std::string camera_of_frame(std::string_view frame) {
  if (frame.empty() || frame == kCameraFrame) return "cam";
  if (frame.size() > kOpticalSuffix.size() && frame.ends_with(kOpticalSuffix))
    frame.remove_suffix(kOpticalSuffix.size());
  return std::string(frame);
}

Image to_ros(const CameraFrame& frame) {
  const waymark::Image& image = frame.image;
  Image message{.header = {to_ros(frame.stamp), camera_frame(frame.camera)},
                .height = static_cast<std::uint32_t>(image.height()),
                .width = static_cast<std::uint32_t>(image.width()),
                .encoding = "mono8",
                .step = static_cast<std::uint32_t>(image.width())};
  if (!image.empty()) {
    const std::uint8_t* pixels = image.row(0);
    message.data.assign(pixels, pixels + std::size_t{message.step} * message.height);
  }
  return message;
}

Result<CameraFrame> from_ros(const Image& message) {
  constexpr std::uint32_t kMaxSide = 1U << 21U;  // more than grey_of() accepts
  Result<waymark::Image> image = grey_of({.encoding = message.encoding,
                                          .width = static_cast<int>(std::min(message.width, kMaxSide)),
                                          .height = static_cast<int>(std::min(message.height, kMaxSide)),
                                          .row_bytes = message.step,
                                          .big_endian = message.is_bigendian != 0,
                                          .bytes = message.data});
  if (!image) return tl::unexpected(image.error());
  return CameraFrame{.stamp = from_ros(message.header.stamp),
                     .camera = camera_of_frame(message.header.frame_id),
                     .image = std::move(*image)};
}

Result<CameraFrame> from_ros(const CompressedImage& message) {
  Result<waymark::Image> image = decode_image(message.data, "a compressed image");
  if (!image) return tl::unexpected(image.error());
  return CameraFrame{.stamp = from_ros(message.header.stamp),
                     .camera = camera_of_frame(message.header.frame_id),
                     .image = std::move(*image)};
}

LaserScan to_ros(const waymark::LaserScan& scan) {
  const double last = scan.ranges_m.empty() ? 0.0 : static_cast<double>(scan.ranges_m.size() - 1);
  return {.header = {to_ros(scan.stamp), std::string(kLaserFrame)},
          .angle_min = static_cast<float>(scan.angle_min_rad),
          .angle_max = static_cast<float>(scan.angle_min_rad + last * scan.angle_increment_rad),
          .angle_increment = static_cast<float>(scan.angle_increment_rad),
          .time_increment = static_cast<float>(scan.time_increment_s),
          .range_min = static_cast<float>(scan.range_min_m),
          .range_max = static_cast<float>(scan.range_max_m),
          .ranges = scan.ranges_m};
}

waymark::LaserScan from_ros(const LaserScan& message) {
  return {.stamp = from_ros(message.header.stamp),
          .angle_min_rad = message.angle_min,
          .angle_increment_rad = message.angle_increment,
          .time_increment_s = message.time_increment,
          .range_min_m = message.range_min,
          .range_max_m = message.range_max,
          .ranges_m = message.ranges};
}

Joy to_ros(const GamepadState& state) {
  return {.header = {to_ros(state.stamp), ""}, .axes = state.axes, .buttons = state.buttons};
}

GamepadState from_ros(const Joy& message) {
  return {.stamp = from_ros(message.header.stamp), .axes = message.axes, .buttons = message.buttons};
}

RangeBearing to_ros(const waymark::RangeBearing& sample) {
  return {.header = {to_ros(sample.stamp), std::string(kLaserFrame)},
          .landmark = sample.landmark,
          .range_m = sample.range_m,
          .bearing_rad = sample.bearing_rad};
}

waymark::RangeBearing from_ros(const RangeBearing& message) {
  return {from_ros(message.header.stamp), message.landmark, message.range_m, message.bearing_rad};
}

TagPoseArray to_ros(const TagPoseFrame& frame) {
  TagPoseArray message{.header = {to_ros(frame.stamp), camera_frame(frame.camera)}};
  for (const SeenTagPose& seen : frame.tags)
    message.tags.push_back(
        {std::string(to_string(seen.tag.family)), seen.tag.number, to_ros(seen.cam_T_tag)});
  return message;
}

Result<TagPoseFrame> from_ros(const TagPoseArray& message) {
  TagPoseFrame frame{.stamp = from_ros(message.header.stamp),
                     .camera = camera_of_frame(message.header.frame_id)};
  for (const TagPose& in : message.tags) {
    const Result<FamilyId> family = parse_family(in.family);
    if (!family) return tl::unexpected(family.error());
    frame.tags.push_back({.tag = {*family, in.id}, .cam_T_tag = from_ros(in.pose)});
  }
  return frame;
}

}  // namespace waymark::ros2
