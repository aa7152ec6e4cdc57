#include <cmath>

#include "waymark/geometry/planar.hpp"
#include "waymark/mapping/lap/map_comparison.hpp"

namespace waymark {
namespace {

struct Pair {
  Eigen::Vector2d prior_p = Eigen::Vector2d::Zero();
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

SE2 from_two(const Pair& a, const Pair& b) {
  const Eigen::Vector2d before = b.prior_p - a.prior_p;
  const Eigen::Vector2d now = b.map_p - a.map_p;
  const SO2 turn(std::atan2(now.y(), now.x()) - std::atan2(before.y(), before.x()));
  return {turn, (a.map_p + b.map_p) / 2 - turn * Eigen::Vector2d((a.prior_p + b.prior_p) / 2)};
}

std::vector<Pair> agreeing(const std::vector<Pair>& pairs, const SE2& map_X_prior, double same_m) {
  std::vector<Pair> good;
  for (const Pair& pair : pairs) {
    if ((map_X_prior * pair.prior_p - pair.map_p).norm() < same_m) good.push_back(pair);
  }
  return good;
}

/// The turn and shift with the least squares (Umeyama, 1991, in the plane, without a scale).
SE2 least_squares(const std::vector<Pair>& pairs) {
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  Eigen::Vector2d now = Eigen::Vector2d::Zero();
  for (const Pair& pair : pairs) {
    before += pair.prior_p / static_cast<double>(pairs.size());
    now += pair.map_p / static_cast<double>(pairs.size());
  }
  double c = 0;
  double s = 0;
  for (const Pair& pair : pairs) {
    const Eigen::Vector2d a = pair.prior_p - before;
    const Eigen::Vector2d b = pair.map_p - now;
    c += a.dot(b);
    s += a.x() * b.y() - a.y() * b.x();
  }
  const SO2 turn(std::atan2(s, c));
  return {turn, now - turn * before};
}

/// A map of points: all tags turned as one, so that only places differ.
TagMap flat(const TagMap& map, const SO3& rotation) {
  TagMap points = map;
  for (auto& [id, tag] : points.tags) {
    const Eigen::Vector3d& p = tag.map_T_tag.translation();
    tag.map_T_tag = SE3(rotation, {p.x(), p.y(), 0});
  }
  return points;
}

}  // namespace

Result<MapComparison> compare_points(const TagMap& map, const std::vector<PriorPoint>& prior,
                                     const MapComparisonOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  TagMap points;
  std::vector<Pair> pairs;
  for (const PriorPoint& point : prior) {
    TagId id{.number = point.number};
    for (const auto& [tag, mapped] : map.tags) {
      if (tag.number != point.number) continue;
      id = tag;
      pairs.push_back({point.map_p, mapped.map_T_tag.translation().head<2>()});
    }
    const MappedTag* now = map.find(id);
    points.tags[id] = {SE3({}, {point.map_p.x(), point.map_p.y(), 0}), now != nullptr ? now->size_m : 0};
  }
  std::vector<Pair> best;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const std::vector<Pair> good = agreeing(pairs, from_two(pairs[i], pairs[k]), options.same_m);
      if (good.size() > best.size()) best = good;
    }
  }
  if (best.size() < 3)
    return fail(ErrorCode::NotFound,
                "no three places of the two maps agree on how the maps lie to each other", {},
                "Are these maps of the same place?");
  for (int i = 0; i < 3; ++i) best = agreeing(pairs, least_squares(best), options.same_m);
  MapComparison comparison{.map_T_prior = lift(least_squares(best)),
                           .agreeing = static_cast<int>(best.size())};
  internal::judge_tags(flat(map, comparison.map_T_prior.rotation()), points, options, comparison);
  return comparison;
}

}  // namespace waymark
