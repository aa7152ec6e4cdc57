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
  double corner_sigma_px = TagPoseOptions{}.corner_sigma_px;  ///< the same number, and used in the same case
  double tag_gate_chi2 = 26.1;                                ///< 0.999 quantile for 8 residuals
  double corner_gate_chi2 = 16.6;  ///< for 2 residuals; 0.999 for all four corners of a tag together
  double ambiguity_chi2 = 9.0;     ///< likelihood ratio of 1 in 90
  double duplicate_px = 1.0;       ///< two detections of one id nearer than this are one
  int max_iterations = 30;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.corner_sigma_px, Field{"corner_sigma_px",
                                      "Standard deviation of a corner coordinate when the detector gives no "
                                      "covariance; raise it for blurred "
                                      "images or a rough calibration.",
                                      1e-6, 1e3});
    visit(self.tag_gate_chi2, Field{"tag_gate_chi2",
                                    "Squared normalised residual of a tag (8 numbers) above which it is left "
                                    "out; raise it when the map is less accurate than its covariance states.",
                                    1, 1e9});
    visit(self.corner_gate_chi2,
          Field{"corner_gate_chi2",
                "Squared normalised residual of a corner (2 numbers) above which it is left out.", 1, 1e9});
    visit(self.ambiguity_chi2, Field{"ambiguity_chi2",
                                     "Largest difference in chi2 at which another pose that explains as many "
                                     "tags is reported as possible.",
                                     0, 1e9});
    visit(self.duplicate_px, Field{"duplicate_px",
                                   "Distance of the corners of two detections of one id below which they are "
                                   "one detection; above it both are left out as contradictory.",
                                   0, 1e3});
    visit(self.max_iterations,
          Field{"max_iterations", "Maximum number of steps of one search; 5 are usual.", 1, 1000});
  }
};

/// One pose of the camera that explains a set of tags.
struct CameraPoseEstimate {
  SE3 map_T_cam{};
  /// In the map frame's left tangent; from the corners' and the mapped tags' covariance, tags taken as
  /// independent.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;    ///< 8 residuals a tag, 6 unknowns
  double rms_px = 0;  ///< root mean square distance of the corners from where they project [px]
  std::vector<std::size_t> detections{};  ///< indices of the detections it rests on, ascending
};

enum class RejectReason : std::uint8_t {
  NotInMap,
  BadMapEntry,             ///< size, pose or covariance in the map that cannot be
  Duplicate,               ///< the id was seen twice in one place; this is the second
  ContradictoryDuplicate,  ///< the id was seen in several places; which is the true one cannot be known
  BadDetection,            ///< corners that are no image of a square, or a covariance that is none
  NotVisible,              ///< from the pose found it would lie behind the camera or beyond the lens
  Outlier,                 ///< it disagrees with the pose of the others, or fits no pose at all
};

[[nodiscard]] const char* to_string(RejectReason reason);

/// A detection that was not used, and why.
struct RejectedTag {
  std::size_t detection = 0;  ///< index into the detections
  TagId tag{};
  RejectReason reason = RejectReason::Outlier;
  std::string words;  ///< a sentence with the numbers
  double chi2 = 0;    ///< Outlier: of its 8 residuals under the first estimate
};

/// What one image says about where the camera is.
struct MultiTagPose {
  /// Best first: most tags, then smallest chi2. Empty: no tag could be used. More than one: the image does
  /// not tell which is true (one tag and its two poses, two tags that contradict each other, …) and nothing
  /// here has chosen.
  std::vector<CameraPoseEstimate> estimates{};
  std::vector<RejectedTag> rejected{};  ///< ascending detection; outliers are those of the first estimate

  [[nodiscard]] bool usable() const { return estimates.size() == 1; }
  [[nodiscard]] bool ambiguous() const { return estimates.size() > 1; }
};

/// The pose of the camera in the map from all tags of one image together: both solutions of each tag propose
/// a pose, tags that agree with it join in, the largest consensus wins and is refined over all its corners
/// (docs/concepts/pose.md, "Several tags"). Fails only on options out of range; everything wrong with a tag
/// is told in `rejected`. O(tags) when all agree, O(tags^2) at worst. Deterministic.
[[nodiscard]] Result<MultiTagPose> estimate_camera_pose(std::span<const TagDetection> detections,
                                                        const TagMap& map, const CameraModel& camera,
                                                        const MultiTagOptions& options = {});

}  // namespace waymark
