#include "waymark/app/video/video_scene.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/angles.hpp"

namespace waymark::internal {
namespace {

constexpr double kExact = 1e-6;  // for exact poses [m, rad]
constexpr double kOpen_m = 10;   // for poses that are determined by other measurements
constexpr double kOpen_rad = 0.25;

Status require_observed(const TagId& tag, const char* field, const std::map<TagId, int>& count) {
  if (count.contains(tag)) return {};
  return fail(ErrorCode::NotFound, to_string(tag) + " was not observed", {.key = field},
              "`waymark detect` lists the tags in a video.");
}

/// Standard deviations of a pose prior: position perpendicular to the map's z axis and along it, and rotation
/// about horizontal axes and about z.
struct PriorSigmas {
  double level_m = kExact, height_m = kExact;
  double tilt_rad = kExact, yaw_rad = kExact;
};

ScenePrior pose_prior(const SE3& map_T_tag, const PriorSigmas& sigmas) {
  const Eigen::Vector3d up = map_T_tag.rotation().inverse() * Eigen::Vector3d::UnitZ();
  const Eigen::Matrix3d along = up * up.transpose();
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - along;
  ScenePrior prior{.mean = map_T_tag};
  prior.sqrt_information.setZero();
  prior.sqrt_information.topLeftCorner<3, 3>() = across / sigmas.level_m + along / sigmas.height_m;
  prior.sqrt_information.bottomRightCorner<3, 3>() = across / sigmas.tilt_rad + along / sigmas.yaw_rad;
  return prior;
}

/// Prior for a tag in an older map: its pose in that map, with its covariance plus the given variances.
ScenePrior prior_of_mapped_tag(const MapVideoJob& job, const MappedTag& tag) {
  Matrix6 P = Matrix6::Zero();
  if (tag.covariance) {
    const Matrix6 Ad = tag.map_T_tag.inverse().adjoint();
    P = Ad * *tag.covariance * Ad.transpose();
  }
  const double usual_rad = job.prior_sigma_m ? to_radians(MapVideoJob::kUsualPriorSigma_deg) : kExact;
  const double sigma_rad = job.prior_sigma_deg ? to_radians(*job.prior_sigma_deg) : usual_rad;
  P.diagonal().head<3>().array() += std::pow(job.prior_sigma_m.value_or(kExact), 2);
  P.diagonal().tail<3>().array() += std::pow(sigma_rad, 2);
  return {.mean = tag.map_T_tag, .sqrt_information = whitening_of(P)};
}

/// Prior for a single anchor. It is exact, except for tilt or height if upright or floor tags determine them.
PriorSigmas single_anchor_sigmas(const MapVideoJob& job) {
  PriorSigmas sigmas;
  if (!job.upright.empty() || !job.floor.empty()) sigmas.tilt_rad = kOpen_rad;
  if (!job.floor.empty()) sigmas.height_m = kOpen_m;
  return sigmas;
}

/// The tag with the most observations (among those in the prior map, if any).
TagId most_observed(const MapVideoJob& job, const std::map<TagId, int>& count) {
  TagId tag;
  int most = 0;
  for (const bool known : {true, false}) {
    for (const auto& [id, seen] : count) {
      if (seen <= most || (known && job.prior.find(id) == nullptr)) continue;
      most = seen;
      tag = id;
    }
    if (most > 0) break;
  }
  return tag;
}

Result<VideoAnchors> several_anchors(const MapVideoJob& job, const std::vector<TagId>& tags,
                                     const std::map<TagId, int>& count) {
  VideoAnchors anchors;
  int most = 0;
  for (const TagId& tag : tags) {
    const MappedTag* known = job.prior.find(tag);
    if (known == nullptr)
      return fail(ErrorCode::NotFound, "the pose of " + to_string(tag) + " is unknown", {.key = "anchor"},
                  "If several anchors are given, each needs a pose in the map given by `prior`.");
    anchors.tags[tag] = prior_of_mapped_tag(job, *known);
    if (!job.prior_sigma_m && !job.prior_sigma_deg && !known->covariance) anchors.exact.insert(tag);
    if (count.at(tag) > most) anchors.first = tag;
    most = std::max(most, count.at(tag));
  }
  return anchors;
}

Status add_measurements(const MapVideoJob& job, const std::map<TagId, int>& count, TagScene& scene) {
  const double level_rad = to_radians(job.level_sigma_deg.value_or(MapVideoJob::kUsualLevelSigma_deg));
  const auto add_directions = [&](const std::vector<TagId>& tags, const char* field,
                                  const Eigen::Vector3d& axis) -> Status {
    for (const TagId& tag : tags) {
      if (Status seen = require_observed(tag, field, count); !seen) return seen;
      scene.directions.push_back({tag.number, {axis, Eigen::Vector3d::UnitZ(), level_rad}});
    }
    return {};
  };
  if (Status seen = add_directions(job.upright, "upright", Eigen::Vector3d::UnitY()); !seen) return seen;
  if (Status seen = add_directions(job.floor, "floor", Eigen::Vector3d::UnitZ()); !seen) return seen;
  for (const TagId& tag : job.floor)
    scene.coordinates.push_back({.tag = tag.number, .sigma_m = MapVideoJob::kFlat_m});
  for (const MeasuredDistance& d : job.distances) {
    for (const TagId& tag : {d.a, d.b})
      if (Status seen = require_observed(tag, "distance", count); !seen) return seen;
    scene.distances.push_back({.tag_a = d.a.number,
                               .tag_b = d.b.number,
                               .corner_a = -1,
                               .corner_b = -1,
                               .measured_m = d.measured_m,
                               .sigma_m = d.sigma_m});
  }
  for (const std::vector<TagId>& tags : job.planes) {
    ScenePlane plane{.sigma_m = MapVideoJob::kFlat_m, .sigma_rad = level_rad};
    for (const TagId& tag : tags) {
      if (Status seen = require_observed(tag, "plane", count); !seen) return seen;
      plane.tags.push_back(tag.number);
    }
    scene.planes.push_back(std::move(plane));
  }
  return {};
}

}  // namespace

Result<VideoAnchors> video_anchors(const MapVideoJob& job, const std::map<TagId, int>& count) {
  for (const TagId& tag : job.anchors)
    if (Status seen = require_observed(tag, "anchor", count); !seen) return tl::unexpected(seen.error());
  std::vector<TagId> tags = job.anchors;
  if (tags.empty() && (job.prior_sigma_m || job.prior_sigma_deg)) {
    for (const auto& [tag, seen] : count)
      if (job.prior.find(tag) != nullptr) tags.push_back(tag);
    if (tags.empty())
      return fail(ErrorCode::NotFound, "no tag of the older map was observed", {.key = "prior"},
                  "`waymark detect` lists the tags in a video.");
  }
  if (tags.size() > 1 || (!tags.empty() && (job.prior_sigma_m || job.prior_sigma_deg)))
    return several_anchors(job, tags, count);
  VideoAnchors anchors{.first = tags.empty() ? most_observed(job, count) : tags.front()};
  const MappedTag* known = job.prior.find(anchors.first);
  anchors.assumed = !job.map_T_anchor && known == nullptr;
  const SE3 map_T_tag = job.map_T_anchor   ? *job.map_T_anchor
                        : known != nullptr ? known->map_T_tag
                                           : anchor_at_origin();
  const PriorSigmas sigmas = single_anchor_sigmas(job);
  anchors.tags[anchors.first] = pose_prior(map_T_tag, sigmas);
  if (sigmas.tilt_rad == kExact) anchors.exact.insert(anchors.first);
  return anchors;
}

Result<TagScene> video_scene(const MapVideoJob& job, const std::map<TagId, int>& count,
                             const VideoAnchors& anchors) {
  TagScene scene;
  scene.bodies.push_back({.name = "map", .map_T_body = pose_prior(SE3(), {})});
  scene.bodies.push_back({.name = "hand", .is_static = false});
  scene.cameras.push_back({.name = "camera",
                           .model = *job.camera,
                           .body = kHand,
                           .body_T_cam = pose_prior(SE3(), {}),
                           .readout_s = job.readout_s,
                           .intrinsics_sigma = job.intrinsics_sigma});
  for (const auto& [tag, seen] : count) {
    const Result<double> size_m = job.sizes.size_m(tag);
    if (!size_m) return tl::unexpected(size_m.error());
    const auto anchor = anchors.tags.find(tag);
    if (anchor != anchors.tags.end())
      scene.bodies[kWalls].tags.push_back({.id = tag, .size_m = *size_m, .body_T_tag = anchor->second});
    else if (*size_m != job.sizes.default_size_m)
      scene.bodies[kWalls].tags.push_back({.id = tag, .size_m = *size_m});
  }
  scene.bodies[kWalls].default_tag_size_m = job.sizes.default_size_m.value_or(0);
  scene.default_body = kWalls;
  if (Status sound = add_measurements(job, count, scene); !sound) return tl::unexpected(sound.error());
  return scene;
}

}  // namespace waymark::internal
