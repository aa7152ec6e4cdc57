#include "waymark/mapping/lap/floor_observations.hpp"

#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark::internal {
namespace {

constexpr double kGate3 = 16.3;  // 0.999 quantile of chi-square with 3 degrees of freedom
// A pose whose excess over the other one is larger than this is not the true one.
constexpr double kBranchChi2 = 20;

/// One of the two poses of an observed tag in the base frame, with the excess of its chi2 over that of the
/// better one.
struct Branch {
  Uncertain<SE3> base_T_tag{};
  double chi2 = 0;
};

std::vector<Branch> branches(const TagPoseObservation& seen, const SE3& base_T_cam) {
  const Covariance<SE3> Ad = base_T_cam.adjoint();
  const auto in_base = [&](const SE3& cam_T_tag, const PoseCovariance& covariance, double chi2) {
    return Branch{{base_T_cam * cam_T_tag, Ad * covariance * Ad.transpose()}, chi2};
  };
  std::vector<Branch> result = {in_base(seen.cam_T_tag, seen.covariance, 0)};
  if (seen.other && seen.other->chi2 - seen.chi2 < kBranchChi2)
    result.push_back(in_base(seen.other->cam_T_tag, seen.other->covariance, seen.other->chi2 - seen.chi2));
  return result;
}

/// The planar motion from a standard pose of a tag to its pose in front of the robot. In the standard pose,
/// the tag is at the origin with its normal along x or, if the normal is vertical, with its x axis along x.
/// The remaining part of the tag's pose is its shape.
SE2 standard_place(const SE3& base_T_tag, bool lies) {
  const Eigen::Vector3d axis =
      base_T_tag.rotation() * (lies ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitZ());
  return {base_T_tag.translation().x(), base_T_tag.translation().y(), std::atan2(axis.y(), axis.x())};
}

bool lies(const SE3& base_T_tag) {
  return std::abs((base_T_tag.rotation() * Eigen::Vector3d::UnitZ()).z()) > 0.9;
}

/// The information that one pose provides about the shape: the height and the tilts with their covariance,
/// but nothing about the motion in the plane.
Alternative<SE3> shape_of(const Branch& branch, bool lying, const FloorOptions& options) {
  const SE2 base_X_tag = standard_place(branch.base_T_tag.mean, lying);
  const SE3 tag_T_base = lift(base_X_tag).inverse();
  Covariance<SE3> P = branch.base_T_tag.covariance;
  P.diagonal().segment<3>(2) += Eigen::Vector3d(options.height_sigma_m * options.height_sigma_m,
                                                options.tilt_sigma_rad * options.tilt_sigma_rad,
                                                options.tilt_sigma_rad * options.tilt_sigma_rad);
  const Covariance<SE3> Ad = tag_T_base.adjoint();
  const Covariance<SE3> moved = Ad * P * Ad.transpose();
  Alternative<SE3> shape{.value = tag_T_base * branch.base_T_tag.mean, .chi2 = branch.chi2};
  shape.information.setZero();
  shape.information.block<3, 3>(2, 2) = moved.block<3, 3>(2, 2).inverse();
  return shape;
}

}  // namespace

TagShapes tag_shapes(const std::vector<ObservedFrame>& frames, const SE3& base_T_cam,
                     const FloorOptions& options) {
  struct Seen {
    const TagPoseObservation* observation;
    SE3 base_T_cam;
  };
  std::map<TagId, std::vector<Seen>> observations;
  for (const ObservedFrame& frame : frames) {
    for (const TagPoseObservation& seen : frame.tags)
      observations[seen.tag].push_back({&seen, frame.base_T_cam.value_or(base_T_cam)});
  }
  TagShapes shapes;
  for (const auto& [tag, seen] : observations) {
    int lying = 0;
    for (const auto& [observation, base_T_eye] : seen)
      lying += lies(base_T_eye * observation->cam_T_tag) ? 1 : 0;
    const bool mostly = 2 * lying > static_cast<int>(seen.size());
    std::vector<Vote<SE3>> votes;
    for (const auto& [observation, base_T_eye] : seen) {
      Vote<SE3> vote;
      for (const Branch& branch : branches(*observation, base_T_eye))
        vote.push_back(shape_of(branch, mostly, options));
      votes.push_back(std::move(vote));
    }
    if (const auto agreed = agree(votes, kGate3)) shapes[tag] = agreed->value.mean;
  }
  return shapes;
}

FloorFrame floor_frame(const ObservedFrame& frame, const TagShapes& shapes, const SE3& base_T_cam,
                       const FloorOptions& options) {
  FloorFrame on_floor{.stamp = frame.stamp};
  for (const TagPoseObservation& seen : frame.tags) {
    const auto shape = shapes.find(seen.tag);
    if (shape == shapes.end()) continue;
    FloorObservation observation{.tag = seen.tag};
    for (const Branch& branch : branches(seen, frame.base_T_cam.value_or(base_T_cam))) {
      FloorFit fit = fit_to_floor(branch.base_T_tag, shape->second, options);
      fit.chi2 += branch.chi2;
      if (fit.chi2 < kGate3) observation.base_X_tag.push_back(fit);
    }
    if (!observation.base_X_tag.empty()) on_floor.tags.push_back(std::move(observation));
  }
  return on_floor;
}

std::vector<FloorFrame> floor_frames(const std::vector<ObservedFrame>& frames, const TagShapes& shapes,
                                     const SE3& base_T_cam, const FloorOptions& options) {
  std::vector<FloorFrame> result;
  result.reserve(frames.size());
  for (const ObservedFrame& frame : frames) result.push_back(floor_frame(frame, shapes, base_T_cam, options));
  return result;
}

}  // namespace waymark::internal

namespace waymark {
namespace {

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

}  // namespace

std::optional<AnchorStance> anchor_stance(const std::vector<ObservedFrame>& frames, const TagId& anchor,
                                          const SE3& base_T_cam, const FloorOptions& options) {
  constexpr double kMinReportedLean = to_radians(5);
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
  } else if (stance.tilt_rad > kMinReportedLean) {
    stance.kind = AnchorStance::Kind::Leaning;
  }
  return stance;
}

std::string describe(const AnchorStance& stance, const TagId& anchor) {
  const char* level =
      "the map is level with the floor, with its origin at the tag's centre and its x axis along";
  switch (stance.kind) {
    case AnchorStance::Kind::Upright:
      return {};
    case AnchorStance::Kind::Leaning:
      return fmt::format("the anchor {} leans by {:.0f} deg: {} the tag's normal projected onto the floor",
                         to_string(anchor), to_degrees(stance.tilt_rad), level);
    case AnchorStance::Kind::Lying:
      return fmt::format("the anchor {} is horizontal: {} the tag's x axis", to_string(anchor), level);
  }
  return {};
}

}  // namespace waymark
