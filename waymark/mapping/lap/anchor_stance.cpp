#include "waymark/mapping/lap/anchor_stance.hpp"

#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/mapping/lap/floor_observations.hpp"

namespace waymark {
namespace {

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

std::optional<AnchorStance> anchor_stance(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                          const SE3& base_T_cam, const FloorOptions& options) {
  constexpr double kWorthSaying = to_radians(5);
  const internal::TagShapes shapes = internal::tag_shapes(frames, base_T_cam, options);
  const auto shape = shapes.find(anchor);
  if (shape == shapes.end()) return std::nullopt;
  const SO3& floor_R_tag = shape->second.rotation();
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d normal = floor_R_tag * up;
  AnchorStance stance{.tilt_rad = angle_between(floor_R_tag * -Eigen::Vector3d::UnitY(), up),
                      .map_T_anchor = SE3(floor_R_tag, Eigen::Vector3d::Zero())};
  if (std::abs(normal.z()) > 0.9) {
    stance.kind = AnchorStance::Kind::Lying;
    stance.tilt_rad = std::min(angle_between(normal, up), angle_between(-normal, up));
  } else if (stance.tilt_rad > kWorthSaying) {
    stance.kind = AnchorStance::Kind::Leaning;
  }
  return stance;
}

std::string in_words(const AnchorStance& stance, const TagId& anchor) {
  const char* level = "the map is level with the floor, its origin at the tag's centre, its x axis along";
  switch (stance.kind) {
    case AnchorStance::Kind::Upright:
      return {};
    case AnchorStance::Kind::Leaning:
      return fmt::format("the anchor {} leans by {:.0f} deg: {} the floor below the tag's normal",
                         to_string(anchor), to_degrees(stance.tilt_rad), level);
    case AnchorStance::Kind::Lying:
      return fmt::format("the anchor {} lies: {} the tag's x axis", to_string(anchor), level);
  }
  return {};
}

}  // namespace waymark
