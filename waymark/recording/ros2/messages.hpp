#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_io.hpp"

/// The fields of a ROS 2 message, in the order of its .msg file (waymark/recording/ros2/cdr.hpp).
#define WAYMARK_ROS2_FIELDS(...)                  \
  template <class Self, class Visit>              \
  static void fields(Self& self, Visit&& visit) { \
    visit(__VA_ARGS__);                           \
  }

/// ROS 2 messages that Waymark records, with the fields of their .msg files and their schema text. The text
/// has the "ros2msg" encoding: the definition, then each dependency after a line of 80 '=' and "MSG:
/// package/Type".
namespace waymark::ros2 {

// std_msgs, geometry_msgs, nav_msgs and tf2_msgs.

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  WAYMARK_ROS2_FIELDS(self.sec, self.nanosec)
};

struct Header {
  Time stamp{};
  std::string frame_id{};
  WAYMARK_ROS2_FIELDS(self.stamp, self.frame_id)
};

struct Vector3 {
  double x = 0, y = 0, z = 0;
  WAYMARK_ROS2_FIELDS(self.x, self.y, self.z)
};
using Point = Vector3;

struct Quaternion {
  double x = 0, y = 0, z = 0, w = 1;
  WAYMARK_ROS2_FIELDS(self.x, self.y, self.z, self.w)
};

struct Pose {
  Point position{};
  Quaternion orientation{};
  WAYMARK_ROS2_FIELDS(self.position, self.orientation)
};

struct PoseWithCovariance {
  Pose pose{};
  std::array<double, 36> covariance{};  ///< row-major; x y z, then rotation about fixed x y z
  WAYMARK_ROS2_FIELDS(self.pose, self.covariance)
};

struct Twist {
  static constexpr std::string_view kType = "geometry_msgs/msg/Twist";
  Vector3 linear{};   ///< [m/s]
  Vector3 angular{};  ///< [rad/s]
  WAYMARK_ROS2_FIELDS(self.linear, self.angular)
};

struct TwistWithCovariance {
  Twist twist{};
  std::array<double, 36> covariance{};
  WAYMARK_ROS2_FIELDS(self.twist, self.covariance)
};

struct TwistStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/TwistStamped";
  Header header{};
  Twist twist{};
  WAYMARK_ROS2_FIELDS(self.header, self.twist)
};

struct PoseStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/PoseStamped";
  Header header{};
  Pose pose{};
  WAYMARK_ROS2_FIELDS(self.header, self.pose)
};

struct PoseWithCovarianceStamped {
  static constexpr std::string_view kType = "geometry_msgs/msg/PoseWithCovarianceStamped";
  Header header{};
  PoseWithCovariance pose{};
  WAYMARK_ROS2_FIELDS(self.header, self.pose)
};

struct Odometry {
  static constexpr std::string_view kType = "nav_msgs/msg/Odometry";
  Header header{};
  std::string child_frame_id{};
  PoseWithCovariance pose{};
  TwistWithCovariance twist{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id, self.pose, self.twist)
};

struct Path {
  static constexpr std::string_view kType = "nav_msgs/msg/Path";
  Header header{};
  std::vector<PoseStamped> poses{};
  WAYMARK_ROS2_FIELDS(self.header, self.poses)
};

struct TransformStamped {
  Header header{};
  std::string child_frame_id{};
  Vector3 translation{};
  Quaternion rotation{};
  WAYMARK_ROS2_FIELDS(self.header, self.child_frame_id, self.translation, self.rotation)
};

struct TFMessage {
  static constexpr std::string_view kType = "tf2_msgs/msg/TFMessage";
  std::vector<TransformStamped> transforms{};
  WAYMARK_ROS2_FIELDS(self.transforms)
};

// sensor_msgs.

struct Imu {
  static constexpr std::string_view kType = "sensor_msgs/msg/Imu";
  Header header{};
  Quaternion orientation{};
  std::array<double, 9> orientation_covariance{-1};  ///< no orientation if the first element is -1
  Vector3 angular_velocity{};                        ///< [rad/s]
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration{};  ///< [m/s^2]
  std::array<double, 9> linear_acceleration_covariance{};
  WAYMARK_ROS2_FIELDS(self.header, self.orientation, self.orientation_covariance, self.angular_velocity,
                      self.angular_velocity_covariance, self.linear_acceleration,
                      self.linear_acceleration_covariance)
};

struct JointState {
  static constexpr std::string_view kType = "sensor_msgs/msg/JointState";
  Header header{};
  std::vector<std::string> name{};
  std::vector<double> position{};  ///< [rad]
  std::vector<double> velocity{};  ///< [rad/s]
  std::vector<double> effort{};
  WAYMARK_ROS2_FIELDS(self.header, self.name, self.position, self.velocity, self.effort)
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  WAYMARK_ROS2_FIELDS(self.x_offset, self.y_offset, self.height, self.width, self.do_rectify)
};

/// Pixel centres are at integers, as in ROS: c_x and c_y are half a pixel less than in CameraModel.
struct CameraInfo {
  static constexpr std::string_view kType = "sensor_msgs/msg/CameraInfo";
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string distortion_model{};
  std::vector<double> d{};
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.distortion_model, self.d, self.k, self.r,
                      self.p, self.binning_x, self.binning_y, self.roi)
};

struct Image {
  static constexpr std::string_view kType = "sensor_msgs/msg/Image";
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string encoding{};         ///< "mono8", "bgr8", … (sensor_msgs/image_encodings.hpp)
  std::uint8_t is_bigendian = 0;  ///< byte order of 16-bit pixels
  std::uint32_t step = 0;         ///< bytes from one row to the next
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.encoding, self.is_bigendian, self.step,
                      self.data)
};

struct CompressedImage {
  static constexpr std::string_view kType = "sensor_msgs/msg/CompressedImage";
  Header header{};
  std::string format{};  ///< "jpeg", "png", "bgr8; jpeg compressed bgr8", …
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.header, self.format, self.data)
};

/// ranges[i] is in direction angle_min + i * angle_increment [rad] about the sensor's z axis.
struct LaserScan {
  static constexpr std::string_view kType = "sensor_msgs/msg/LaserScan";
  Header header{};
  float angle_min = 0, angle_max = 0, angle_increment = 0;  ///< [rad]
  float time_increment = 0, scan_time = 0;  ///< [s] between consecutive rays, between consecutive scans
  float range_min = 0, range_max = 0;       ///< [m]
  std::vector<float> ranges{};              ///< [m]
  std::vector<float> intensities{};
  WAYMARK_ROS2_FIELDS(self.header, self.angle_min, self.angle_max, self.angle_increment, self.time_increment,
                      self.scan_time, self.range_min, self.range_max, self.ranges, self.intensities)
};

struct Joy {
  static constexpr std::string_view kType = "sensor_msgs/msg/Joy";
  Header header{};
  std::vector<float> axes{};
  std::vector<std::int32_t> buttons{};
  WAYMARK_ROS2_FIELDS(self.header, self.axes, self.buttons)
};

// apriltag_msgs, and waymark_msgs for data that no ROS 2 message can hold.

struct AprilTagPoint {
  double x = 0, y = 0;
  WAYMARK_ROS2_FIELDS(self.x, self.y)
};

/// As in libapriltag, apriltag_ros orders corners as BL, BR, TR, TL of the printed tag; pixel centres are as
/// in ROS.
struct AprilTagDetection {
  std::string family{};
  std::int32_t id = 0;
  std::int32_t hamming = 0;
  float goodness = 0;
  float decision_margin = 0;
  AprilTagPoint centre{};
  std::array<AprilTagPoint, 4> corners{};
  std::array<double, 9> homography{};
  WAYMARK_ROS2_FIELDS(self.family, self.id, self.hamming, self.goodness, self.decision_margin, self.centre,
                      self.corners, self.homography)
};

struct AprilTagDetectionArray {
  static constexpr std::string_view kType = "apriltag_msgs/msg/AprilTagDetectionArray";
  Header header{};
  std::vector<AprilTagDetection> detections{};
  WAYMARK_ROS2_FIELDS(self.header, self.detections)
};

/// Waymark type for corner covariances, which apriltag_msgs cannot hold. There is one entry per detection, in
/// the order of the AprilTagDetectionArray with the same stamp.
struct TagCornerCovariances {
  static constexpr std::string_view kType = "waymark_msgs/msg/TagCornerCovariances";
  Header header{};
  std::vector<std::int32_t> id{};
  std::vector<double>
      covariance_px2{};  ///< 64 numbers per entry: an 8x8 matrix, with corners TL TR BR BL as x y x y x y x y
  WAYMARK_ROS2_FIELDS(self.header, self.id, self.covariance_px2)
};

/// Waymark type for the tags that are missing from the AprilTagDetectionArray with the same stamp because
/// their corners are unreliable. Programs that read only the array thus never use these corners.
struct UnreliableTags {
  static constexpr std::string_view kType = "waymark_msgs/msg/UnreliableTags";
  Header header{};
  std::vector<std::int32_t> index{};  ///< position of each tag among all tags of the image, ascending
  std::vector<AprilTagDetection> detections{};
  std::vector<double> covariance_px2{};  ///< as in TagCornerCovariances
  WAYMARK_ROS2_FIELDS(self.header, self.index, self.detections, self.covariance_px2)
};

struct TagPose {
  std::string family{};
  std::int32_t id = 0;
  Pose pose{};  ///< pose of the tag in the camera: centre, x right, y down, z into the tag
  WAYMARK_ROS2_FIELDS(self.family, self.id, self.pose)
};

/// Waymark type for the tags of one image as poses in the camera frame, for sources without corners.
struct TagPoseArray {
  static constexpr std::string_view kType = "waymark_msgs/msg/TagPoseArray";
  Header header{};
  std::vector<TagPose> tags{};
  WAYMARK_ROS2_FIELDS(self.header, self.tags)
};

/// Waymark type for the range and bearing of a numbered landmark.
struct RangeBearing {
  static constexpr std::string_view kType = "waymark_msgs/msg/RangeBearing";
  Header header{};
  std::int64_t landmark = 0;
  double range_m = 0;
  double bearing_rad = 0;  ///< counter-clockwise from the x axis of the frame in the header
  WAYMARK_ROS2_FIELDS(self.header, self.landmark, self.range_m, self.bearing_rad)
};

// diagnostic_msgs and visualization_msgs.

struct KeyValue {
  std::string key{};
  std::string value{};
  WAYMARK_ROS2_FIELDS(self.key, self.value)
};

struct DiagnosticStatus {
  std::uint8_t level = 0;  ///< 0 for ok, 1 for warn, 2 for error, 3 for stale
  std::string name{};
  std::string message{};
  std::string hardware_id{};
  std::vector<KeyValue> values{};
  WAYMARK_ROS2_FIELDS(self.level, self.name, self.message, self.hardware_id, self.values)
};

struct DiagnosticArray {
  static constexpr std::string_view kType = "diagnostic_msgs/msg/DiagnosticArray";
  Header header{};
  std::vector<DiagnosticStatus> status{};
  WAYMARK_ROS2_FIELDS(self.header, self.status)
};

struct ColorRGBA {
  float r = 0, g = 0, b = 0, a = 0;
  WAYMARK_ROS2_FIELDS(self.r, self.g, self.b, self.a)
};

struct RosDuration {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
  WAYMARK_ROS2_FIELDS(self.sec, self.nanosec)
};

struct UVCoordinate {
  float u = 0, v = 0;
  WAYMARK_ROS2_FIELDS(self.u, self.v)
};

struct MeshFile {
  std::string filename{};
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.filename, self.data)
};

/// A shape to draw (visualization_msgs/Marker as in Humble).
struct Marker {
  static constexpr std::int32_t kArrow = 0, kCube = 1, kSphere = 2, kLineStrip = 4, kLineList = 5,
                                kCubeList = 6, kText = 9;
  Header header{};
  std::string ns{};
  std::int32_t id = 0;
  std::int32_t type = kArrow;
  std::int32_t action = 0;  ///< 0 to add or modify, 2 to delete, 3 to delete all
  Pose pose{};
  Vector3 scale{};  ///< [m]
  ColorRGBA color{};
  RosDuration lifetime{};  ///< unlimited if zero
  bool frame_locked = false;
  std::vector<Point> points{};
  std::vector<ColorRGBA> colors{};
  std::string texture_resource{};
  CompressedImage texture{};
  std::vector<UVCoordinate> uv_coordinates{};
  std::string text{};
  std::string mesh_resource{};
  MeshFile mesh_file{};
  bool mesh_use_embedded_materials = false;
  WAYMARK_ROS2_FIELDS(self.header, self.ns, self.id, self.type, self.action, self.pose, self.scale,
                      self.color, self.lifetime, self.frame_locked, self.points, self.colors,
                      self.texture_resource, self.texture, self.uv_coordinates, self.text, self.mesh_resource,
                      self.mesh_file, self.mesh_use_embedded_materials)
};

struct MarkerArray {
  static constexpr std::string_view kType = "visualization_msgs/msg/MarkerArray";
  std::vector<Marker> markers{};
  WAYMARK_ROS2_FIELDS(self.markers)
};

/// The schema text of a type, as in a ROS 2 recording; empty for a type that is not in this header.
[[nodiscard]] std::string schema_text(std::string_view type);

}  // namespace waymark::ros2
