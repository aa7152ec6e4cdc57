#include "waymark/recording/ros2/messages.hpp"

#include <array>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace waymark::ros2 {
namespace {

struct Definition {
  std::string_view type;  ///< "geometry_msgs/Twist"
  std::string_view text;  ///< the fields of the .msg file
};

// Definitions from the .msg files of ROS 2 (common_interfaces, rcl_interfaces, geometry2, apriltag_msgs),
// without comments.
constexpr std::array kDefinitions = {
    Definition{"builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"},
    Definition{"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"geometry_msgs/Pose", "Point position\nQuaternion orientation\n"},
    Definition{"geometry_msgs/PoseStamped", "std_msgs/Header header\nPose pose\n"},
    Definition{"geometry_msgs/PoseWithCovariance", "Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/PoseWithCovarianceStamped",
               "std_msgs/Header header\nPoseWithCovariance pose\n"},
    Definition{"geometry_msgs/Twist", "Vector3  linear\nVector3  angular\n"},
    Definition{"geometry_msgs/TwistStamped", "std_msgs/Header header\nTwist twist\n"},
    Definition{"geometry_msgs/TwistWithCovariance", "Twist twist\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n"},
    Definition{"geometry_msgs/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\nTransform transform\n"},
    Definition{"nav_msgs/Odometry",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
               "geometry_msgs/TwistWithCovariance twist\n"},
    Definition{
        "sensor_msgs/Imu",
        "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
    Definition{
        "sensor_msgs/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n"},
    Definition{"sensor_msgs/RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"sensor_msgs/CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
               "float64[9]  k\nfloat64[9]  r\nfloat64[12] p\nuint32 binning_x\nuint32 "
               "binning_y\nRegionOfInterest roi\n"},
    Definition{"sensor_msgs/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\n"
               "uint32 step\nuint8[] data\n"},
    Definition{"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    Definition{"sensor_msgs/LaserScan",
               "std_msgs/Header header\nfloat32 angle_min\nfloat32 angle_max\nfloat32 angle_increment\n"
               "float32 time_increment\nfloat32 scan_time\nfloat32 range_min\nfloat32 range_max\n"
               "float32[] ranges\nfloat32[] intensities\n"},
    Definition{"sensor_msgs/Joy", "std_msgs/Header header\nfloat32[] axes\nint32[] buttons\n"},
    Definition{"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
    Definition{"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"apriltag_msgs/Point", "float64 x\nfloat64 y\n"},
    Definition{
        "apriltag_msgs/AprilTagDetection",
        "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\nPoint centre\n"
        "Point[4] corners\nfloat64[9] homography\n"},
    Definition{"apriltag_msgs/AprilTagDetectionArray",
               "std_msgs/Header header\nAprilTagDetection[] detections\n"},
    Definition{"waymark_msgs/TagCornerCovariances",
               "std_msgs/Header header\nint32[] id\nfloat64[] covariance_px2\n"},
    Definition{"waymark_msgs/UnreliableTags",
               "std_msgs/Header header\nint32[] index\napriltag_msgs/AprilTagDetection[] detections\n"
               "float64[] covariance_px2\n"},
    Definition{"waymark_msgs/TagPose", "string family\nint32 id\ngeometry_msgs/Pose pose\n"},
    // The type used in bags for TagSLAM, in ROS 2 syntax.
    Definition{
        "apriltag_msgs/Apriltag",
        "int32 id\nstring family\nint32 hamming\nint32 border\nint32 bits\ngeometry_msgs/Point center\n"
        "geometry_msgs/Point[4] corners\n"},
    Definition{"apriltag_msgs/ApriltagArrayStamped", "std_msgs/Header header\nApriltag[] apriltags\n"},
    Definition{"waymark_msgs/TagPoseArray", "std_msgs/Header header\nTagPose[] tags\n"},
    Definition{"waymark_msgs/RangeBearing",
               "std_msgs/Header header\nint64 landmark\nfloat64 range_m\nfloat64 bearing_rad\n"},
    Definition{"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
    Definition{"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec\n"},
    Definition{"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
    Definition{"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
    Definition{"visualization_msgs/Marker",
               "int32 ARROW=0\nint32 CUBE=1\nint32 SPHERE=2\nint32 CYLINDER=3\nint32 LINE_STRIP=4\nint32 "
               "LINE_LIST=5\n"
               "int32 CUBE_LIST=6\nint32 SPHERE_LIST=7\nint32 POINTS=8\nint32 TEXT_VIEW_FACING=9\n"
               "int32 MESH_RESOURCE=10\nint32 TRIANGLE_LIST=11\nint32 ARROW_STRIP=12\nint32 ADD=0\nint32 "
               "MODIFY=0\nint32 DELETE=2\n"
               "int32 DELETEALL=3\nstd_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\n"
               "geometry_msgs/Pose pose\ngeometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\n"
               "builtin_interfaces/Duration lifetime\nbool frame_locked\ngeometry_msgs/Point[] points\n"
               "std_msgs/ColorRGBA[] colors\nstring texture_resource\nsensor_msgs/CompressedImage texture\n"
               "UVCoordinate[] uv_coordinates\nstring text\nstring mesh_resource\nMeshFile mesh_file\n"
               "bool mesh_use_embedded_materials\n"},
    Definition{"visualization_msgs/MarkerArray", "Marker[] markers\n"},
    Definition{"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
    Definition{"diagnostic_msgs/DiagnosticStatus",
               "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
               "string hardware_id\nKeyValue[] values\n"},
    Definition{"diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\nDiagnosticStatus[] status\n"},
};

std::string_view text_of(std::string_view type) {
  for (const Definition& definition : kDefinitions) {
    if (definition.type == type) return definition.text;
  }
  return {};
}

/// The first word of each line, without array brackets, is its type. A type without a package is from the
/// same package.
std::vector<std::string> types_used(std::string_view type, std::string_view text) {
  const std::string package(type.substr(0, type.find('/')));
  std::vector<std::string> types;
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(line.size() + 1);
    const std::string word(line.substr(0, line.find_first_of(" [")));
    const std::string full = word.find('/') == std::string::npos ? package + "/" + word : word;
    if (!text_of(full).empty()) types.push_back(full);
  }
  return types;
}

void append_dependencies(std::string_view type, std::set<std::string>& done, std::string& out) {
  for (const std::string& used : types_used(type, text_of(type))) {
    if (!done.insert(used).second) continue;
    out += std::string(80, '=') + "\nMSG: " + used + "\n";
    out += text_of(used);
    append_dependencies(used, done, out);
  }
}

}  // namespace

std::string schema_text(std::string_view type) {
  const std::size_t msg = type.find("/msg/");
  if (msg == std::string_view::npos) return {};
  const std::string short_type = std::string(type.substr(0, msg)) + "/" + std::string(type.substr(msg + 5));
  std::string out(text_of(short_type));
  if (out.empty()) return {};
  std::set<std::string> done;
  append_dependencies(short_type, done, out);
  return out;
}

}  // namespace waymark::ros2
