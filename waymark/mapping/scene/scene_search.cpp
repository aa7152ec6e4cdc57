#include "waymark/mapping/scene/scene_search.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/scene/odometry_checks.hpp"
#include "waymark/mapping/scene/rolling_corners.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"

namespace waymark::internal {
namespace {

constexpr double kMedianChi2 = 7.344;  // median of chi-square with 8 degrees of freedom
constexpr double kCoarseChi2 = 200;
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

}  // namespace

SceneSearch::State SceneSearch::state() const {
  return {map_.problem.bundle, map_.placed, known_, map_.summary, noise_px_};
}

void SceneSearch::go_to(State state) {
  map_.problem.bundle = std::move(state.bundle);
  map_.placed = std::move(state.placed);
  map_.problem.moves.resize(map_.placed.size(), 0);  // only poses of tags are added or removed
  known_ = std::move(state.known);
  noise_px_ = state.noise_px;
  if (!map_.summary.stopped) map_.summary = std::move(state.summary);
}

void SceneSearch::place(const std::function<void(std::vector<KnownPose>&)>& change) {
  for (bool weak : {false, true}) {
    known_ = known_poses(map_.scene, map_.problem, weak);
    if (change) change(known_);
    place_all();
    if (std::ranges::any_of(bundle().corners, &CornerTerm::used)) return;
  }
}

void SceneSearch::place_all() {
  Bundle& bundle = map_.problem.bundle;
  PlaceOptions options;
  for (CornerTerm& term : bundle.corners) term.used = true;
  if (options_.model == SceneModel::Waymark) {
    const Confirmation& confirmation = this->confirmation();
    for (std::size_t i = 0; i < bundle.corners.size(); ++i)
      bundle.corners[i].unconfirmed = confirmation.unconfirmed[i] != 0;
    for (const std::size_t i : unconfirmed_) bundle.corners[i].unconfirmed = true;
    options.min_votes = 2;
    options.min_unconfirmed_votes = confirmation.min_votes;
    options.squares = &squares();
  }
  map_.placed = place_poses(bundle, known_, options);
  for (CornerTerm& term : bundle.corners) term.used = term.used && !term.unconfirmed;
}

/// The poses of each corner term's square. They are computed once, because they do not change before the
/// first fine adjustment.
const std::vector<std::vector<Hypothesis>>& SceneSearch::squares() {
  if (!squares_.empty()) return squares_;
  const Bundle& bundle = map_.problem.bundle;
  squares_.reserve(bundle.corners.size());
  for (const CornerTerm& term : bundle.corners)
    squares_.push_back(poses_of_square(bundle, term, PlaceOptions().two_poses_sigma_px));
  return squares_;
}

const Confirmation& SceneSearch::confirmation() {
  if (known_.empty()) known_ = known_poses(map_.scene, map_.problem, false);
  std::vector<char> known_cameras;
  for (const PoseIndex cam : map_.problem.cameras)
    known_cameras.push_back(known_[cam].placed || bundle().poses[cam].fixed ? 1 : 0);
  if (!confirmation_ || known_cameras != known_cameras_) confirmation_ = confirm();
  known_cameras_ = std::move(known_cameras);
  return *confirmation_;
}

Confirmation SceneSearch::confirm() {
  const std::size_t cameras = map_.scene.cameras.size();
  std::vector<ViewedTag> seen;
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
  return confirm_observations(seen, squares(), motions_of_views(frames, cameras));
}

/// Computes the motions for cameras that have a known mounting on a body with measured motion.
std::vector<ViewMotion> SceneSearch::motions_of_views(std::size_t frames, std::size_t cameras) const {
  std::vector<ViewMotion> motions(cameras * (frames + 1));
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

void SceneSearch::search_from_placed() {
  place();
  set_corner_noise(kStartPx);
  replace_contradicted(kCoarseChi2);
  // Errors are large far from the optimum, so the outlier threshold is decreased in steps.
  for (double chi2 : {100 * kCoarseChi2, kCoarseChi2}) find(chi2, 15, "rejecting outliers", kCoarseGain);
  for (int round = 0; round < kRounds && goes_on(); ++round) {
    find(options_.search.robust_chi2, 10, "rejecting outliers", kCoarseGain);
    set_corner_noise(noise_px_ * noise_ratio());
    if (judges_odometry() && map_.problem.bundle.relatives[map_.problem.odometry.front().term].robust)
      multiply_odometry_noise(map_, std::max(rough_odometry_ratio(map_), 1.0));
    if (replace_contradicted(options_.search.outlier_chi2) == 0) break;
  }
}

int SceneSearch::replace_contradicted(double chi2) {
  known_.resize(map_.placed.size());
  return waymark::replace_contradicted(bundle(), map_.placed, known_, chi2);
}

void SceneSearch::find(double robust_chi2, int steps, const char* stage, double relative_gain) {
  if (!goes_on()) return;
  const BundleOptions search{
      .max_iterations = steps, .relative_gain = relative_gain, .robust_chi2 = robust_chi2};
  const auto report_progress = [&](int iteration, double cost) {
    return !progress_ || progress_(stage, iteration, cost);
  };
  map_.summary = solve(map_.problem.bundle, search, report_progress, factor_);
}

void SceneSearch::adjust_until_stable() {
  for (int round = 0; round < kRounds && goes_on(); ++round) {
    constexpr double kMaxCornerChange_px = 0.02;
    const bool moved = bring_corners_to_middle(recording_, map_) > kMaxCornerChange_px;
    set_corner_noise(noise_px_ * noise_ratio());
    const bool changed = gate_observations();
    if (!changed && !moved && round > 0) break;
    find(0, options_.search.max_iterations, "adjusting", kRoughGain);
  }
}

void SceneSearch::set_corner_noise(double sigma_px) {
  noise_px_ = sigma_px;
  for (CornerTerm& term : map_.problem.bundle.corners) {
    term.factor.whitening = CornerCovariance::Identity() / (sigma_px * std::sqrt(map_.correlated_frames));
    term.factor.isotropic = true;
  }
}

void SceneSearch::count_correlated() {
  if (!goes_on()) return;
  std::vector<std::size_t> frames;
  frames.reserve(map_.observations.seen.size());
  for (const auto& seen : map_.observations.seen) frames.push_back(seen.frame);
  map_.correlated_frames = correlated_frames(map_.problem.bundle, frames);
  set_corner_noise(noise_px_);
  find(0, options_.search.max_iterations, "adjusting", kRoughGain);
}

std::vector<double> SceneSearch::chi2_of_corners() const {
  std::vector<double> chi2 = corner_chi2(map_.problem.bundle);
  for (double& x : chi2) x *= map_.correlated_frames;
  return chi2;
}

/// The number of unknowns of all poses that are in a term of the cost.
double SceneSearch::unknowns_of_poses() const {
  const Bundle& bundle = map_.problem.bundle;
  std::vector<char> in_a_term(bundle.poses.size(), 0);
  for (const CornerTerm& term : bundle.corners) {
    if (term.used) in_a_term[term.rig] = in_a_term[term.cam] = in_a_term[term.body] = in_a_term[term.tag] = 1;
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
double SceneSearch::noise_ratio() const {
  std::vector<double> chi2 = chi2_of_corners();
  double numbers = 0;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (!map_.is_placed(map_.problem.bundle.corners[i]) || !std::isfinite(chi2[i])) continue;
    numbers += map_.problem.bundle.corners[i].used ? 8 : 0;
    chi2[kept++] = chi2[i];
  }
  chi2.resize(kept);
  const auto motions = std::ranges::count_if(map_.problem.bundle.relatives, &RelativeTerm::used);
  numbers += 6.0 * static_cast<double>(map_.problem.bundle.priors.size() + static_cast<std::size_t>(motions));
  constexpr std::size_t kMinCorners = 50;
  const double share = 1 - unknowns_of_poses() / std::max(numbers, 1.0);
  if (chi2.size() < kMinCorners || share < 0.05) return 1;
  return std::max(std::sqrt(median(std::move(chi2)) / (kMedianChi2 * share)), 1e-3);
}

bool SceneSearch::gate_observations() {
  Bundle& bundle = map_.problem.bundle;
  const std::vector<double> chi2 = chi2_of_corners();
  const auto good = [&](std::size_t i) {
    return map_.is_placed(bundle.corners[i]) && chi2[i] < options_.search.outlier_chi2;
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

bool SceneSearch::judges_odometry() const {
  return options_.model == SceneModel::Waymark && has_odometry(map_);
}

}  // namespace waymark::internal
