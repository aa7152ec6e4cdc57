#include "waymark/pipeline/pose_lap_mapper.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

std::vector<PointFrame> as_points(const PoseLap& lap) {
  std::vector<PointFrame> frames;
  for (const TagPoseFrame& frame : lap.frames) {
    PointFrame points{.stamp = frame.stamp};
    for (const SeenTagPose& seen : frame.tags) {
      const Eigen::Vector3d base_p = lap.base_T_cam * seen.cam_T_tag.translation();
      points.points.push_back({seen.tag, base_p.head<2>()});
    }
    frames.push_back(std::move(points));
  }
  return frames;
}

/// Where observations near its place have a tag, in space.
std::map<TagId, std::vector<SE3>> placed_observations(const PoseLap& lap, const LandmarkMap& points) {
  constexpr double kNear = 0.15;
  std::map<TagId, std::vector<SE3>> placed;
  for (std::size_t i = 0; i < points.frames.size(); ++i) {
    const SE3 map_T_cam = lift(points.map_X_base[i] * points.base_X_assumed) * lap.base_T_cam;
    for (const SeenTagPose& seen : lap.frames[points.frames[i]].tags) {
      const auto at = points.points.find(seen.tag);
      if (at == points.points.end()) continue;
      const SE3 map_T_tag = map_T_cam * seen.cam_T_tag;
      const bool near = (map_T_tag.translation().head<2>() - at->second.map_p).norm() < kNear;
      if (near) placed[seen.tag].push_back(map_T_tag);
    }
  }
  return placed;
}

struct Stance {
  SO3 map_R_tag{};
  double z_m = 0;
  double rotation_sigma_rad = 0.5;
  double z_sigma_m = 0.05;
};

/// Height by the median; direction by the observation with the most others near it, and their mean: a square
/// seen face to face shows one of two poses, so that no mean of all means anything.
Stance stance_of(const std::vector<SE3>& observations) {
  constexpr double kAgree = 0.35;
  constexpr std::size_t kMost = 200;
  std::vector<SE3> some;
  const std::size_t stride = observations.size() / kMost + 1;
  for (std::size_t i = 0; i < observations.size(); i += stride) some.push_back(observations[i]);
  std::vector<double> z;
  Stance stance;
  std::ptrdiff_t most = 0;
  for (const SE3& candidate : some) {
    z.push_back(candidate.translation().z());
    const auto agreeing = std::ranges::count_if(some, [&](const SE3& other) {
      return (candidate.rotation().inverse() * other.rotation()).angle() < kAgree;
    });
    if (agreeing > most) stance.map_R_tag = candidate.rotation();
    most = std::max(most, agreeing);
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const SE3& other : some) {
    const Eigen::Vector3d off = (other.rotation() * stance.map_R_tag.inverse()).log();
    if (off.norm() >= kAgree) continue;
    mean += off / static_cast<double>(most);
    squares += off.squaredNorm() / static_cast<double>(most);
  }
  stance.map_R_tag = SO3::exp(mean) * stance.map_R_tag;
  stance.z_m = median(std::move(z));
  // Observations of one drive share their errors: their scatter, not the error of its mean.
  stance.rotation_sigma_rad = std::max(0.02, std::sqrt(squares));
  return stance;
}

/// Tags in the middle of larger ones: seen less often, in the same place.
std::map<TagId, TagId> nested(const LandmarkMap& points) {
  constexpr double kSamePlace = 0.03;
  std::map<TagId, TagId> inner;
  for (const auto& [id, point] : points.points) {
    for (const auto& [other, outer] : points.points) {
      const bool same = !(id == other) && (point.map_p - outer.map_p).norm() < kSamePlace;
      if (same && std::pair(point.observations, other) < std::pair(outer.observations, id))
        inner.emplace(id, other);
    }
  }
  return inner;
}

Matrix6 tag_covariance(const SE3& map_T_tag, const MappedPoint& point, const Stance& stance) {
  Matrix6 P = Matrix6::Zero();
  P.topLeftCorner<2, 2>() = point.covariance;
  P(2, 2) = stance.z_sigma_m * stance.z_sigma_m;
  P.bottomRightCorner<3, 3>() =
      Eigen::Matrix3d::Identity() * (stance.rotation_sigma_rad * stance.rotation_sigma_rad);
  return from_coordinate_covariance(map_T_tag, P).covariance;
}

void say(const LandmarkMap& points, const std::map<TagId, TagId>& inner, std::vector<std::string>& words) {
  const auto names = [](const auto& ids) {
    std::vector<std::string> list;
    list.reserve(ids.size());
    for (const TagId& id : ids) list.push_back(to_string(id));
    return fmt::format("{}", fmt::join(list, ", "));
  };
  if (!points.hardly_seen.empty())
    words.push_back(names(points.hardly_seen) + ": seen too rarely while the robot moved, not in the map");
  std::vector<TagId> inside;
  inside.reserve(inner.size());
  for (const auto& [id, outer] : inner) inside.push_back(id);
  if (!inside.empty())
    words.push_back(names(inside) + ": in the middle of other tags, no places of their own, not in the map");
  for (const auto& [id, point] : points.points) {
    if (point.rejected > point.observations)
      words.push_back(
          fmt::format("{} of {} observations of {} contradict the others: it was moved, or two tags "
                      "carry this id",
                      point.rejected, point.rejected + point.observations, to_string(id)));
  }
  const SE2& m = points.base_X_assumed;
  constexpr double kWorthSaying_m = 0.01;
  if (m.translation().norm() > kWorthSaying_m)
    words.push_back(fmt::format(
        "the camera seems to sit {:.0f} mm forward, {:.0f} mm to the left of and turned {:.1f} deg from "
        "where it "
        "is assumed (+- {:.0f} mm, {:.0f} mm, {:.1f} deg): taken into account",
        1000 * m.x(), 1000 * m.y(), to_degrees(m.yaw()), 1000 * points.mounting_sigma.x(),
        1000 * points.mounting_sigma.y(), to_degrees(points.mounting_sigma.z())));
}

void read_tags(const PoseLap& lap, const LandmarkMap& points, const std::map<TagId, TagId>& inner,
               MappedPoseLap& result) {
  constexpr double kUnknownSize_m = 0.1;
  double best = INFINITY;
  const auto placed = placed_observations(lap, points);
  for (const auto& [id, point] : points.points) {
    const auto observations = placed.find(id);
    if (inner.contains(id) || observations == placed.end()) continue;
    const Stance stance = stance_of(observations->second);
    const SE3 map_T_tag(stance.map_R_tag, {point.map_p.x(), point.map_p.y(), stance.z_m});
    result.lap.map.tags[id] = {map_T_tag, lap.sizes.size_m(id).value_or(kUnknownSize_m),
                               tag_covariance(map_T_tag, point, stance)};
    result.lap.observations[id] = point.observations;
    if (point.covariance.trace() < best) result.anchor = id;
    best = std::min(best, point.covariance.trace());
  }
}

}  // namespace

Result<MappedPoseLap> map_pose_lap(const PoseLap& lap, const MapPosesOptions& options) {
  const Result<LandmarkMap> points = map_landmarks(as_points(lap), lap.odometry, options.points);
  if (!points) return tl::unexpected(points.error());
  MappedPoseLap result;
  const std::map<TagId, TagId> inner = nested(*points);
  read_tags(lap, *points, inner, result);
  if (!lap.sizes.default_size_m)
    result.lap.warnings.emplace_back(
        "the recording does not say how large its tags are, and poses do not need it: map.yaml says 0.1 m "
        "(--tag-size-m says better)");
  say(*points, inner, result.lap.warnings);
  for (std::size_t i = 0; i < points->frames.size(); ++i) {
    result.lap.trajectory.push_back({lap.frames[points->frames[i]].stamp, lift(points->map_X_base[i])});
    Matrix6 P = Matrix6::Zero();
    constexpr std::array<int, 3> kPlane = {0, 1, 5};
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c)
        P(kPlane[static_cast<std::size_t>(r)], kPlane[static_cast<std::size_t>(c)]) =
            points->base_covariance[i](r, c);
    }
    result.lap.trajectory_covariance.push_back(P);
  }
  Result<BuiltRoute> route = build_route(result.lap.trajectory, options.route);
  if (!route) return tl::unexpected(route.error());
  result.lap.route_repeated_m = route->repeated_m;
  result.lap.route = std::move(*route);
  result.lap.frames = static_cast<int>(points->frames.size());
  if (!result.lap.route.closed)
    result.lap.warnings.emplace_back(
        "the lap does not come back to its start: the route is open, driven once");
  result.figures = {points->scales, points->scales_sigma, points->base_X_assumed, points->mounting_sigma,
                    points->rms_m};
  return result;
}

}  // namespace waymark
