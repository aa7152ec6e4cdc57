#include "waymark/mapping/scene/scene_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/scene/misread_ids.hpp"
#include "waymark/mapping/scene/moved_tags.hpp"
#include "waymark/mapping/scene/odometry_checks.hpp"
#include "waymark/mapping/scene/place_poses.hpp"
#include "waymark/mapping/scene/prior_checks.hpp"
#include "waymark/mapping/scene/rolling_corners.hpp"
#include "waymark/mapping/scene/scene_calibration.hpp"
#include "waymark/mapping/scene/scene_report.hpp"
#include "waymark/mapping/scene/scene_sizes.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"
#include "waymark/mapping/solver/map_search.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

namespace waymark {
namespace {

constexpr double kMedianChi2 = 7.344;  // median of chi-square with 8 degrees of freedom
constexpr int kRounds = 5;

/// Whether a prior is precise enough to start from. The limits are smaller than the difference between the
/// two poses of a square.
bool is_informative(const ScenePrior& prior) {
  constexpr double kSigmaM = 1.0;
  constexpr double kSigmaRad = 0.3;
  const Matrix6 P =
      (prior.sqrt_information.transpose() * prior.sqrt_information + 1e-9 * Matrix6::Identity()).inverse();
  return P.diagonal().head<3>().maxCoeff() < kSigmaM * kSigmaM &&
         P.diagonal().tail<3>().maxCoeff() < kSigmaRad * kSigmaRad;
}

/// `weak`: also uses weak priors, which are better than nothing if no other prior is available.
std::vector<KnownPose> known_poses(const TagScene& scene, const SceneBundle& problem, bool weak) {
  std::vector<KnownPose> known(problem.bundle.poses.size());
  for (std::size_t i = 0; i < known.size(); ++i) known[i].moves = problem.moves[i] != 0;
  const auto from = [&](PoseIndex pose, const std::optional<ScenePrior>& prior) {
    if (prior && (weak || is_informative(*prior))) known[pose] = {true, prior->covariance(), false};
  };
  for (std::size_t c = 0; c < scene.cameras.size(); ++c)
    from(problem.cameras[c], scene.cameras[c].body_T_cam);
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    if (scene.bodies[b].is_static) from(problem.bodies[b].front(), scene.bodies[b].map_T_body);
    for (std::size_t t = 0; t < scene.bodies[b].tags.size(); ++t)
      from(problem.tags[b][t], scene.bodies[b].tags[t].body_T_tag);
  }
  return known;
}

class Search {
  /// A state of the search that can be returned to.
  struct State {
    Bundle bundle{};
    std::vector<char> placed{};
    std::vector<KnownPose> known{};
    BundleSummary summary{};
    double noise_px = 0;
  };

 public:
  Search(const SceneRecording& recording, const SceneMapOptions& options, const MapProgress& progress,
         SceneMap& map)
      : recording_(recording), options_(options), progress_(progress), map_(map) {}

  /// Places all poses and minimises the robust cost. Trusts odometry first, because it refutes misread ids.
  /// If it then contradicts the observations, searches again with a robust loss for odometry too, and keeps
  /// the more probable result.
  void search_coarsely() {
    Bundle& bundle = map_.problem.bundle;
    if (options_.model == SceneModel::Waymark) std::swap(distances_, bundle.point_distances);
    const Bundle start = judges_odometry() ? bundle : Bundle();
    search_from_placed();
    if (!judges_odometry() || !goes_on() || !is_odometry_in_question()) return;
    trusts_odometry_ = true;
    adjust_until_stable();
    trusts_odometry_ = false;
    if (!goes_on() || !is_odometry_in_question()) return;
    const State trusted = state();
    bundle = start;
    judge_odometry(map_);
    search_from_placed();
    restore_contradicted_frames(map_);
    adjust_until_stable();
    if (map_.summary.stopped) return;
    if (!goes_on()) {
      go_to(trusted);
      map_.odometry_ratio = 1;
      return;
    }
    const double noise_px = std::min(noise_px_, trusted.noise_px);
    const double ratio = map_.odometry_ratio;
    const auto cost_now = [&](bool trusts) {
      return cost_of_explanation(
          map_, {noise_px / noise_px_, ratio / map_.odometry_ratio, options_.search.outlier_chi2, trusts});
    };
    const double by_judging = cost_now(false);
    State judged = state();
    go_to(trusted);
    map_.odometry_ratio = 1;
    if (cost_now(true) <= by_judging) return;
    go_to(std::move(judged));
    map_.odometry_ratio = ratio;
  }

  /// Minimises TagSLAM's cost over all observations.
  void minimise_tagslam_cost() {
    set_corner_noise(map_.scene.pixel_sigma_px);
    for (CornerTerm& term : map_.problem.bundle.corners) term.used = can_count(term);
    add_wiggle(map_.scene, map_.observations, map_.problem);
    map_.placed.resize(map_.problem.bundle.poses.size(), 1);
    find(0, options_.search.max_iterations, "adjusting");
  }

  /// Estimates the corner noise and other free parameters from the observations.
  void adjust_with_estimated_noise() {
    adjust_until_stable();
    estimate_odometry_noise();
    explain_contradictions();
    estimate_odometry_noise();
    if (goes_on() && correct_misread_ids(map_, options_.search.outlier_chi2) > 0) adjust_until_stable();
    add_planes(map_.scene, map_.problem, map_.placed);
    known_.resize(map_.placed.size());
    count_correlated();
    const bool given = std::ranges::any_of(
        map_.scene.cameras, [](const CameraOnBody& camera) { return camera.intrinsics_sigma.size() > 0; });
    if (options_.free_intrinsics || given) {
      free_intrinsics(map_, options_.free_intrinsics);
      adjust_until_stable();
      count_correlated();
    }
    find_size_of_tags();
    find(0, options_.search.max_iterations, "adjusting");
    for (const SeparatedTag& tag : moves_) map_.moved_tags.push_back(describe_move(recording_, map_, tag));
  }

  /// Repeats until the set of observations in use and the noise estimate no longer change.
  void adjust_until_stable() {
    for (int round = 0; round < kRounds && goes_on(); ++round) {
      constexpr double kMaxCornerChange_px = 0.02;
      const bool moved = bring_corners_to_middle(recording_, map_) > kMaxCornerChange_px;
      set_corner_noise(noise_px_ * noise_ratio());
      const bool changed = gate_observations();
      if (!changed && !moved && round > 0) break;
      find(0, options_.search.max_iterations, "adjusting", kRoughGain);
    }
  }

  void estimate_odometry_noise() {
    constexpr double kSmallChange = 0.05;
    for (int round = 0; round < kRounds && goes_on() && judges_odometry(); ++round) {
      const double factor = multiply_odometry_noise(map_, odometry_ratio(map_));
      if (std::abs(factor - 1) < kSmallChange) break;
      adjust_until_stable();
    }
  }

  /// Estimates the spread of printed sizes, and finds the tags that contradict the map. They have another
  /// size than given or a wrong given pose, or they were moved.
  void explain_contradictions() {
    if (!(options_.search.tag_size_sigma_percent > 0) || !goes_on()) return;
    count_correlated();
    std::set<std::size_t> tried;
    State before = state();
    const auto suspects = [&] {
      std::vector<std::size_t> sizes = contradicted_sizes(map_);
      for (const std::size_t size : sizes_far_from_given_pose(map_)) sizes.push_back(size);
      for (const std::size_t size : sizes_of_moved_tags()) sizes.push_back(size);
      return sizes;
    };
    const auto adjust = [&](const std::vector<std::size_t>& released) {
      if (!released.empty() && tried.insert(released.back()).second) {
        const std::size_t size = released.back();
        before = state();
        if (observations_by_size(map_)[size].contradict()) start_size(map_, size);
        use_again(released);
        if (!may_fit(size)) return;
      }
      adjust_until_stable();
    };
    const auto cause = [&](std::size_t size, const Bundle& given_size) {
      before.bundle = given_size;
      return cause_of(size, before);
    };
    const ReleasedSizes sizes =
        release_sizes(map_.problem.bundle, map_.assumed_size_spread, {suspects, adjust, cause});
    map_.released_sizes = sizes.released;
    map_.size_spread = sizes.spread;
    for (const auto& [prior, given] : loosened_priors_) map_.problem.bundle.priors[prior].factor = given;
    if (!loosened_priors_.empty()) adjust_until_stable();
    join_unmoved_tags();
  }

  /// A move that later explanations made unnecessary is undone.
  void join_unmoved_tags() {
    if (!goes_on()) return;
    const std::size_t all = std::erase_if(moves_, [&](const SeparatedTag& tag) {
      if (is_far(describe_move(recording_, map_, tag))) return false;
      join_again(map_, tag);
      return true;
    });
    if (all > 0) adjust_until_stable();
  }

  [[nodiscard]] static bool is_far(const MovedTag& moved) {
    constexpr double kMinDistance_m = 0.005;
    constexpr double kMinAngle_rad = 0.02;
    return moved.distance_m > kMinDistance_m || moved.angle_rad > kMinAngle_rad;
  }

  [[nodiscard]] std::vector<char> sizes_that_fit() const {
    return waymark::sizes_that_fit(map_.problem.bundle, chi2_of_corners(), observations_by_size(map_));
  }

  /// Tags that do not fit like others, and would fit better if they had been moved.
  [[nodiscard]] std::vector<std::size_t> sizes_of_moved_tags() const {
    const std::vector<char> fit = sizes_that_fit();
    std::vector<std::size_t> sizes;
    for (std::size_t i = 0; i < fit.size(); ++i) {
      if (fit[i] == 0) sizes.push_back(i);
    }
    const std::vector<LikelyMove> moves = likely_moves(recording_, map_, sizes);
    if (!are_few_tags(moves.size(), observations_by_size(map_))) return {};
    sizes.clear();
    sizes.reserve(moves.size());
    for (const LikelyMove& move : moves) sizes.push_back(move.size);
    return sizes;
  }

  [[nodiscard]] bool fits(std::size_t size) const { return sizes_that_fit()[size] != 0; }

  /// The cost of a map, with the limit at which observations are rejected for those that are.
  [[nodiscard]] double cost_with_rejected() const {
    const Bundle& bundle = map_.problem.bundle;
    const auto rejected = std::ranges::count_if(bundle.corners, [&](const CornerTerm& term) {
      return !term.used && can_count(term) && !term.unconfirmed;
    });
    return cost(bundle) + static_cast<double>(rejected) * options_.search.outlier_chi2 / 2;
  }

  /// An explanation of the contradictions of one tag.
  struct Explanation {
    State state{};
    double more_unknowns = 0;
    bool is_size = false;
    std::optional<std::pair<std::size_t, PosePriorFactor>> given_prior{};  ///< if loosened
    std::optional<SeparatedTag> move{};
  };

  /// After the size of a tag was released: whether its observations agree better if it was moved, or if its
  /// given pose is wrong. The search continues from the best explanation, by the criterion of Schwarz
  /// ("Estimating the Dimension of a Model", Annals of Statistics 6(2), 1978), or from the state before.
  SizeCause cause_of(std::size_t size, const State& before) {
    if (map_.summary.stopped) return SizeCause::Unknown;
    std::vector<Explanation> explanations;
    explanations.push_back({.state = before});
    if (goes_on() && fits(size))
      explanations.push_back({.state = state(), .more_unknowns = 1, .is_size = true});
    go_to(before);
    for (const LikelyMove& move : moves_to_try(recording_, map_, size)) {
      go_to(before);
      if (auto moved = explain_by_move(move)) explanations.push_back(std::move(*moved));
    }
    go_to(before);
    if (auto loosened = explain_by_prior(size)) explanations.push_back(std::move(*loosened));
    if (map_.summary.stopped) return SizeCause::Unknown;
    Explanation best = best_of(std::move(explanations), size);
    if (best.move) best = move_among_neighbours(std::move(best), before);
    go_to(std::move(best.state));
    if (best.given_prior) loosened_priors_.push_back(*best.given_prior);
    if (best.move) moves_.push_back(*best.move);
    if (best.is_size) return SizeCause::Size;
    return best.move || best.given_prior ? SizeCause::Other : SizeCause::Unknown;
  }

  std::optional<Explanation> explain_by_move(const LikelyMove& move) {
    if (std::ranges::any_of(moves_, [&](const SeparatedTag& tag) { return tag.move.size == move.size; }))
      return std::nullopt;
    const SeparatedTag tag = separate_earlier(map_, move);
    use_again({move.size});
    if (!may_fit(move.size)) return std::nullopt;
    adjust_until_stable();
    if (!goes_on() || !fits(move.size)) return std::nullopt;
    if (!is_far(describe_move(recording_, map_, tag))) return std::nullopt;
    return Explanation{.state = state(), .more_unknowns = 6, .move = tag};
  }

  /// The move of this tag or of a neighbour, whichever explains more. Images that show both follow the tag
  /// with more observations, and contradict the other one.
  Explanation move_among_neighbours(Explanation found, const State& before) {
    const LikelyMove move = found.move->move;
    std::vector<Explanation> explanations;
    explanations.push_back(std::move(found));
    go_to(before);
    for (const LikelyMove& other : moves_of_neighbours(recording_, map_, move)) {
      go_to(before);
      if (auto moved = explain_by_move(other); moved && fits(move.size))
        explanations.push_back(std::move(*moved));
    }
    return best_of(std::move(explanations), move.size);
  }

  std::optional<Explanation> explain_by_prior(std::size_t size) {
    constexpr double kLoosened = 1e-3;
    std::vector<PriorTerm>& priors = map_.problem.bundle.priors;
    const std::vector<CornerTerm>& corners = map_.problem.bundle.corners;
    const auto seen = std::ranges::find(corners, std::optional(size), &CornerTerm::size);
    if (seen == corners.end()) return std::nullopt;
    const auto prior = std::ranges::find(priors, seen->tag, &PriorTerm::pose);
    if (prior == priors.end()) return std::nullopt;
    const std::pair given(static_cast<std::size_t>(prior - priors.begin()), prior->factor);
    prior->factor.whitening = kLoosened * Matrix6::Identity();
    use_again({size});
    if (!may_fit(size)) return std::nullopt;
    adjust_until_stable();
    if (!goes_on() || !fits(size)) return std::nullopt;
    return Explanation{.state = state(), .more_unknowns = 6, .given_prior = given};
  }

  /// The most likely one, if corners have the smallest noise of all.
  Explanation best_of(std::vector<Explanation> explanations, std::size_t size) {
    const auto n = static_cast<double>(
        std::ranges::count(map_.problem.bundle.corners, std::optional(size), &CornerTerm::size));
    const double noise_px = std::ranges::min(explanations, {}, [](const Explanation& e) {
                              return e.state.noise_px;
                            }).state.noise_px;
    double least = std::numeric_limits<double>::infinity();
    std::size_t best = 0;
    for (std::size_t i = 0; i < explanations.size(); ++i) {
      go_to(explanations[i].state);
      set_corner_noise(noise_px);
      gate_observations();
      const double criterion = cost_with_rejected() + explanations[i].more_unknowns / 2 * std::log(8 * n);
      if (criterion < least) best = i;
      least = std::min(least, criterion);
    }
    return std::move(explanations[best]);
  }

  /// Observations that contradicted the given size of a tag may agree with another size. Errors are large at
  /// first, so the outlier threshold is decreased in steps.
  void use_again(const std::vector<std::size_t>& sizes) {
    for (CornerTerm& term : map_.problem.bundle.corners) {
      if (term.size && can_count(term) && std::ranges::find(sizes, *term.size) != sizes.end())
        term.used = true;
    }
    known_.resize(map_.placed.size());
    replace_contradicted(map_.problem.bundle, map_.placed, known_, options_.search.outlier_chi2);
    for (double chi2 : {100 * kCoarseChi2, kCoarseChi2, options_.search.robust_chi2})
      find(chi2, options_.search.max_iterations, "explaining contradictions", kRoughGain);
  }

  /// Whether few enough observations of a tag contradict the map for the attempt to go on.
  [[nodiscard]] bool may_fit(std::size_t size) {
    constexpr double kMaxShare = 0.2;
    gate_observations();
    return goes_on() && observations_by_size(map_)[size].share_unused() < kMaxShare;
  }

  /// Downweights images with persistent errors.
  void count_correlated() {
    if (!goes_on()) return;
    std::vector<std::size_t> frames;
    frames.reserve(map_.observations.seen.size());
    for (const auto& seen : map_.observations.seen) frames.push_back(seen.frame);
    map_.correlated_frames = correlated_frames(map_.problem.bundle, frames);
    set_corner_noise(noise_px_);
    find(0, options_.search.max_iterations, "adjusting", kRoughGain);
  }

  /// If distances are given, estimates one size factor for all tags. Distances are used only from here on,
  /// because before this step, even a slightly wrong size would make them conflict with observations.
  void find_size_of_tags() {
    Bundle& bundle = map_.problem.bundle;
    const auto in_map = [&](const BundlePoint& p) {
      return map_.placed[p.tag] != 0 && map_.placed[p.body] != 0;
    };
    std::vector<double> ratios;
    for (PointDistanceTerm term : distances_) {
      for (const SeparatedTag& tag : moves_) {
        term.a.tag = term.a.tag == tag.later ? tag.earlier : term.a.tag;
        term.b.tag = term.b.tag == tag.later ? tag.earlier : term.b.tag;
      }
      if (!in_map(term.a) || !in_map(term.b)) continue;
      bundle.point_distances.push_back(term);
      ratios.push_back(term.measured_m / (place_of(term.a) - place_of(term.b)).norm());
    }
    if ((ratios.empty() && !options_.size_sigma) || !goes_on()) return;
    constexpr double kMaxSizeChange = 0.2;
    const double start =
        ratios.empty() ? 1 : std::clamp(median(std::move(ratios)), 1 - kMaxSizeChange, 1 + kMaxSizeChange);
    const TagScale scale = find_tag_scale(map_, start, map_.size_prior_sigma, [&] {
      find(0, options_.search.max_iterations, "estimating the tag size");
    });
    map_.size_sigma = scale.sigma;
    if (options_.size_sigma) map_.by_size = scale.by_scale;
    gate_observations();
    for (SceneBody& body : map_.scene.bodies) {
      for (SceneTag& tag : body.tags) tag.size_m *= map_.size_scale;
    }
  }

  [[nodiscard]] double noise_px() const { return noise_px_; }
  void end() { factor_.forget(); }

 private:
  static constexpr double kStartPx = 0.5;
  static constexpr double kCoarseGain = 1e-3;  // accuracy sufficient to find outliers
  static constexpr double kRoughGain = 1e-4;   // accuracy sufficient to select observations
  static constexpr double kFineGain = 1e-8;
  static constexpr double kCoarseChi2 = 200;

  [[nodiscard]] Eigen::Vector3d place_of(const BundlePoint& p) const {
    const std::vector<BundlePose>& poses = map_.problem.bundle.poses;
    return poses[p.body].value * (poses[p.tag].value * p.tag_p);
  }

  void place() {
    Bundle& bundle = map_.problem.bundle;
    PlaceOptions options;
    for (CornerTerm& term : bundle.corners) term.used = true;
    std::vector<std::vector<internal::Hypothesis>> squares;
    if (options_.model == SceneModel::Waymark) {
      squares.reserve(bundle.corners.size());
      for (const CornerTerm& term : bundle.corners)
        squares.push_back(internal::poses_of_square(bundle, term, options.two_poses_sigma_px));
      const internal::Confirmation confirmation = confirm(squares);
      for (std::size_t i = 0; i < bundle.corners.size(); ++i)
        bundle.corners[i].unconfirmed = confirmation.unconfirmed[i] != 0;
      options.min_votes = 2;
      options.min_unconfirmed_votes = confirmation.min_votes;
      options.squares = &squares;
    }
    map_.placed = place_poses(bundle, known_, options);
    for (CornerTerm& term : bundle.corners) term.used = term.used && !term.unconfirmed;
  }

  /// Here, a view contains the observations of one camera at one time.
  [[nodiscard]] internal::Confirmation confirm(
      const std::vector<std::vector<internal::Hypothesis>>& squares) const {
    const std::size_t cameras = map_.scene.cameras.size();
    std::vector<internal::ViewedTag> seen;
    seen.reserve(map_.observations.seen.size());
    std::size_t frames = 0;
    for (const SceneObservation& observation : map_.observations.seen)
      frames = std::max(frames, observation.frame + 1);
    for (const SceneObservation& observation : map_.observations.seen) {
      const auto& c = observation.factor.corners_px;
      seen.push_back({observation.camera * (frames + 1) + observation.frame,
                      map_.problem.tags[observation.body][observation.tag], observation.body,
                      (c[0] + c[1] + c[2] + c[3]) / 4, std::max((c[2] - c[0]).norm(), (c[3] - c[1]).norm())});
    }
    return internal::confirm_observations(seen, squares, motions_of_views(frames, cameras));
  }

  /// Computes the motions for cameras that have a known mounting on a body with measured motion.
  [[nodiscard]] std::vector<internal::ViewMotion> motions_of_views(std::size_t frames,
                                                                   std::size_t cameras) const {
    std::vector<internal::ViewMotion> motions(cameras * (frames + 1));
    const Bundle& bundle = map_.problem.bundle;
    std::map<PoseIndex, const RelativeTerm*> to;
    for (const RelativeTerm& term : bundle.relatives) to[term.b] = &term;
    for (std::size_t c = 0; c < cameras; ++c) {
      const PoseIndex cam = map_.problem.cameras[c];
      if (!known_[cam].placed && !bundle.poses[cam].fixed) continue;
      const SE3& body_T_cam = bundle.poses[cam].value;
      const SE3 cam_T_body = body_T_cam.inverse();
      for (std::size_t f = 1; f < frames; ++f) {
        const std::size_t body = map_.scene.cameras[c].body;
        const auto term = to.find(map_.problem.body_at(body, f));
        if (term == to.end() || term->second->a != map_.problem.body_at(body, f - 1)) continue;
        const RelativePoseFactor& factor = term->second->factor;
        const Matrix6 W_inverse = factor.whitening.inverse();
        const Matrix6 Ad = (cam_T_body * factor.body_T_sensor).adjoint();
        motions[c * (frames + 1) + f] = {
            true,
            cam_T_body * factor.body_T_sensor * factor.measured * factor.body_T_sensor.inverse() * body_T_cam,
            Ad * W_inverse * W_inverse.transpose() * Ad.transpose()};
      }
    }
    return motions;
  }

  [[nodiscard]] bool goes_on() const { return map_.summary.usable(); }

  [[nodiscard]] State state() const {
    return {map_.problem.bundle, map_.placed, known_, map_.summary, noise_px_};
  }

  void go_to(State state) {
    map_.problem.bundle = std::move(state.bundle);
    map_.placed = std::move(state.placed);
    map_.problem.moves.resize(map_.placed.size(), 0);  // only tags' earlier poses are added or removed
    known_ = std::move(state.known);
    noise_px_ = state.noise_px;
    if (!map_.summary.stopped) map_.summary = std::move(state.summary);
  }

  /// Minimises the robust cost, starting from the placed poses, and moves poses that are in a wrong local
  /// minimum.
  void search_from_placed() {
    Bundle& bundle = map_.problem.bundle;
    for (bool weak : {false, true}) {
      known_ = known_poses(map_.scene, map_.problem, weak);
      place();
      if (std::ranges::any_of(bundle.corners, &CornerTerm::used)) break;
    }
    set_corner_noise(kStartPx);
    replace_contradicted(bundle, map_.placed, known_, kCoarseChi2);
    // Errors are large far from the optimum, so the outlier threshold is decreased in steps.
    for (double chi2 : {100 * kCoarseChi2, kCoarseChi2}) find(chi2, 15, "rejecting outliers", kCoarseGain);
    for (int round = 0; round < kRounds && goes_on(); ++round) {
      find(options_.search.robust_chi2, 10, "rejecting outliers", kCoarseGain);
      set_corner_noise(noise_px_ * noise_ratio());
      if (judges_odometry() && map_.problem.bundle.relatives[map_.problem.odometry.front().term].robust)
        multiply_odometry_noise(map_, std::max(rough_odometry_ratio(map_), 1.0));
      if (replace_contradicted(bundle, map_.placed, known_, options_.search.outlier_chi2) == 0) break;
    }
  }

  /// Whether odometry may be the cause of errors, after a search that trusts it.
  [[nodiscard]] bool is_odometry_in_question() const {
    return noise_px_ > kStartPx || contradicts_odometry(map_, options_.search.outlier_chi2);
  }

  [[nodiscard]] bool judges_odometry() const {
    return options_.model == SceneModel::Waymark && has_odometry(map_);
  }

  void find(double robust_chi2, int steps, const char* stage, double relative_gain = kFineGain) {
    if (!goes_on()) return;
    const BundleOptions search{
        .max_iterations = steps, .relative_gain = relative_gain, .robust_chi2 = robust_chi2};
    const auto report_progress = [&](int iteration, double cost) {
      return !progress_ || progress_(stage, iteration, cost);
    };
    map_.summary = solve(map_.problem.bundle, search, report_progress, factor_);
  }

  [[nodiscard]] bool can_count(const CornerTerm& term) const { return map_.is_placed(term); }

  /// Sets the same noise for all corners.
  void set_corner_noise(double sigma_px) {
    noise_px_ = sigma_px;
    for (CornerTerm& term : map_.problem.bundle.corners) {
      term.factor.whitening = CornerCovariance::Identity() / (sigma_px * std::sqrt(map_.correlated_frames));
      term.factor.isotropic = true;
    }
  }

  /// The chi2 of each corner term, without the downweighting of correlated images.
  [[nodiscard]] std::vector<double> chi2_of_corners() const {
    std::vector<double> chi2 = corner_chi2(map_.problem.bundle);
    for (double& x : chi2) x *= map_.correlated_frames;
    return chi2;
  }

  /// The number of unknowns of all poses that are in a term of the cost.
  [[nodiscard]] double unknowns_of_poses() const {
    const Bundle& bundle = map_.problem.bundle;
    std::vector<char> in_a_term(bundle.poses.size(), 0);
    for (const CornerTerm& term : bundle.corners) {
      if (term.used)
        in_a_term[term.rig] = in_a_term[term.cam] = in_a_term[term.body] = in_a_term[term.tag] = 1;
    }
    for (const PriorTerm& term : bundle.priors) in_a_term[term.pose] = 1;
    for (const RelativeTerm& term : bundle.relatives) {
      if (term.used) in_a_term[term.a] = in_a_term[term.b] = 1;
    }
    double unknowns = 0;
    for (std::size_t i = 0; i < in_a_term.size(); ++i)
      unknowns += in_a_term[i] != 0 && !bundle.poses[i].fixed ? 6 : 0;
    return unknowns;
  }

  /// The ratio of actual to assumed noise, estimated from the median, which is robust against outliers.
  [[nodiscard]] double noise_ratio() const {
    std::vector<double> chi2 = chi2_of_corners();
    double numbers = 0;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      if (!can_count(map_.problem.bundle.corners[i]) || !std::isfinite(chi2[i])) continue;
      numbers += map_.problem.bundle.corners[i].used ? 8 : 0;
      chi2[kept++] = chi2[i];
    }
    chi2.resize(kept);
    const auto motions = std::ranges::count_if(map_.problem.bundle.relatives, &RelativeTerm::used);
    numbers +=
        6.0 * static_cast<double>(map_.problem.bundle.priors.size() + static_cast<std::size_t>(motions));
    constexpr std::size_t kMinCorners = 50;
    const double share = 1 - unknowns_of_poses() / std::max(numbers, 1.0);
    if (chi2.size() < kMinCorners || share < 0.05) return 1;
    return std::max(std::sqrt(median(std::move(chi2)) / (kMedianChi2 * share)), 1e-3);
  }

  bool gate_observations() {
    Bundle& bundle = map_.problem.bundle;
    const std::vector<double> chi2 = chi2_of_corners();
    const auto good = [&](std::size_t i) {
      return can_count(bundle.corners[i]) && chi2[i] < options_.search.outlier_chi2;
    };
    // Whether a pose is static or has a confirmed observation.
    std::vector<char> supported(map_.problem.moves.size());
    for (std::size_t i = 0; i < supported.size(); ++i) supported[i] = map_.problem.moves[i] == 0 ? 1 : 0;
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      if (!bundle.corners[i].unconfirmed && good(i))
        supported[bundle.corners[i].rig] = supported[bundle.corners[i].body] = 1;
    }
    bool changed = false;
    for (std::size_t i = 0; i < chi2.size(); ++i) {
      const CornerTerm& term = bundle.corners[i];
      const bool used =
          good(i) && (!term.unconfirmed || (supported[term.rig] != 0 && supported[term.body] != 0));
      changed = changed || used != bundle.corners[i].used;
      bundle.corners[i].used = used;
    }
    if (judges_odometry() && !trusts_odometry_) changed = gate_odometry(map_) || changed;
    return changed;
  }

  const SceneRecording& recording_;
  const SceneMapOptions& options_;
  const MapProgress& progress_;
  SceneMap& map_;
  std::vector<KnownPose> known_{};
  std::vector<PointDistanceTerm> distances_{};  ///< not used until the size of tags is estimated
  internal::KeptFactor factor_{};
  double noise_px_ = kStartPx;
  std::vector<std::pair<std::size_t, PosePriorFactor>> loosened_priors_{};  ///< index and given factor
  std::vector<SeparatedTag> moves_{};
  bool trusts_odometry_ = false;  ///< while odometry is not gated
};

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
  map.size_prior_sigma = options.size_sigma.value_or(map.size_prior_sigma);
  map.observations = observations_of(recording, map.scene);
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
  }
  Search search(recording, options, progress, map);
  search.search_coarsely();
  if (map.summary.stopped) return internal::stopped_on_request();
  if (std::ranges::none_of(map.problem.bundle.corners, &CornerTerm::used))
    return fail(ErrorCode::NotFound, "no observed tag is connected to the map", {},
                "Give the pose of one of the tags, or of the body it is on.");
  if (options.model == SceneModel::Tagslam)
    search.minimise_tagslam_cost();
  else
    search.adjust_with_estimated_noise();
  if (map.summary.stopped) return internal::stopped_on_request();
  if (!map.summary.usable()) return fail(ErrorCode::InvalidArgument, "mapping failed: " + map.summary.why);
  map.noise_px = search.noise_px();
  search.end();
  map.cost = cost(map.problem.bundle);
  report_scene(recording, map);
  return map;
}

}  // namespace waymark
