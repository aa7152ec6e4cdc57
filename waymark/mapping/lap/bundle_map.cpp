#include "waymark/mapping/lap/bundle_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "waymark/mapping/lap/lap_contradictions.hpp"
#include "waymark/mapping/lap/lost_poses.hpp"
#include "waymark/mapping/lap/map_checks.hpp"
#include "waymark/mapping/lap/missing_lap_tags.hpp"
#include "waymark/mapping/lap/mounting.hpp"
#include "waymark/mapping/lap/noise.hpp"
#include "waymark/mapping/lap/prior_map.hpp"
#include "waymark/mapping/lap/rough_odometry.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"
#include "waymark/mapping/lap/wrong_ids.hpp"
#include "waymark/mapping/solver/image_region.hpp"
#include "waymark/mapping/solver/map_search.hpp"

namespace waymark {
namespace {

constexpr int kRounds = 4;

/// Selects the observations to use by their errors at the current poses. Returns whether the selection
/// changed.
bool gate_observations(Bundle& bundle, double gate) {
  const std::vector<double> chi2 = corner_chi2(bundle);
  bool changed = false;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    const bool used = chi2[i] < gate;
    changed = changed || used != bundle.corners[i].used;
    bundle.corners[i].used = used;
  }
  return changed;
}

/// The redundancy of the corner terms if sizes are exact. Each size is only one of the many unknowns that the
/// observations of a tag determine, but it correlates the poses that redundancy_of() regards as independent.
std::vector<double> redundancy_of_corners(LapBundle& lap) {
  const std::vector<BundleSize> sizes = lap.bundle.sizes;
  const BundleSize common_size = lap.bundle.common_size;
  for (BundleSize& size : lap.bundle.sizes) size.sigma = 0;
  lap.bundle.common_size.sigma = 0;
  std::vector<double> redundancy = internal::redundancy_of(lap);
  lap.bundle.sizes = sizes;
  lap.bundle.common_size = common_size;
  return redundancy;
}

/// Repeats noise estimation and outlier rejection until neither result changes.
void adjust_until_stable(LapBundle& lap, const BundleMapOptions& options, const BundleProgress& progress,
                         BundleMap& result) {
  const BundleOptions search{.max_iterations = options.search.max_iterations};
  std::vector<double> redundancy;  // nearly constant from round to round
  for (int round = 0; round < kRounds && result.summary.usable(); ++round) {
    if (options.estimate_noise) {
      if (redundancy.empty()) redundancy = redundancy_of_corners(lap);
      std::vector<double> chi2 = corner_chi2(lap.bundle);
      for (double& x : chi2) x *= result.correlated_frames;
      const double ratio = internal::noise_ratio(chi2, redundancy);
      internal::scale_noise(lap.bundle, ratio);
      result.noise_ratio *= ratio;
    }
    const bool changed =
        gate_observations(lap.bundle, options.search.outlier_chi2 / result.correlated_frames);
    if (!changed && round > 0) break;
    result.summary = solve(lap.bundle, search, progress);
  }
}

/// Reports the progress of one stage of the search.
BundleProgress progress_of(const MapProgress& progress, const char* name) {
  return [&progress, name](int iteration, double cost) { return progress(name, iteration, cost); };
}

/// Gives observations the weight that corner errors of a tag which persist from image to image leave them.
void weigh_images(double correlated_frames, LapBundle& lap, BundleMap& result) {
  internal::scale_noise(lap.bundle, std::sqrt(correlated_frames / result.correlated_frames));
  result.correlated_frames = correlated_frames;
}

/// Estimates the spread of printed sizes, and finds the sizes that the observations contradict and the tags
/// that were moved. Returns those sizes.
std::vector<std::size_t> find_contradictions(const LapInput& input, LapBundle& lap,
                                             const BundleMapOptions& options, const BundleProgress& progress,
                                             BundleMap& result) {
  constexpr double kRoughGain = 1e-4;
  if (!result.summary.usable()) return {};
  const auto find = [&](double robust_chi2) {
    if (!result.summary.usable()) return;
    result.summary = solve(lap.bundle, {options.search.max_iterations, kRoughGain, robust_chi2}, progress);
  };
  if (options.estimate_noise) weigh_images(internal::correlated_frames_of(lap), lap, result);
  const bool exact = !(result.assumed_size_spread > 0);
  if (exact && !internal::has_contradictions(input, lap)) {
    weigh_images(1, lap, result);
    return {};
  }
  if (result.correlated_frames > 1) find(0);
  const double outlier_chi2 = options.search.outlier_chi2 / result.correlated_frames;
  const ReleasedSizes sizes = internal::explain_contradictions(
      input, lap, result.assumed_size_spread,
      {.find = find,
       .adjust = [&] { adjust_until_stable(lap, options, progress, result); },
       .gate = [&] { gate_observations(lap.bundle, outlier_chi2); },
       .robust_chi2 = options.search.robust_chi2,
       .outlier_chi2 = outlier_chi2,
       .noise_ratio = result.noise_ratio,
       .summary = result.summary});
  result.size_spread = sizes.spread;
  lap.size_sigma = sizes.spread;
  weigh_images(1, lap, result);
  const BundleOptions search{.max_iterations = options.search.max_iterations};
  if (result.summary.usable()) result.summary = solve(lap.bundle, search, progress);
  return sizes.released;
}

/// Optimises until neither the set of observations in use nor the noise changes. Returns the sizes that the
/// observations contradict.
std::vector<std::size_t> optimise(const LapInput& input, LapBundle& lap, const BundleMapOptions& options,
                                  const MapProgress& progress, BundleMap& result) {
  constexpr double kRoughGain = 1e-5;  // sufficient to find outliers
  const BundleOptions search{options.search.max_iterations, kRoughGain, options.search.robust_chi2};
  const BundleProgress looking = progress_of(progress, "rejecting outliers");
  result.summary = solve(lap.bundle, search, looking);
  if (!result.summary.usable()) return {};
  const bool frames = internal::reinitialise_lost_frames(input, options, lap);
  const bool tags = internal::reinitialise_lost_tags(input, options, lap);
  if (internal::place_unconnected(input, options, lap, result.unconnected) || frames || tags)
    result.summary = solve(lap.bundle, search, looking);
  if (!result.summary.usable()) return {};
  internal::repair_trajectory_jumps(input, options, search, looking, lap, result.summary);
  adjust_until_stable(lap, options, progress_of(progress, "adjusting"), result);
  return find_contradictions(input, lap, options, progress_of(progress, "explaining contradictions"), result);
}

/// Aligns the lap with the prior map and adjusts the two together.
Result<internal::TiedPrior> extend(const LapInput& input, LapBundle& lap, const BundleMapOptions& options,
                                   const MapProgress& progress, BundleMap& result) {
  Result<internal::TiedPrior> tied =
      internal::tie_to_prior(*input.prior, input.anchor, covariance(lap.bundle), lap);
  if (!tied) return tied;
  const BundleProgress report_progress = progress_of(progress, "extending the map");
  const BundleOptions search{.max_iterations = options.search.max_iterations};
  result.summary = solve(lap.bundle, search, report_progress);
  while (result.summary.usable() && internal::revise_agreement(*input.prior, lap, *tied))
    result.summary = solve(lap.bundle, search, report_progress);
  adjust_until_stable(lap, options, report_progress, result);
  result.prior_warnings = tied->warnings;
  result.prior_agreeing = static_cast<int>(tied->agreeing.size());
  return tied;
}

/// Searches for contradictions again, with all tags as if none had been moved. Returns the released sizes.
std::vector<std::size_t> search_moves_again(const LapInput& input, LapBundle& lap,
                                            const BundleMapOptions& options, const BundleProgress& progress,
                                            BundleMap& result) {
  internal::join_moved_tags(lap);
  free_sizes(result.assumed_size_spread, result.size_prior_sigma, lap);
  adjust_until_stable(lap, options, progress, result);
  return find_contradictions(input, lap, options, progress, result);
}

/// Restores a bundle when it is destroyed, except for changes to the factors of corners. Copies of these
/// would need most of the memory, and a search does not change them.
class RestoredBundle {
 public:
  explicit RestoredBundle(Bundle& bundle) : bundle_(bundle) {
    std::vector<CornerTerm> corners = std::move(bundle.corners);
    bundle.corners.clear();
    rest_ = bundle;
    bundle.corners = std::move(corners);
    used_.reserve(bundle.corners.size());
    for (const CornerTerm& term : bundle.corners) used_.push_back(term.used ? 1 : 0);
  }
  ~RestoredBundle() {
    rest_.corners = std::move(bundle_.corners);
    bundle_ = std::move(rest_);
    for (std::size_t i = 0; i < used_.size(); ++i) bundle_.corners[i].used = used_[i] != 0;
  }
  RestoredBundle(const RestoredBundle&) = delete;
  RestoredBundle& operator=(const RestoredBundle&) = delete;

 private:
  Bundle& bundle_;
  Bundle rest_{};             ///< without corners
  std::vector<char> used_{};  ///< CornerTerm::used
};

/// Estimates the camera mounting, and then restores the problem. The estimate is adopted if it differs
/// significantly from the assumed one and held-out observations confirm it, or if no mounting was assumed.
/// The map and the mounting are then estimated together; parameters that the lap does not determine keep
/// their assumed values. With a wrong mounting, tags that are observed from two sides seem to have moved, so
/// moves are then searched for again. `released`: sizes that the observations contradict.
void consider_mounting(const LapInput& input, LapBundle& lap, const BundleMapOptions& options,
                       const MapProgress& progress, BundleMap& result, std::vector<std::size_t>& released) {
  const BundleProgress report_progress = progress_of(progress, "estimating the camera mounting");
  const int steps = options.search.max_iterations;
  const bool asked = options.find_mounting;
  const SE3 assumed = lap.bundle.poses[lap.cam].value;
  std::vector<OdometryTerm> odometry;  // with the estimated noise
  {
    const RestoredBundle restored(lap.bundle);
    const MountingAssumption first{.base_T_cam = assumed, .focal_share = options.focal_share};
    result.mounting = estimate_mounting(lap, steps, report_progress, first);
    if (!result.mounting) return;
    if (!asked) internal::keep_confirmed(lap, assumed, steps, report_progress, *result.mounting);
    if (!asked && (options.keep_mounting || !result.mounting->any_significant())) return;
    odometry = std::move(lap.bundle.odometry);
  }
  lap.bundle.odometry = std::move(odometry);
  result.mounting_used = true;
  MountingAssumption assumption{
      .base_T_cam = assumed, .off = result.mounting->off, .focal_share = options.focal_share};
  if (!asked) assumption.trusted = result.mounting->unobservable;
  result.mounting = estimate_mounting(lap, steps, report_progress, assumption);
  internal::find_odometry_noise(lap, steps, report_progress);
  adjust_until_stable(lap, options, report_progress, result);
  if (!lap.moves.empty() && !input.prior) {
    released = search_moves_again(input, lap, options, report_progress, result);
    result.mounting = estimate_mounting(lap, steps, report_progress, assumption);
    adjust_until_stable(lap, options, report_progress, result);
  }
  result.mounting = estimate_mounting(lap, steps, report_progress, assumption);
}

/// Reduces the weight of observations so that several images count as one.
void weigh_lasting_errors(LapBundle& lap, const BundleMapOptions& options, const BundleProgress& progress,
                          BundleMap& result) {
  if (!options.estimate_noise) return;
  weigh_images(internal::correlated_frames_of(lap), lap, result);
  result.summary = solve(lap.bundle, {.max_iterations = options.search.max_iterations}, progress);
}

/// Keeps the tags of the extended map that the lap did not observe.
void keep_unobserved_tags(const LapInput& input, const LapBundle& lap, const internal::TiedPrior& tied,
                          const BundleCovariance& P, BundleMap& result) {
  for (const auto& [id, before] : input.prior->map.tags) {
    if (result.map.find(id) != nullptr) continue;
    const PoseIndex pose = tied.before.at(id);
    MappedTag tag{.map_T_tag = lap.bundle.poses[pose].value, .size_m = before.size_m};
    if (!lap.bundle.poses[pose].fixed) tag.covariance = P.poses[pose];
    result.map.tags[id] = tag;
    result.observations[id] = 0;
    std::erase(result.unconnected, id);
  }
}

void list_wrong_sizes(const LapInput& input, const LapBundle& lap, const BundleCovariance& P,
                      const std::vector<std::size_t>& released, BundleMap& result) {
  const std::vector<SizeEstimate> estimates = size_estimates(lap.bundle, P);
  const double spread = std::max(result.size_spread, result.assumed_size_spread);
  for (const auto& [id, size] : lap.sizes) {
    if (std::ranges::find(released, size) == released.end()) continue;
    const auto wrong = wrong_size(id, *input.sizes.size_m(id), size, lap.bundle, estimates, spread);
    if (wrong) result.wrong_sizes.push_back(*wrong);
  }
}

void read_tags(const LapInput& input, const LapBundle& lap, const BundleCovariance& P,
               const ChainResult& start, BundleMap& result) {
  std::vector<int> observations(lap.bundle.poses.size(), 0);
  for (const CornerTerm& term : lap.bundle.corners) observations[term.tag] += term.used ? 1 : 0;
  for (const auto& [id, pose] : lap.tags) {
    if (observations[pose] == 0) {
      result.unconnected.push_back(id);
      continue;
    }
    const MappedTag* before = start.map.find(id);
    MappedTag tag{.map_T_tag = lap.bundle.poses[pose].value,
                  .size_m = result.size_scale * *input.sizes.size_m(id)};
    if (!lap.bundle.poses[pose].fixed) tag.covariance = P.poses[pose];
    if (before != nullptr)
      result.moved_m =
          std::max(result.moved_m, (tag.map_T_tag.translation() - before->map_T_tag.translation()).norm());
    result.map.tags[id] = tag;
    result.observations[id] = observations[pose];
  }
}

/// The floor as a plane in the map.
FloorPlane floor_of(const LapBundle& lap, const BundleCovariance& P) {
  const SE3& map_T_plane = lap.bundle.poses[lap.floor].value;
  FloorPlane floor{.normal = map_T_plane.rotation() * Eigen::Vector3d::UnitZ()};
  floor.z_m = floor.normal.dot(map_T_plane.translation()) / floor.normal.z();
  const Eigen::Matrix3d spread = P.poses[lap.floor].block<3, 3>(2, 2);  // z and the rotations about x and y
  floor.covariance = (spread + spread.transpose()) / 2;
  return floor;
}

/// Adds to the sums from which the means are computed later.
void add_to_regions(const Eigen::Matrix<double, 8, 1>& r, const CornerFactor& factor,
                    const CameraModel& camera, BundleMap& result) {
  for (Eigen::Index c = 0; c < 4; ++c) {
    const Eigen::Vector2d& at = factor.corners_px[static_cast<std::size_t>(c)];
    ResidualRegion& region = result.regions[internal::ninth_of(at, camera)];
    ++region.corners;
    region.mean_px += r.segment<2>(2 * c);
    region.rms_px += r.segment<2>(2 * c).squaredNorm();
  }
}

void read_observations(const LapInput& input, const LapBundle& lap, BundleMap& result) {
  const std::vector<double> chi2 = corner_chi2(lap.bundle);
  double squares = 0;
  int numbers = 0;
  for (std::size_t i = 0; i < lap.bundle.corners.size(); ++i) {
    const CornerTerm& term = lap.bundle.corners[i];
    if (!term.used) {
      const TagFrame& frame = input.frames[lap.observations[i].frame];
      result.rejected.push_back({frame.stamp, frame.detections[lap.observations[i].detection].tag,
                                 chi2[i] * result.correlated_frames});
      continue;
    }
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    const auto r = corner_residual(plain, lap.bundle.cameras[term.camera], poses_of(lap.bundle, term));
    if (r) squares += r->squaredNorm();
    if (r) add_to_regions(*r, term.factor, lap.bundle.cameras[term.camera], result);
    numbers += 8;
  }
  for (ResidualRegion& region : result.regions) {
    region.mean_px /= std::max(region.corners, 1);
    region.rms_px = std::sqrt(region.rms_px / std::max(region.corners, 1));
  }
  result.rms_px = numbers > 0 ? std::sqrt(squares / numbers) : 0;
}

/// Lists the parts of the map that depend on few observations. The anchor and the tags of an extended map are
/// not among them.
void list_thin_cuts(const LapInput& input, LapBundle& lap, const BundleCovariance& P, BundleMap& result) {
  std::vector<char> moves(lap.bundle.poses.size(), 0);
  for (const PoseIndex base : lap.base_poses()) moves[base] = 1;
  std::set<PoseIndex> roots;
  if (lap.anchor) roots.insert(*lap.anchor);
  std::map<PoseIndex, TagId> ids;
  for (const auto& [id, pose] : lap.tags) {
    ids[pose] = id;
    if (input.prior && input.prior->map.find(id) != nullptr) roots.insert(pose);
  }
  for (const SeparatedTag& moved : lap.moves) ids[moved.earlier] = ids.at(moved.later);
  const auto named = [&](const std::vector<PoseIndex>& poses) {
    std::set<TagId> tags;
    for (const PoseIndex pose : poses) tags.insert(ids.at(pose));
    return std::vector<TagId>(tags.begin(), tags.end());
  };
  for (const ThinCut& cut : unchecked_cuts(lap.bundle, P, moves, roots))
    result.thin_cuts.push_back({named(cut.beyond), named(cut.by), cut.observations, cut.otherwise_sigma_m});
}

/// Converts the scales to those of the odometry as recorded.
void scale_by(const internal::RoughOdometry& rough, OdometryScales& scales, OdometryScales& sigma) {
  for (OdometryScales* s : {&scales, &sigma}) {
    s->distance *= rough.distance;
    s->yaw *= rough.yaw;
    s->yaw_bias_rad_s /= rough.yaw;
  }
}

/// Estimates the noise in odometry turns, and also their scale if gyro turns replaced them.
void estimate_wheel_turns(const std::vector<Odometry>& odometry, BundleMap& result) {
  const Trajectory& trajectory = result.trajectory;
  const std::vector<Matrix6>& P = result.trajectory_covariance;
  const auto scale = result.turns_by_gyro ? turn_scale(trajectory, P, odometry) : std::nullopt;
  result.turn_noise = turn_noise(trajectory, P, odometry, scale.value_or(result.odometry_scales.yaw));
  if (scale && result.turn_noise) {
    result.odometry_scales.yaw = *scale;
    result.odometry_scales_sigma.yaw = result.turn_noise->scale_sigma;
    if (result.mounting) result.mounting->scales.yaw = *scale;
    if (result.mounting) result.mounting->scales_sigma.yaw = result.turn_noise->scale_sigma;
  }
  if (!result.mounting) return;
  double& sigma = result.mounting->scales_sigma.yaw;
  sigma = std::max(sigma, turn_scale_sigma(trajectory, P, odometry).value_or(0));
}

std::vector<ObservedFrame> observe_all(const LapInput& input) {
  std::vector<ObservedFrame> observed;
  observed.reserve(input.frames.size());
  for (const TagFrame& frame : input.frames) observed.push_back(observe(frame, input));
  return observed;
}

/// The unconfirmed observations; those of the anchor are included only if other observations of it remain.
std::vector<internal::ObservationIndex> unconfirmed_except_last_anchor(
    const LapInput& input, const std::vector<ObservedFrame>& observed) {
  std::vector<internal::ObservationIndex> unconfirmed = internal::unconfirmed_observations(input, observed);
  const auto is_anchor = [&](const TagDetection& seen) { return seen.tag == input.anchor; };
  std::ptrdiff_t left = 0;
  for (const TagFrame& frame : input.frames) left += std::ranges::count_if(frame.detections, is_anchor);
  const auto of_anchor = [&](const internal::ObservationIndex& index) {
    return is_anchor(input.frames[index.frame].detections[index.detection]);
  };
  if (left == std::ranges::count_if(unconfirmed, of_anchor)) std::erase_if(unconfirmed, of_anchor);
  return unconfirmed;
}

/// Recomputes the observed frames of these detections, as the lap contains them now.
void observe_again(const LapInput& input, const std::vector<internal::ObservationIndex>& of_frames,
                   std::vector<ObservedFrame>& observed) {
  std::optional<std::size_t> last;
  for (const internal::ObservationIndex& index : of_frames) {
    if (last != index.frame) observed[index.frame] = observe(input.frames[index.frame], input);
    last = index.frame;
  }
}

/// Odometry that replaces the given one in a lap until this object is destroyed, which restores it.
class ReplacedOdometry {
 public:
  ReplacedOdometry(LapInput& lap, internal::RoughOdometry& rough)
      : lap_(lap), odometry_(std::move(lap.odometry)), other_turns_(lap.other_turns) {
    lap_.odometry = std::move(rough.odometry);
    if (rough.turns_by_gyro) lap_.other_turns = rough.without_gyro;
  }
  ~ReplacedOdometry() {
    lap_.odometry = std::move(odometry_);
    lap_.other_turns = std::move(other_turns_);
  }
  ReplacedOdometry(const ReplacedOdometry&) = delete;
  ReplacedOdometry& operator=(const ReplacedOdometry&) = delete;

  [[nodiscard]] const std::vector<Odometry>& given() const { return odometry_; }

 private:
  LapInput& lap_;
  std::vector<Odometry> odometry_;
  std::vector<TimeSpan> other_turns_;
};

/// The initial map, and the observations that nothing confirms.
struct InitialMap {
  std::vector<internal::ObservationIndex> unconfirmed{};
  ChainResult chain{};
};

/// Consumes the observed frames, which need more memory than the lap. The lap is the same before and after.
Result<InitialMap> initial_map(LapInput& input, std::vector<ObservedFrame> observed,
                               const ChainOptions& options) {
  InitialMap initial{.unconfirmed = unconfirmed_except_last_anchor(input, observed)};
  {
    const internal::ExcludedObservations excluded(input, initial.unconfirmed);
    observe_again(input, initial.unconfirmed, observed);
  }
  Result<ChainResult> chain = map_by_chain(std::move(observed), input.anchor, input.map_T_anchor, input.sizes,
                                           input.base_T_cam, options, input.odometry);
  if (!chain) return tl::unexpected(chain.error());
  initial.chain = std::move(*chain);
  return initial;
}

/// Excludes the unconfirmed observations until all others have been adjusted.
void disable_unconfirmed(const std::vector<internal::ObservationIndex>& unconfirmed, LapBundle& lap) {
  const std::set<internal::ObservationIndex> all(unconfirmed.begin(), unconfirmed.end());
  for (std::size_t i = 0; i < lap.observations.size(); ++i) {
    CornerTerm& term = lap.bundle.corners[i];
    term.unconfirmed = all.contains({lap.observations[i].frame, lap.observations[i].detection});
    term.used = term.used && !term.unconfirmed;
  }
}

/// Tags that are missing from the start because all their observations are unconfirmed.
std::set<TagId> tags_without_confirmed_observation(const LapInput& input,
                                                   const std::vector<internal::ObservationIndex>& unconfirmed,
                                                   const ChainResult& start) {
  std::set<TagId> tags;
  for (const auto& [frame, detection] : unconfirmed)
    tags.insert(input.frames[frame].detections[detection].tag);
  std::erase_if(tags, [&](const TagId& tag) {
    return start.map.find(tag) != nullptr ||
           std::ranges::find(start.unconnected, tag) != start.unconnected.end();
  });
  return tags;
}

RejectedObservation rejection_of(const LapInput& lap, const internal::ObservationIndex& index) {
  const TagFrame& frame = lap.frames[index.frame];
  return {frame.stamp, frame.detections[index.detection].tag, std::numeric_limits<double>::infinity()};
}

/// Rejections of observations that the search does not use.
std::vector<RejectedObservation> all_rejected(const LapInput& lap,
                                              const std::vector<internal::ObservationIndex>& observations) {
  std::vector<RejectedObservation> all;
  all.reserve(observations.size());
  for (const internal::ObservationIndex& index : observations) all.push_back(rejection_of(lap, index));
  return all;
}

}  // namespace

TagSizes found_sizes(TagSizes given, const BundleMap& map) {
  if (given.default_size_m) *given.default_size_m *= map.size_scale;
  for (auto& [tag, size_m] : given.size_by_tag_m) size_m *= map.size_scale;
  for (const WrongSize& wrong : map.wrong_sizes) given.size_by_tag_m[wrong.tag] = wrong.found_m;
  return given;
}

Result<BundleMap> map_by_bundle(const LapInput& given, const ChainOptions& chain_options,
                                const BundleMapOptions& options, const MapProgress& asked) {
  LapInput lap = given;
  return map_by_bundle_in_place(lap, chain_options, options, asked);
}

Result<BundleMap> map_by_bundle_in_place(LapInput& input, const ChainOptions& chain_options,
                                         const BundleMapOptions& options, const MapProgress& asked) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  bool stopped = false;
  const MapProgress progress = [&](const std::string& stage, int iteration, double cost) {
    stopped = stopped || (asked && !asked(stage, iteration, cost));
    return !stopped;
  };
  std::vector<ObservedFrame> observed = observe_all(input);
  internal::RoughOdometry rough = internal::rough_odometry(input, observed);
  const ReplacedOdometry odometry(input, rough);
  const std::vector<internal::ObservationIndex> second =
      internal::observations_of_duplicate_tags(input, observed);
  const std::vector<RejectedObservation> duplicates = all_rejected(input, second);
  std::optional<internal::ExcludedObservations> without_second;
  without_second.emplace(input, second);
  observe_again(input, second, observed);
  const Result<InitialMap> initial = initial_map(input, std::move(observed), chain_options);
  if (!initial) return tl::unexpected(initial.error());
  const auto& [unconfirmed, start] = *initial;
  if (!progress("composing the initial map", 0, 0)) return internal::stopped_on_request();

  LapBundle lap = lap_bundle(input, start, options.model);
  BundleMap result{
      .start_map = start.map, .start_trajectory = start.trajectory, .unconnected = start.unconnected};
  result.assumed_size_spread = result.size_spread = options.search.tag_size_sigma_percent / 100;
  result.size_prior_sigma = options.search.common_tag_size_sigma_percent.value_or(0) / 100;
  free_sizes(result.assumed_size_spread, result.size_prior_sigma, lap);
  disable_unconfirmed(unconfirmed, lap);
  const std::set<TagId> without_confirmed = tags_without_confirmed_observation(input, unconfirmed, start);
  result.unconnected.insert(result.unconnected.end(), without_confirmed.begin(), without_confirmed.end());
  std::vector<std::size_t> released = optimise(input, lap, options, progress, result);
  std::erase_if(result.unconnected, [&](const TagId& tag) {
    if (without_confirmed.contains(tag)) result.unconfirmed.push_back(tag);
    return without_confirmed.contains(tag);
  });
  std::optional<internal::TiedPrior> tied;
  if (input.prior && result.summary.usable()) {
    Result<internal::TiedPrior> done = extend(input, lap, options, progress, result);
    if (!done) return tl::unexpected(done.error());
    tied = std::move(*done);
  }
  if (stopped) return internal::stopped_on_request();
  if (!result.summary.usable())
    return fail(ErrorCode::InvalidArgument, "mapping failed: " + result.summary.why);
  consider_mounting(input, lap, options, progress, result, released);
  if (tied && options.find_mounting && result.mounting && !stopped)
    internal::spread_by_stretches(lap, *result.mounting);
  if (result.mounting_used && !result.mounting && !stopped)
    return fail(ErrorCode::InvalidArgument, "the camera mounting could not be estimated", {},
                "Set `keep_mounting` to use the mounting of the robot file.");
  weigh_lasting_errors(lap, options, progress_of(progress, "adjusting"), result);
  if (stopped || !progress("computing the covariance", 0, 0)) return internal::stopped_on_request();

  const internal::TiePairs pairs = internal::pairs_to_tie(input, lap, tied);
  const BundleCovariance P = covariance(lap.bundle, pairs.poses);
  result.size_scale = std::exp(lap.bundle.common_size.log_scale);
  result.size_scale_sigma = result.size_scale * std::sqrt(P.common_size);
  list_wrong_sizes(input, lap, P, released, result);
  list_thin_cuts(input, lap, P, result);
  read_tags(input, lap, P, start, result);
  if (tied) keep_unobserved_tags(input, lap, *tied, P, result);
  internal::tie_tags(pairs.tags, P.pairs, result.map);
  result.map.floor = floor_of(lap, P);
  read_observations(input, lap, result);
  for (const WrongSize& wrong : result.wrong_sizes) {
    const auto tag = result.map.tags.find(wrong.tag);
    if (tag != result.map.tags.end()) tag->second.size_m = wrong.found_m;
  }
  result.rejected.insert(result.rejected.end(), duplicates.begin(), duplicates.end());
  for (const RejectedObservation& observation : all_rejected(input, unconfirmed)) {
    if (std::ranges::find(result.unconfirmed, observation.tag) != result.unconfirmed.end())
      result.rejected.push_back(observation);
  }
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    if (!lap.bases[i]) {
      ++result.frames_without_pose;
      continue;
    }
    if (i > 0 && lap.bases[i] == lap.bases[i - 1]) continue;  // from another camera at the same time
    result.trajectory.push_back({input.frames[i].stamp, lap.bundle.poses[*lap.bases[i]].value});
    result.trajectory_covariance.push_back(P.poses[*lap.bases[i]]);
  }
  result.odometry_scales = lap.bundle.odometry_scales[0].value;
  result.odometry_scales_sigma = OdometryScales::of(P.scales[0].diagonal().cwiseMax(0.0).cwiseSqrt());
  scale_by(rough, result.odometry_scales, result.odometry_scales_sigma);
  if (result.mounting) scale_by(rough, result.mounting->scales, result.mounting->scales_sigma);
  result.turns_by_gyro = rough.turns_by_gyro;
  result.without_gyro_share = input.imu.empty() ? 1 : rough.without_gyro_share;
  estimate_wheel_turns(odometry.given(), result);
  result.moved_tags = internal::moved_tags(input, lap, result.map);
  without_second.reset();  // the observations of a tag before it was moved are among them
  const std::vector<SecondPlace> places = second_places(input, result);
  without_second.emplace(input, second);
  for (const MovedTag& moved : internal::tags_moved_in_view(places, result))
    result.moved_tags.push_back(moved);
  result.missing_tags = internal::missing_lap_tags(input, lap, P, result);
  internal::drop_tags_observed_elsewhere(places, result.missing_tags);
  return result;
}

}  // namespace waymark
