#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/plot/annotate.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {

/// Input of pose estimation: the camera and the tag sizes.
struct PoseSetup {
  CameraModel camera;
  TagSizes sizes{};
};

/// Accepted sizes of printed tags [m]; other values are centimetres or millimetres by mistake.
inline constexpr double kMinTagSize_m = 0.001;
inline constexpr double kMaxTagSize_m = 10;

/// Parses several sizes: "0.16" for all tags, "tag36h11:7=0.08" (or "7=0.08" for tag36h11) for one tag.
[[nodiscard]] Result<TagSizes> parse_tag_sizes(const std::vector<std::string>& words);

/// One pose per detection, in order, or the error of that detection (tag size unknown, corners outside the
/// range of the lens model …).
using PoseList = std::vector<Result<TagPose>>;

[[nodiscard]] PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup);

/// "pose" and "other_pose" (null if there is only one), or "pose_error"; empty without poses.
[[nodiscard]] ReportFields pose_fields(const std::optional<Result<TagPose>>& pose);

/// The axes of each tag, half a side long, in image coordinates.
[[nodiscard]] std::vector<plot::FrameAxes> axes_of(std::span<const TagDetection> detections,
                                                   const PoseList& poses, const PoseSetup& setup);

/// User options for a camera without a robot.
struct CameraDescription {
  std::string
      file{};  ///< calibration.yaml, ROS camera_info, kalibr's YAML, PhotonVision's JSON, OpenCV's YAML
  std::string name{};  ///< of the camera, if the file has several
  std::string size{};  ///< image size "1280x720" to which the calibration is scaled; empty: unscaled
  std::optional<double> readout_ms{};  ///< of a rolling shutter; overrides the file

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.name,
          JobField("camera_name NAME", "Name of the camera in `camera`, if that file has several").less());
    visit(self.size, JobField("camera_size WIDTHxHEIGHT",
                              "Image size, such as 1280x720, if the calibration was made at another one: it "
                              "is then scaled, which requires that both have the same field of view")
                         .less());
  }
};

/// User options for tag poses.
struct PoseRequest {
  CameraDescription camera{};
  std::vector<std::string> sizes{};  ///< in the form of parse_tag_sizes()

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.camera.file, JobField("camera FILE",
                                     "Camera calibration (ROS camera_info, kalibr YAML or PhotonVision "
                                     "JSON): adds the pose of each tag"));
    CameraDescription::fields(self.camera, visit);
    visit(self.sizes, JobField("tag_size_m SIZE",
                               "Side of the square where black border meets white [m]; ID=SIZE for a tag of "
                               "another size (repeatable)")
                          .repeated());
  }
};

struct DescribedCamera {
  CameraModel camera;
  /// Standard deviations of the intrinsics (intrinsics_of) if the file is a calibration.yaml; else
  /// empty.
  Eigen::VectorXd intrinsics_sigma{};
  double readout_s = 0;  ///< of a rolling shutter, first row to last, negative from the bottom; 0: global
};

/// Reads the file. Errors name the field at fault (camera_size), or the file.
[[nodiscard]] Result<DescribedCamera> read_camera(const CameraDescription& description);

/// Input of pose estimation from a camera and sizes in the form of parse_tag_sizes(); nothing if neither is
/// given. Fails also if only one of them is given.
[[nodiscard]] Result<std::optional<PoseSetup>> described_poses(const CameraDescription& camera,
                                                               const std::vector<std::string>& tag_sizes);

/// Fails (Unsupported) if the image size is not that of the camera.
[[nodiscard]] Status check_picture_size(const CameraModel& camera, int width_px, int height_px);

}  // namespace waymark
