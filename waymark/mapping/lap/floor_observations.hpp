#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/pose/agreement.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A tag as one frame saw it.
struct TagPoseObservation {
  TagId tag{};
  SE3 cam_T_tag{};             ///< the better of its two poses
  double ambiguity_ratio = 0;  ///< of TagPose: near 1 the other pose fits as well
  /// Of cam_T_tag; zeros: not known, all observations count the same.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;                            ///< of the better pose
  std::optional<TagPoseSolution> other = {};  ///< the other pose
};

/// What one frame saw.
struct ObservedFrame {
  SensorTime stamp{};
  std::optional<SE3> base_T_cam{};  ///< of the camera that saw it; nothing: of the robot's first
  std::vector<TagPoseObservation> tags{};
};

}  // namespace waymark

namespace waymark::internal {

/// A tag as a robot on a floor sees it: where it is in the plane, once for each of its poses that is
/// possible.
struct FloorObservation {
  TagId tag{};
  std::vector<FloorFit> base_X_tag{};
};

struct FloorFrame {
  SensorTime stamp{};
  std::vector<FloorObservation> tags{};
};

/// Height over the floor and tilts of each tag: floor_T_tag = lift(floor_X_tag) * shape. A robot that stays
/// on its floor sees them directly from every frame, so they do not add up along a chain.
using TagShapes = std::map<TagId, SE3>;

/// `base_T_cam`: of the first camera.
[[nodiscard]] TagShapes tag_shapes(const std::vector<ObservedFrame>& frames, const SE3& base_T_cam,
                                   const FloorOptions& options);

/// All observations on the floor, in the order of the frames; poses that contradict the shape of their tag
/// are left out.
[[nodiscard]] std::vector<FloorFrame> floor_frames(const std::vector<ObservedFrame>& frames,
                                                   const TagShapes& shapes, const SE3& base_T_cam,
                                                   const FloorOptions& options);

}  // namespace waymark::internal

namespace waymark {

/// How a tag stands on the floor that the robot drives on.
struct AnchorStance {
  enum class Kind : std::uint8_t { Upright, Leaning, Lying };

  Kind kind = Kind::Upright;
  double tilt_rad = 0;  ///< between the tag's up (-y) and the floor's, or for a lying tag between its normal
                        ///< and the floor's
  /// The anchor in a map with its origin at the tag's centre, map z the floor's up, and map x the direction
  /// of tag z along the floor (lying: of tag x): of an upright tag map z = tag -y, map x = tag z.
  SE3 map_T_anchor{};
};

/// What the motion of a robot on its floor says of a tag; nothing when the tag was never seen. A tag counts
/// as leaning from 5 degrees on (a smaller lean is measured all the same), as lying from 64 degrees on.
[[nodiscard]] std::optional<AnchorStance> anchor_stance(const std::vector<ObservedFrame>& frames,
                                                        const TagId& anchor, const SE3& base_T_cam,
                                                        const FloorOptions& options = {});

/// What a person should know of it; empty for an upright tag.
[[nodiscard]] std::string describe(const AnchorStance& stance, const TagId& anchor);

}  // namespace waymark
