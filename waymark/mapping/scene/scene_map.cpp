#include "waymark/mapping/scene/scene_map.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "waymark/mapping/scene/misread_ids.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/odometry_checks.hpp"
#include "waymark/mapping/scene/scene_calibration.hpp"
#include "waymark/mapping/scene/scene_contradictions.hpp"
#include "waymark/mapping/scene/scene_duplicates.hpp"
#include "waymark/mapping/scene/scene_report.hpp"
#include "waymark/mapping/scene/scene_search.hpp"
#include "waymark/mapping/scene/tag_identity.hpp"
#include "waymark/mapping/solver/map_search.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

namespace waymark {
namespace {

using internal::SceneSearch;

/// Whether odometry may be the cause of errors, after a search that trusts it.
bool is_odometry_in_question(const SceneSearch& search) {
  return search.noise_px() > SceneSearch::kStartPx ||
         contradicts_odometry(search.map(), search.options().search.outlier_chi2);
}

/// Searches again from `start` with a robust loss for odometry, and keeps the more probable result.
/// `more_cost_of_trusted`: of what only the present map assumes. Returns whether the map has changed.
bool judge_odometry_by_search(SceneSearch& search, const Bundle& start, double more_cost_of_trusted = 0) {
  SceneMap& map = search.map();
  const SceneSearch::State trusted = search.state();
  const auto go_to_trusted = [&] {
    search.go_to(trusted);
    map.odometry_ratio = 1;
  };
  search.bundle() = start;
  judge_odometry(map);
  search.search_from_placed();
  restore_contradicted_frames(map);
  search.adjust_until_stable();
  if (map.summary.stopped) return true;
  if (!search.goes_on()) {
    go_to_trusted();
    return false;
  }
  const double noise_px = std::min(search.noise_px(), trusted.noise_px);
  const double ratio = map.odometry_ratio;
  const auto cost_now = [&](bool trusts) {
    return cost_of_explanation(map, {noise_px / search.noise_px(), ratio / map.odometry_ratio,
                                     search.options().search.outlier_chi2, trusts});
  };
  const double by_judging = cost_now(false);
  SceneSearch::State judged = search.state();
  go_to_trusted();
  if (cost_now(true) + more_cost_of_trusted <= by_judging) return false;
  search.go_to(std::move(judged));
  map.odometry_ratio = ratio;
  return true;
}

/// Whether wrong odometry may have displaced all of these tags.
bool may_be_displaced(const SceneMap& map, const std::vector<IdPlaces>& duplicates) {
  return !duplicates.empty() &&
         std::ranges::none_of(duplicates, [&](const IdPlaces& id) { return are_proven_two(map, id); });
}

/// Judges odometry if it contradicts the observations, or if it may have displaced the second tags of all
/// duplicates. `start`: the bundle before the search.
void judge_odometry_and_duplicates(SceneSearch& search, const Bundle& start,
                                   std::vector<IdPlaces>& duplicates) {
  const bool displaced = may_be_displaced(search.map(), duplicates);
  if (!search.goes_on() || (!displaced && !is_odometry_in_question(search))) return;
  search.trust_odometry(true);
  search.adjust_until_stable();
  search.trust_odometry(false);
  if (!search.goes_on()) return;
  if (displaced) {
    Bundle joined = start;
    internal::join_places(duplicates, joined);
    const double more_cost =
        internal::cost_of_duplicates(search.map(), duplicates, search.options().search.outlier_chi2);
    if (judge_odometry_by_search(search, joined, more_cost)) {
      duplicates.clear();
      return;
    }
  }
  if (is_odometry_in_question(search)) judge_odometry_by_search(search, start);
}

/// Places all poses and minimises the robust cost. Trusts odometry first, because it refutes misread ids.
/// Judges it if it then contradicts the observations. Returns the ids of duplicate tags.
std::vector<IdPlaces> search_coarsely(SceneSearch& search) {
  const bool waymark = search.options().model == SceneModel::Waymark;
  std::vector<IdPlaces> ids = waymark ? internal::ids_at_several_places(search) : std::vector<IdPlaces>();
  Bundle start = search.judges_odometry() || !ids.empty() ? search.bundle() : Bundle();
  search.search_from_placed();
  std::vector<IdPlaces> duplicates = internal::separate_duplicates(search, std::move(ids), start);
  if (search.judges_odometry()) judge_odometry_and_duplicates(search, start, duplicates);
  return duplicates;
}

/// Minimises TagSLAM's cost over all observations.
void minimise_tagslam_cost(SceneSearch& search) {
  SceneMap& map = search.map();
  search.set_corner_noise(map.scene.pixel_sigma_px);
  for (CornerTerm& term : map.problem.bundle.corners) term.used = map.is_placed(term);
  add_wiggle(map.scene, map.observations, map.problem);
  map.placed.resize(map.problem.bundle.poses.size(), 1);
  search.find(0, search.options().search.max_iterations, "adjusting");
}

void estimate_odometry_noise(SceneSearch& search) {
  constexpr double kSmallChange = 0.05;
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds && search.goes_on() && search.judges_odometry(); ++round) {
    const double factor = multiply_odometry_noise(search.map(), odometry_ratio(search.map()));
    if (std::abs(factor - 1) < kSmallChange) break;
    search.adjust_until_stable();
  }
}

/// Distances are used only from here on, because those of a moved tag apply to its earlier pose, which is
/// known only now.
void use_distances(SceneSearch& search, const std::vector<SeparatedTag>& moves,
                   const std::vector<PointDistanceTerm>& distances) {
  const SceneMap& map = search.map();
  std::vector<PointDistanceTerm>& used = search.bundle().point_distances;
  const auto in_map = [&](const BundlePoint& p) { return map.placed[p.tag] != 0 && map.placed[p.body] != 0; };
  for (PointDistanceTerm term : distances) {
    for (const SeparatedTag& tag : moves) {
      term.a.tag = term.a.tag == tag.later ? tag.earlier : term.a.tag;
      term.b.tag = term.b.tag == tag.later ? tag.earlier : term.b.tag;
    }
    if (in_map(term.a) && in_map(term.b)) used.push_back(term);
  }
  if (used.empty() || !search.goes_on()) return;
  search.find(0, search.options().search.max_iterations, "estimating the tag size");
  search.gate_observations();
}

/// Estimates the parameters of cameras that are asked for or given with a standard deviation.
void estimate_intrinsics(SceneSearch& search) {
  const bool all = search.options().free_intrinsics;
  const bool given = std::ranges::any_of(search.map().scene.cameras, [](const CameraOnBody& camera) {
    return camera.intrinsics_sigma.size() > 0;
  });
  if (!all && !given) return;
  free_intrinsics(search.map(), all);
  search.adjust_until_stable();
  search.count_correlated();
}

/// Estimates the corner noise and other free parameters from the observations, and explains contradictions.
void adjust_with_estimated_noise(SceneSearch& search, std::vector<IdPlaces> duplicates,
                                 const std::vector<PointDistanceTerm>& distances) {
  SceneMap& map = search.map();
  search.forget_squares();
  search.adjust_until_stable();
  estimate_odometry_noise(search);
  internal::join_unproven(search, duplicates);
  const std::vector<SeparatedTag> moves = internal::explain_contradictions(search, duplicates);
  estimate_odometry_noise(search);
  if (search.goes_on() && correct_misread_ids(map, search.options().search.outlier_chi2) > 0)
    search.adjust_until_stable();
  add_planes(map.scene, map.problem, map.placed);
  search.count_correlated();
  estimate_intrinsics(search);
  use_distances(search, moves, distances);
  search.find(0, search.options().search.max_iterations, "adjusting");
  const ObservationTimes times = times_of(search.recording(), map.observations);
  for (const SeparatedTag& tag : moves) {
    const MovedTag moved = describe_move(map, times, tag);
    if (is_far(moved)) map.moved_tags.push_back(moved);
  }
  internal::list_duplicates(duplicates, map);
}

/// The standard deviation of the error that all printed sizes share, relative to the sizes.
double common_size_sigma(const TagScene& scene, const SearchOptions& options) {
  constexpr double kUsual_percent = 0.5;
  return options.common_tag_size_sigma_percent.value_or(scene.distances.empty() ? 0 : kUsual_percent) / 100;
}

/// Fails if the map contains a single tag, although others were observed: no image contains two of them.
Status check_several_tags(const SceneMap& map) {
  std::set<PoseIndex> observed;
  std::set<PoseIndex> placed;
  for (const SceneObservation& seen : map.observations.seen) {
    const PoseIndex tag = map.problem.tags[seen.body][seen.tag];
    observed.insert(tag);
    if (map.placed[tag] != 0) placed.insert(tag);
  }
  if (placed.size() > 1 || map.unconnected.empty() || !map.left_out_cuts.empty()) return {};
  return fail(ErrorCode::NotFound,
              fmt::format("only one of {} observed tags can be mapped: no image contains two of them, and no "
                          "odometry connects them",
                          observed.size()),
              {}, "Record images that contain two tags each, or give the poses of more tags.");
}

/// Excludes unlisted tags with few observations, because a wrong id usually occurs only once.
void drop_rare_unlisted_tags(const TagScene& listed, const SceneMapOptions& options, SceneMap& map) {
  std::map<std::pair<std::size_t, std::size_t>, int> count;
  for (const SceneObservation& seen : map.observations.seen) ++count[{seen.body, seen.tag}];
  const auto rare_and_unlisted = [&](const SceneObservation& seen) {
    const bool on_a_list = seen.tag < listed.bodies[seen.body].tags.size();
    return !on_a_list && count[{seen.body, seen.tag}] < options.min_observations;
  };
  std::set<TagId> ids;
  for (const SceneObservation& seen : map.observations.seen) {
    if (rare_and_unlisted(seen)) ids.insert(map.scene.bodies[seen.body].tags[seen.tag].id);
  }
  std::erase_if(map.observations.seen, rare_and_unlisted);
  map.rejected_tags.assign(ids.begin(), ids.end());
}

}  // namespace

bool SceneMap::is_placed(const CornerTerm& term) const {
  return placed[term.rig] != 0 && placed[term.cam] != 0 && placed[term.body] != 0 && placed[term.tag] != 0;
}

std::optional<SE3> SceneMap::map_T_tag(std::size_t body, std::size_t tag) const {
  const PoseIndex of_tag = problem.tags[body][tag];
  if (!scene.bodies[body].is_static || placed[of_tag] == 0 || placed[problem.bodies[body].front()] == 0)
    return std::nullopt;
  return problem.bundle.poses[problem.bodies[body].front()].value * problem.bundle.poses[of_tag].value;
}

Result<SceneMap> map_scene(const TagScene& scene, const SceneRecording& recording,
                           const SceneMapOptions& options, const MapProgress& progress) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  if (options.free_intrinsics && options.model == SceneModel::Tagslam)
    return fail(ErrorCode::InvalidArgument, "the model `tagslam` cannot estimate camera parameters",
                {.key = "free_intrinsics"}, "Omit `free_intrinsics`, or use the model `waymark`.");
  SceneMap map{.scene = scene};
  map.observations = observations_of(
      recording, map.scene, options.model == SceneModel::Waymark ? RepeatedIds::All : RepeatedIds::First);
  if (options.model == SceneModel::Waymark) drop_rare_unlisted_tags(scene, options, map);
  if (map.observations.seen.empty())
    return fail(ErrorCode::NotFound, "no tag of this scene was observed", {},
                "Check that the camera topics and tag ids match the recording.");
  Result<SceneBundle> problem = scene_bundle(map.scene, recording, map.observations);
  if (!problem) return tl::unexpected(problem.error());
  map.problem = std::move(*problem);
  if (options.model == SceneModel::Waymark) {
    map.size_spread = map.assumed_size_spread = options.search.tag_size_sigma_percent / 100;
    for (BundleSize& size : map.problem.bundle.sizes) size.sigma = map.assumed_size_spread;
    map.size_prior_sigma = common_size_sigma(scene, options.search);
    map.problem.bundle.common_size.sigma = map.size_prior_sigma;
  }
  std::vector<PointDistanceTerm> distances;  // until use_distances()
  if (options.model == SceneModel::Waymark) std::swap(distances, map.problem.bundle.point_distances);
  SceneSearch search(recording, options, progress, map);
  std::vector<IdPlaces> duplicates = search_coarsely(search);
  if (map.summary.stopped) return internal::stopped_on_request();
  if (std::ranges::none_of(map.problem.bundle.corners, &CornerTerm::used))
    return fail(ErrorCode::NotFound, "no observed tag is connected to the map", {},
                "Give the pose of one of the tags, or of the body it is on.");
  if (options.model == SceneModel::Tagslam)
    minimise_tagslam_cost(search);
  else
    adjust_with_estimated_noise(search, std::move(duplicates), distances);
  if (map.summary.stopped) return internal::stopped_on_request();
  if (!map.summary.usable()) return fail(ErrorCode::InvalidArgument, "mapping failed: " + map.summary.why);
  map.noise_px = search.noise_px();
  search.forget_factor();
  map.cost = cost(map.problem.bundle);
  report_scene(recording, map);
  if (Status several = check_several_tags(map); !several) return tl::unexpected(several.error());
  return map;
}

}  // namespace waymark
