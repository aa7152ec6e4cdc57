#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/common/tag_names.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/plot/annotate.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {

/// Input for pose estimation: the camera and the tag sizes.
struct PoseSetup {
  CameraModel camera;
  TagSizes sizes{};
  IntrinsicsCovariance intrinsics_covariance{};  ///< empty if the camera is taken as exact
};

/// One entry per detection, in order: its pose, or the reason why there is none (unknown tag size, corners
/// outside the range of the lens model, …).
using PoseList = std::vector<Result<TagPose>>;

[[nodiscard]] PoseList poses_of(std::span<const TagDetection> detections, const PoseSetup& setup);

/// Number of poses that do not fit their corners: their residuals are more than five times as large as the
/// covariances of the corners allow (TagPoseSolution::sigma_scale).
[[nodiscard]] std::size_t count_misfits(const PoseList& poses);
/// A note about this number of misfits.
[[nodiscard]] std::string misfit_note(std::size_t misfits, std::size_t poses);

/// "pose" and "other_pose" (null if there is only one), or "pose_error"; empty if poses were not computed.
[[nodiscard]] ReportFields pose_fields(const std::optional<Result<TagPose>>& pose);

/// The axes of each tag in image coordinates; their length is half the side of the tag.
[[nodiscard]] std::vector<plot::FrameAxes> axes_of(std::span<const TagDetection> detections,
                                                   const PoseList& poses, const PoseSetup& setup);

/// User options for a camera without a robot.
struct CameraDescription {
  std::string
      file{};  ///< calibration.yaml, ROS camera_info, kalibr's YAML, PhotonVision's JSON, OpenCV's YAML
  std::string name{};  ///< name of the camera, if the file describes several
  std::string size{};  ///< image size ("1280x720") to which the calibration is scaled; not scaled if empty
  std::optional<double> readout_ms{};  ///< readout time of a rolling shutter; overrides the file

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
  std::vector<std::string> sizes{};  ///< in the format of parse_tag_sizes()

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
  /// Standard deviations of the intrinsics (intrinsics_of) if the file is a calibration.yaml; otherwise
  /// empty.
  Eigen::VectorXd intrinsics_sigma{};
  IntrinsicsCovariance intrinsics_covariance{};  ///< the same with correlations; empty if there are no sigmas
  double readout_s = 0;  ///< readout time of a rolling shutter from the first row to the last, negative if it
                         ///< starts at the bottom; 0 for a global shutter
};

/// Reads the file. Errors name either the invalid field (camera_size) or the file.
[[nodiscard]] Result<DescribedCamera> read_camera(const CameraDescription& description);

/// A note to the user: whether the standard deviations of poses include the uncertainty of the calibration.
[[nodiscard]] std::string calibration_note(const PoseSetup& setup);

/// Creates the setup for pose estimation from a camera and from sizes in the format of parse_tag_sizes();
/// `nullopt` if neither is specified. Fails if only one of them is specified. Only tags of `families` may
/// have their own sizes.
[[nodiscard]] Result<std::optional<PoseSetup>> described_poses(const CameraDescription& camera,
                                                               const std::vector<std::string>& tag_sizes,
                                                               SearchedFamilies families = {});

/// Fails (Unsupported) if the image size differs from that of the camera.
[[nodiscard]] Status check_image_size(const CameraModel& camera, int width_px, int height_px);

}  // namespace waymark
