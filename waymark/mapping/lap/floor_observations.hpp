#pragma once

#include <map>
#include <vector>

#include "waymark/mapping/lap/observed_frame.hpp"
#include "waymark/pose/agreement.hpp"
#include "waymark/pose/floor_fit.hpp"

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
