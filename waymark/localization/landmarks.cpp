#include "waymark/localization/landmarks.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "waymark/geometry/se3.hpp"

namespace waymark {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Covariance of a tag given the tag to which it is tied: the Schur complement in their joint covariance.
Matrix6 own_covariance(const TagMap& map, const MappedTag& tag) {
  const MappedTag* other = tag.tie ? map.find(tag.tie->to) : nullptr;
  if (other == nullptr || !other->covariance) return *tag.covariance;
  const Matrix6& C = tag.tie->covariance;
  const Eigen::CompleteOrthogonalDecomposition<Matrix6> of_other(*other->covariance);
  const Matrix6 own = *tag.covariance - C * of_other.solve(C.transpose());
  const Matrix6 symmetric = (own + own.transpose()) / 2;
  const bool positive = Eigen::LLT<Matrix6>(symmetric).info() == Eigen::Success;
  return positive ? symmetric : *tag.covariance;
}

}  // namespace

void Landmarks::add(const Landmark& landmark) {
  by_number_.emplace(landmark.tag.number, size());
  all_.push_back(landmark);
}

Landmarks::Landmarks(const TagMap& map) {
  const SE3 floor_T_map = map_T_floor(map.floor).inverse();
  Matrix6 floor_R_map = Matrix6::Zero();
  floor_R_map.topLeftCorner<3, 3>() = floor_R_map.bottomRightCorner<3, 3>() = floor_T_map.rotation().matrix();
  for (const auto& [id, tag] : map.tags) {
    Landmark landmark{.tag = id, .map_T_tag = floor_T_map * tag.map_T_tag, .size_m = tag.size_m};
    if (tag.covariance) {
      // In the map, the covariance is for a motion of the whole frame; here, the tag rotates about its own
      // centre.
      Matrix6 J = Matrix6::Identity();
      J.topRightCorner<3, 3>() = -SO3::hat(tag.map_T_tag.translation());
      const Matrix6 J_floor = floor_R_map * J;
      landmark.covariance = J_floor * *tag.covariance * J_floor.transpose();
      landmark.own_covariance = J_floor * own_covariance(map, tag) * J_floor.transpose();
    }
    add(landmark);
  }
}

Result<Landmarks> Landmarks::of_points(const std::vector<LandmarkPoint>& points) {
  Landmarks landmarks;
  std::set<std::int64_t> seen;
  for (const LandmarkPoint& point : points) {
    if (!seen.insert(point.number).second)
      return fail(ErrorCode::InvalidArgument, fmt::format("duplicate landmark {}", point.number));
    if (!point.map_p.allFinite())
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("non-finite position of landmark {}", point.number));
    landmarks.add({.tag = {.number = static_cast<int>(point.number)},
                   .map_T_tag = SE3({}, {point.map_p.x(), point.map_p.y(), 0}),
                   .oriented = false,
                   .family_known = false});
  }
  return landmarks;
}

int Landmarks::find(const TagId& tag) const {
  const auto [first, last] = by_number_.equal_range(tag.number);
  for (auto it = first; it != last; ++it) {
    const Landmark& landmark = (*this)[it->second];
    if (!landmark.family_known || landmark.tag.family == tag.family) return it->second;
  }
  return -1;
}

int Landmarks::find(std::int64_t number) const {
  const auto it = by_number_.find(number);
  return it == by_number_.end() ? -1 : it->second;
}

std::vector<std::pair<int, int>> Landmarks::overlapping() const {
  std::vector<std::pair<int, int>> pairs;
  for (int i = 0; i < size(); ++i) {
    for (int j = i + 1; j < size(); ++j) {
      const Landmark& a = (*this)[i];
      const Landmark& b = (*this)[j];
      const double apart_m = (a.map_T_tag.translation() - b.map_T_tag.translation()).norm();
      const double room_m = std::max(1e-6, (a.size_m + b.size_m) / 4);
      const bool facing = !a.oriented || !b.oriented ||
                          (a.map_T_tag.rotation() * Eigen::Vector3d::UnitZ())
                                  .dot(b.map_T_tag.rotation() * Eigen::Vector3d::UnitZ()) > 0;
      if (apart_m < room_m && facing) pairs.emplace_back(i, j);
    }
  }
  return pairs;
}

}  // namespace waymark
