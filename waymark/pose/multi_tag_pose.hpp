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
  /// the same as TagPoseOptions::corner_sigma_px
  double corner_sigma_px = TagPoseOptions{}.corner_sigma_px;
  double tag_gate_chi2 = 26.1;     ///< 0.999 quantile of chi-square for 8 residuals
  double corner_gate_chi2 = 16.6;  ///< for 2 residuals; 0.999 quantile for all four corners together
  double ambiguity_chi2 = 9.0;     ///< corresponds to a likelihood ratio of 1 in 90
  double duplicate_px = 1.0;       ///< two detections of the same id that are closer than this count as one
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

/// A camera pose that explains a set of tags.
struct CameraPoseEstimate {
  SE3 map_T_cam{};
  /// In the left tangent of the map frame; computed from the covariances of the corners and of the map tags,
  /// assuming that tags are independent.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;    ///< 8 residuals per tag and 6 unknowns
  double rms_px = 0;  ///< root mean square distance between the corners and their projections [px]
  std::vector<std::size_t> detections{};  ///< indices of the detections used, in ascending order
};

enum class RejectReason : std::uint8_t {
  NotInMap,
  BadMapEntry,             ///< the size, pose or covariance in the map is invalid
  Duplicate,               ///< a second detection of an id in the same position
  ContradictoryDuplicate,  ///< the id was detected in several positions, and which one is correct is unknown
  BadDetection,            ///< the corners are not an image of a square, or the covariance is invalid
  NotVisible,  ///< given the estimated pose, the tag is behind the camera or outside the field of the lens
  Outlier,     ///< the tag is inconsistent with the pose obtained from the others, or fits no pose at all
  UnreliableCorners,  ///< the corners are marked as unreliable (CornerState)
};

[[nodiscard]] const char* to_string(RejectReason reason);

/// A detection that was not used, and the reason.
struct RejectedTag {
  std::size_t detection = 0;  ///< index of the detection
  TagId tag{};
  RejectReason reason = RejectReason::Outlier;
  std::string message;  ///< a message that includes values
  double chi2 = 0;      ///< only for Outlier: chi2 of its 8 residuals under the first estimate
};

/// The camera poses estimated from one image.
struct MultiTagPose {
  /// Sorted best first: most tags, then smallest chi2. If it is empty, no tag could be used. If there are
  /// several, the image does not determine which one is correct (one tag with two poses, two contradictory
  /// tags, …), and the function does not choose between them.
  std::vector<CameraPoseEstimate> estimates{};
  std::vector<RejectedTag>
      rejected{};  ///< in ascending order of detections; outliers are relative to the first estimate

  [[nodiscard]] bool usable() const { return estimates.size() == 1; }
  [[nodiscard]] bool ambiguous() const { return estimates.size() > 1; }
};

/// Estimates the pose of the camera in the map jointly from all tags in an image. Each of the two solutions
/// for each tag proposes a pose, and tags consistent with that pose are added. The largest consensus is
/// refined over all its corners (docs/concepts/pose.md, "Several tags"). Fails only if an option is out of
/// range; problems with individual tags are listed in `rejected`. O(tags) if all tags agree, O(tags^2) in the
/// worst case. Deterministic.
[[nodiscard]] Result<MultiTagPose> estimate_camera_pose(std::span<const TagDetection> detections,
                                                        const TagMap& map, const CameraModel& camera,
                                                        const MultiTagOptions& options = {});

}  // namespace waymark
