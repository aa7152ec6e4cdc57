#include "waymark/mapping/lap/map_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// The distance between two tag poses in units of the tolerance for an unmoved tag.
double separation(const SE3& a, const SE3& b, const MapComparisonOptions& options) {
  const double metres = (a.translation() - b.translation()).norm() / options.same_m;
  const double radians = (a.rotation().inverse() * b.rotation()).angle() / options.same_rad;
  return std::max(metres, radians);
}

int agreeing(const TagMap& map, const TagMap& prior, const SE3& map_T_prior,
             const MapComparisonOptions& options) {
  int count = 0;
  for (const auto& [id, tag] : prior.tags) {
    const MappedTag* now = map.find(id);
    count += now != nullptr && separation(map_T_prior * tag.map_T_tag, now->map_T_tag, options) < 1 ? 1 : 0;
  }
  return count;
}

/// A Gauss-Newton step of the alignment with the agreeing tags, in units of the tolerance. Across a room, the
/// positions of the tags determine the rotation more accurately than their rotations do.
SE3 stepped(const TagMap& map, const TagMap& prior, const SE3& map_T_prior,
            const MapComparisonOptions& options) {
  SE3::Jacobian information = SE3::Jacobian::Zero();
  SE3::Tangent sum = SE3::Tangent::Zero();
  for (const auto& [id, tag] : prior.tags) {
    const MappedTag* now = map.find(id);
    const SE3 expected = map_T_prior * tag.map_T_tag;
    if (now == nullptr || separation(expected, now->map_T_tag, options) >= 1) continue;
    // Derivative of position and rotation with respect to the left tangent of map_T_prior.
    SE3::Jacobian J = SE3::Jacobian::Identity();
    J.topRightCorner<3, 3>() = -SO3::hat(expected.translation());
    SE3::Tangent off;
    off << now->map_T_tag.translation() - expected.translation(),
        (now->map_T_tag.rotation() * expected.rotation().inverse()).log();
    SE3::Tangent weight;
    weight << Eigen::Vector3d::Constant(1 / (options.same_m * options.same_m)),
        Eigen::Vector3d::Constant(1 / (options.same_rad * options.same_rad));
    information += J.transpose() * weight.asDiagonal() * J;
    sum += J.transpose() * weight.cwiseProduct(off);
  }
  const Eigen::LLT<SE3::Jacobian> llt(information);
  return llt.info() == Eigen::Success ? plus(SE3::Tangent(llt.solve(sum)), map_T_prior) : map_T_prior;
}

/// Repeats the selection of agreeing tags and their alignment until neither changes. Starts with a wider
/// tolerance, because the alignment estimated from one tag is inaccurate far away from it.
SE3 refined(const TagMap& map, const TagMap& prior, SE3 map_T_prior, const MapComparisonOptions& options) {
  constexpr int kSteps = 20;
  constexpr double kMinStep = 1e-9;
  for (const double wider : {4, 2, 1}) {
    const MapComparisonOptions view{wider * options.same_m, wider * options.same_rad};
    for (int i = 0; i < kSteps; ++i) {
      const SE3 before = map_T_prior;
      map_T_prior = stepped(map, prior, before, view);
      if (minus(map_T_prior, before).norm() < kMinStep) break;
    }
  }
  return map_T_prior;
}

ComparedTag compared_tag(const TagId& id, const MappedTag& now, const TagMap& map, const TagMap& prior,
                         const SE3& map_T_prior, const MapComparisonOptions& options) {
  const MappedTag* before = prior.find(id);
  if (before == nullptr) return {.tag = id, .change = TagChange::New};
  const SE3 expected = map_T_prior * before->map_T_tag;
  ComparedTag compared{.tag = id,
                       .distance_m = (expected.translation() - now.map_T_tag.translation()).norm(),
                       .turned_rad = (expected.rotation().inverse() * now.map_T_tag.rotation()).angle()};
  constexpr double kSameSize = 0.02;
  if (separation(expected, now.map_T_tag, options) < 1) {
    compared.change = std::abs(now.size_m - before->size_m) > kSameSize * before->size_m ? TagChange::Resized
                                                                                         : TagChange::Same;
    return compared;
  }
  compared.change = TagChange::Moved;
  for (const auto& [other, there] : prior.tags) {
    const MappedTag* other_now = map.find(other);
    if (other == id || other_now == nullptr) continue;
    const bool has_its_place = separation(map_T_prior * there.map_T_tag, now.map_T_tag, options) < 1;
    const bool gave_its_place = separation(expected, other_now->map_T_tag, options) < 1;
    if (!has_its_place || !gave_its_place) continue;
    compared.change = TagChange::Swapped;
    compared.with = other;
  }
  return compared;
}

/// The size ratio of the maps if it is the same for all distances, which indicates different tag sizes. Empty
/// if the ratios of the distances disagree or if the ratio is one.
std::optional<double> times_as_large(const TagMap& map, const TagMap& prior) {
  constexpr double kMaxSpread = 0.03;
  constexpr std::size_t kMinRatios = 3;
  std::vector<double> ratios;
  for (auto a = prior.tags.begin(); a != prior.tags.end(); ++a) {
    for (auto b = std::next(a); b != prior.tags.end(); ++b) {
      const MappedTag* now_a = map.find(a->first);
      const MappedTag* now_b = map.find(b->first);
      const double before = (a->second.map_T_tag.translation() - b->second.map_T_tag.translation()).norm();
      if (now_a == nullptr || now_b == nullptr || before <= 0) continue;
      ratios.push_back((now_a->map_T_tag.translation() - now_b->map_T_tag.translation()).norm() / before);
    }
  }
  if (ratios.size() < kMinRatios) return std::nullopt;
  std::ranges::sort(ratios);
  const double median = ratios[ratios.size() / 2];
  const double spread = ratios[3 * ratios.size() / 4] - ratios[ratios.size() / 4];
  if (spread > kMaxSpread * median || std::abs(median - 1) < kMaxSpread) return std::nullopt;
  return median;
}

tl::unexpected<Error> no_agreement(const TagMap& map, const TagMap& prior) {
  const std::optional<double> times = times_as_large(map, prior);
  if (!times)
    return fail(ErrorCode::NotFound, "no two tags of the two maps agree on their alignment", {},
                "Check that both maps are of the same place.");
  return fail(
      ErrorCode::NotFound,
      fmt::format("all distances in the map are {:.2f} times those of the other map: the maps were made with "
                  "different tag sizes",
                  *times),
      {}, "Measure the side of a tag's black square.");
}

tl::unexpected<Error> another_place(int agreeing, std::ptrdiff_t common) {
  return fail(ErrorCode::NotFound,
              fmt::format("only {} of {} common tags agree on the alignment of the two maps: they are of "
                          "different places, or most tags were moved",
                          agreeing, common),
              {}, "Check that both maps are of the same place.");
}

}  // namespace

bool agree_by_chance(std::ptrdiff_t agreeing, std::ptrdiff_t common) {
  constexpr std::ptrdiff_t kMinCommon = 6;
  constexpr std::ptrdiff_t kMaxShare = 4;  // one of so many
  return common >= kMinCommon && kMaxShare * agreeing < common;
}

Result<MapComparison> compare_maps(const TagMap& map, const TagMap& prior,
                                   const MapComparisonOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  MapComparison comparison;
  for (const auto& [id, tag] : prior.tags) {
    const MappedTag* now = map.find(id);
    if (now == nullptr) continue;
    const SE3 proposal = refined(map, prior, now->map_T_tag * tag.map_T_tag.inverse(), options);
    const int count = agreeing(map, prior, proposal, options);
    if (count <= comparison.agreeing) continue;
    comparison.agreeing = count;
    comparison.map_T_prior = proposal;
  }
  if (comparison.agreeing < 2) return no_agreement(map, prior);
  const auto common =
      std::ranges::count_if(prior.tags, [&](const auto& tag) { return map.find(tag.first) != nullptr; });
  if (agree_by_chance(comparison.agreeing, common)) return another_place(comparison.agreeing, common);
  internal::compare_tags(map, prior, options, comparison);
  return comparison;
}

void internal::compare_tags(const TagMap& map, const TagMap& prior, const MapComparisonOptions& options,
                            MapComparison& comparison) {
  double squares = 0;
  int same = 0;
  for (const auto& [id, tag] : map.tags) {
    comparison.tags.push_back(compared_tag(id, tag, map, prior, comparison.map_T_prior, options));
    const ComparedTag& now = comparison.tags.back();
    if (now.change != TagChange::Same && now.change != TagChange::Resized) continue;
    squares += now.distance_m * now.distance_m;
    ++same;
  }
  comparison.rms_m = same > 0 ? std::sqrt(squares / same) : 0;
  for (const auto& [id, tag] : prior.tags) {
    if (map.find(id) == nullptr) comparison.tags.push_back({.tag = id, .change = TagChange::Missing});
  }
}

std::vector<std::string> describe(const MapComparison& comparison) {
  std::vector<std::string> warnings;
  for (const ComparedTag& tag : comparison.tags) {
    const std::string name = to_string(tag.tag);
    switch (tag.change) {
      case TagChange::Same:
        break;
      case TagChange::Moved:
        warnings.push_back(fmt::format(
            "{} differs by {:.2f} m and {:.0f} deg from its pose in the prior map: it was moved, or "
            "one of the maps is wrong",
            name, tag.distance_m, to_degrees(tag.turned_rad)));
        break;
      case TagChange::Swapped:
        if (tag.tag < *tag.with)
          warnings.push_back(
              fmt::format("{} and {} are swapped compared with the prior map", name, to_string(*tag.with)));
        break;
      case TagChange::Resized:
        warnings.push_back(name + " has a different size in the prior map");
        break;
      case TagChange::New:
        warnings.push_back(name + " is not in the prior map");
        break;
      case TagChange::Missing:
        warnings.push_back(name + " of the prior map was not observed");
        break;
    }
  }
  return warnings;
}

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

std::vector<Pair> agreeing_pairs(const std::vector<Pair>& pairs, const SE2& map_X_prior, double same_m) {
  std::vector<Pair> good;
  for (const Pair& pair : pairs) {
    if ((map_X_prior * pair.prior_p - pair.map_p).norm() < same_m) good.push_back(pair);
  }
  return good;
}

/// Least-squares rotation and translation (Umeyama, 1991; in the plane and without a scale).
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

/// A map in which all tags have the same rotation, so that only positions differ.
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
      const std::vector<Pair> good = agreeing_pairs(pairs, from_two(pairs[i], pairs[k]), options.same_m);
      if (good.size() > best.size()) best = good;
    }
  }
  if (best.size() < 3)
    return fail(ErrorCode::NotFound, "no three points of the two maps agree on their alignment", {},
                "Check that both maps are of the same place.");
  for (int i = 0; i < 3; ++i) best = agreeing_pairs(pairs, least_squares(best), options.same_m);
  MapComparison comparison{.map_T_prior = lift(least_squares(best)),
                           .agreeing = static_cast<int>(best.size())};
  internal::compare_tags(flat(map, comparison.map_T_prior.rotation()), points, options, comparison);
  return comparison;
}

}  // namespace waymark
