#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct MultiTagOptions {
  /// the same parameter as in TagPoseOptions
  double corner_sigma_px = TagPoseOptions{}.corner_sigma_px;
  double tag_gate_chi2 = 26.1;     ///< 0.999 quantile for 8 residuals
  double corner_gate_chi2 = 16.6;  ///< for 2 residuals; 0.999 for all four corners of a tag together
  double ambiguity_chi2 = 9.0;     ///< likelihood ratio of 1 in 90
  double duplicate_px = 1.0;       ///< two detections of one id nearer than this count as one
  int max_iterations = 30;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px, Field{"corner_sigma_px",
                                      "Standard deviation of a corner coordinate if the detector provides no "
                                      "covariance; raise it for blurred "
                                      "images or a rough calibration.",
                                      1e-6, 1e3});
    visit(self.tag_gate_chi2,
          Field{"tag_gate_chi2",
                "Squared normalised residual of a tag (8 coordinates) above which it is rejected; "
                "raise it if the map is less accurate than its covariance states.",
                1, 1e9});
    visit(self.corner_gate_chi2,
          Field{"corner_gate_chi2",
                "Squared normalised residual of a corner (2 coordinates) above which its tag is rejected.", 1,
                1e9});
    visit(self.ambiguity_chi2,
          Field{"ambiguity_chi2",
                "Largest difference in chi2 up to which another pose that explains as many "
                "tags is reported as possible.",
                0, 1e9});
    visit(self.duplicate_px, Field{"duplicate_px",
                                   "Distance of the corners of two detections of one id below which they are "
                                   "one detection; above it both are rejected as contradictory.",
                                   0, 1e3});
    visit(self.max_iterations,
          Field{"max_iterations", "Maximum number of steps of one search; 5 are usual.", 1, 1000});
  }
};

/// One pose of the camera that explains a set of tags.
struct CameraPoseEstimate {
  SE3 map_T_cam{};
  /// In the map frame's left tangent; from the covariances of the corners and the map tags, assuming
  /// independent tags.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;    ///< 8 residuals per tag, 6 unknowns
  double rms_px = 0;  ///< root mean square distance of the corners from their projections [px]
  std::vector<std::size_t> detections{};  ///< indices of the detections used, ascending
};

enum class RejectReason : std::uint8_t {
  NotInMap,
  BadMapEntry,             ///< invalid size, pose or covariance in the map
  Duplicate,               ///< the second detection of an id at one position
  ContradictoryDuplicate,  ///< the id was detected at several positions; the correct one is ambiguous
  BadDetection,            ///< corners that are not an image of a square, or an invalid covariance
  NotVisible,              ///< according to the estimated pose it is behind the camera or beyond the lens
  Outlier,                 ///< it is inconsistent with the pose from the others, or fits no pose at all
};

[[nodiscard]] const char* to_string(RejectReason reason);

/// A detection that was not used, with the reason.
struct RejectedTag {
  std::size_t detection = 0;  ///< index into the detections
  TagId tag{};
  RejectReason reason = RejectReason::Outlier;
  std::string message;  ///< message with values
  double chi2 = 0;      ///< Outlier: of its 8 residuals under the first estimate
};

/// Camera poses estimated from one image.
struct MultiTagPose {
  /// Best first: most tags, then smallest chi2. Empty: no tag could be used. More than one: the image does
  /// not determine the correct one (one tag with two poses, two contradicting tags, …), and the function does
  /// not choose.
  std::vector<CameraPoseEstimate> estimates{};
  std::vector<RejectedTag> rejected{};  ///< ascending detection; outliers are relative to the first estimate

  [[nodiscard]] bool usable() const { return estimates.size() == 1; }
  [[nodiscard]] bool ambiguous() const { return estimates.size() > 1; }
};

/// The pose of the camera in the map from all tags of one image together. Each of the two solutions of each
/// tag proposes a pose, and tags consistent with it are added. The largest consensus is refined over all its
/// corners (docs/concepts/pose.md, "Several tags"). Fails only on options out of range; problems of single
/// tags are listed in `rejected`. O(tags) if all agree, O(tags^2) at worst. Deterministic.
[[nodiscard]] Result<MultiTagPose> estimate_camera_pose(std::span<const TagDetection> detections,
                                                        const TagMap& map, const CameraModel& camera,
                                                        const MultiTagOptions& options = {});

}  // namespace waymark
