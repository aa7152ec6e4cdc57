#pragma once

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "waymark/recording/mcap/writer.hpp"
#include "waymark/recording/ros2/convert.hpp"
#include "waymark/recording/ros2/offered_qos.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Topic names of a recording (docs/formats/recording.md).
namespace topics {
inline constexpr const char* kTags = "/tag_detections";
inline constexpr const char* kTagCovariances = "/tag_corner_covariances";
inline constexpr const char* kUnreliableTags = "/unreliable_tags";
inline constexpr const char* kTagPoses = "/tag_poses";
inline constexpr const char* kImage = "/image_raw";
inline constexpr const char* kScan = "/scan";
inline constexpr const char* kGamepad = "/joy";
inline constexpr const char* kRangeBearing = "/range_bearing";
inline constexpr const char* kCameraInfo = "/camera_info";
inline constexpr const char* kOdometry = "/odom";
inline constexpr const char* kWheels = "/joint_states";
inline constexpr const char* kImu = "/imu";
inline constexpr const char* kCommand = "/cmd_vel";
inline constexpr const char* kTf = "/tf";
inline constexpr const char* kTfStatic = "/tf_static";
inline constexpr const char* kTruth = "/truth/pose";  ///< ground truth, not available to the robot
inline constexpr const char* kDiagnostics = "/diagnostics";
inline constexpr const char* kEstimate = "/waymark/pose";
}  // namespace topics

/// The topic of a camera's data: at the root for the camera "cam", below the camera's name for others.
[[nodiscard]] std::string topic_of_camera(const std::string& camera, const char* topic);

/// Writes samples as ROS 2 messages to an MCAP recording. The log time is the sample's stamp. For camera
/// data, it is the arrival time: the stamp plus the configured delay, but not earlier than the newest stamp
/// from other sensors so far.
class SampleRecorder {
 public:
  static Result<SampleRecorder> open(std::unique_ptr<ByteSink> sink, const mcap::WriterOptions& options = {});

  Status add(const Sample& sample);
  /// Records the camera and its mounting, which readers need before the first frame.
  Status add_camera(SensorTime stamp, const CameraModel& camera, const SE3& base_T_cam,
                    const std::string& name = "cam");
  /// Records all cameras with the stamp of the first sample, so that the caller does not need the time on its
  /// clock.
  void add_cameras_with_first_sample(std::vector<MountedCamera> cameras) { cameras_ = std::move(cameras); }
  /// Writes a message of a Waymark type to any topic.
  template <class Message>
  Status add_message(const std::string& topic, SensorTime stamp, const Message& message);
  Status add_metadata(const std::string& name, const std::map<std::string, std::string>& values);
  Status add_attachment(const std::string& name, const std::string& media_type, SensorTime stamp,
                        std::string_view text);

  /// The minimum delay between the stamp and the arrival of images, tags and tag poses.
  void set_image_arrival_delay(Duration arrival_delay) { image_arrival_delay_ = arrival_delay; }

  /// Sets the notation of the topics' QoS profiles. The default is numbers, which Humble reads.
  void set_qos_notation(QosNotation notation) { qos_notation_ = notation; }

  Status flush() { return writer_.flush(); }
  /// Completes the file with its summary. A recorder destroyed without calling this leaves a recoverable
  /// file.
  Status close();

 private:
  Status add_waiting_cameras(SensorTime stamp);
  [[nodiscard]] Duration arrival_delay_of_image(SensorTime stamp) const;
  Status add_tags(const TagFrame& frame);
  Status add_unreliable_tags(const TagFrame& frame);
  explicit SampleRecorder(mcap::Writer writer) : writer_(std::move(writer)) {}
  Status write(const std::string& topic, std::string_view type, SensorTime stamp, const Bytes& data);

  mcap::Writer writer_;
  std::map<std::string, std::uint16_t> channels_;
  QosNotation qos_notation_ = QosNotation::Numbers;
  Duration image_arrival_delay_{};
  Duration arrival_delay_{};              ///< delay of the sample being added
  std::optional<SensorTime> newest_{};    ///< newest stamp from the other sensors
  std::vector<MountedCamera> cameras_{};  ///< recorded with the first sample
};

}  // namespace waymark

namespace waymark::topics {

// The topic for each kind of sample. Tags have up to three topics, because the corner covariances and the
// tags with unreliable corners of a TagFrame are recorded separately.
[[nodiscard]] inline const char* of(const TagFrame& /**/) { return kTags; }
[[nodiscard]] inline const char* of(const Odometry& /**/) { return kOdometry; }
[[nodiscard]] inline const char* of(const WheelTicks& /**/) { return kWheels; }
[[nodiscard]] inline const char* of(const ImuSample& /**/) { return kImu; }
[[nodiscard]] inline const char* of(const StampedCommand& /**/) { return kCommand; }
[[nodiscard]] inline const char* of(const TruthPose& /**/) { return kTruth; }
[[nodiscard]] inline const char* of(const CameraFrame& /**/) { return kImage; }
[[nodiscard]] inline const char* of(const TagPoseFrame& /**/) { return kTagPoses; }
[[nodiscard]] inline const char* of(const RangeBearing& /**/) { return kRangeBearing; }
[[nodiscard]] inline const char* of(const LaserScan& /**/) { return kScan; }
[[nodiscard]] inline const char* of(const GamepadState& /**/) { return kGamepad; }

}  // namespace waymark::topics

/// Values of `record_images` and `images`, which specify how images are recorded.
namespace waymark {

/// Records an image as `how` specifies: "raw", "jpeg" (a tenth of the size), or not at all if empty.
[[nodiscard]] Status record_image(const CameraFrame& image, const std::string& how, SampleRecorder& recorder);

}  // namespace waymark
