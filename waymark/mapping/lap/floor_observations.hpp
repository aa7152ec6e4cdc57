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

/// An observation of a tag in one frame.
struct TagPoseObservation {
  TagId tag{};
  SE3 cam_T_tag{};             ///< the better of its two poses
  double ambiguity_ratio = 0;  ///< as in TagPose; near 1 if the other pose fits almost as well
  /// Covariance of cam_T_tag; zero if unknown, in which case all observations have equal weight.
  PoseCovariance covariance = PoseCovariance::Zero();
  double chi2 = 0;                            ///< chi2 of the better pose
  std::optional<TagPoseSolution> other = {};  ///< the other pose
};

/// The observations of one frame.
struct ObservedFrame {
  SensorTime stamp{};
  /// Mounting pose of this frame's camera; empty for the robot's first camera.
  std::optional<SE3> base_T_cam{};
  std::vector<TagPoseObservation> tags{};
};

}  // namespace waymark

namespace waymark::internal {

/// A tag observation made by a robot on a floor, with one planar pose for each possible pose of the tag.
struct FloorObservation {
  TagId tag{};
  std::vector<FloorFit> base_X_tag{};
};

struct FloorFrame {
  SensorTime stamp{};
  std::vector<FloorObservation> tags{};
};

/// Height above the floor and tilts of each tag: floor_T_tag = lift(floor_X_tag) * shape. A robot on its
/// floor observes them directly in every frame, so their errors do not accumulate along a chain.
using TagShapes = std::map<TagId, SE3>;

/// The shape of each observed tag. `base_T_cam`: mounting pose of the first camera.
[[nodiscard]] TagShapes tag_shapes(const std::vector<ObservedFrame>& frames, const SE3& base_T_cam,
                                   const FloorOptions& options);

/// The observations of one frame projected onto the floor; poses inconsistent with the shape of their tag are
/// skipped.
[[nodiscard]] FloorFrame floor_frame(const ObservedFrame& frame, const TagShapes& shapes,
                                     const SE3& base_T_cam, const FloorOptions& options);

/// The same for all frames, in their order.
[[nodiscard]] std::vector<FloorFrame> floor_frames(const std::vector<ObservedFrame>& frames,
                                                   const TagShapes& shapes, const SE3& base_T_cam,
                                                   const FloorOptions& options);

}  // namespace waymark::internal

namespace waymark {

/// Orientation of a tag relative to the floor that the robot drives on.
struct AnchorStance {
  enum class Kind : std::uint8_t { Upright, Leaning, Lying };

  Kind kind = Kind::Upright;
  /// Angle between the tag's up direction (-y) and the floor's; for a lying tag, the angle between the
  /// normals.
  double tilt_rad = 0;
  /// The anchor's pose in a map whose origin is at the tag's centre and whose z axis is along the floor
  /// normal. Map x is along the projection of tag z (for a lying tag, tag x) onto the floor. For an upright
  /// tag, map z = tag -y and map x = tag z.
  SE3 map_T_anchor{};
};

/// Estimates the orientation of a tag from the motion of a robot on its floor; empty if the tag was never
/// observed. A tag is considered leaning from 5 degrees on (smaller angles are measured, too), and lying from
/// 64 degrees on.
[[nodiscard]] std::optional<AnchorStance> anchor_stance(const std::vector<ObservedFrame>& frames,
                                                        const TagId& anchor, const SE3& base_T_cam,
                                                        const FloorOptions& options = {});

/// A description for the user; empty for an upright tag.
[[nodiscard]] std::string describe(const AnchorStance& stance, const TagId& anchor);

}  // namespace waymark
