#include "waymark/mapping/lap/mounting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/lap/noise.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"

namespace waymark {
namespace {

/// The usual accuracy of the values in a robot file [m, rad].
constexpr std::array<double, 6> kUsualAccuracy = {0.01, 0.01, 0.01, 0.009, 0.009, 0.009};
constexpr int kHeight = 2;

/// Whether an offset is significant (four standard deviations) and exceeds the usual accuracy of a robot
/// file.
bool is_significant(const Vector6& off, const Vector6& sigma, int i) {
  return std::abs(off[i]) > std::max(kUsualAccuracy[static_cast<std::size_t>(i)], 4 * sigma[i]);
}

Vector6 between(const SE3& assumed, const SE3& found) {
  Vector6 off;
  off << found.translation() - assumed.translation(), (found.rotation() * assumed.rotation().inverse()).log();
  return off;
}

/// The prior is centred at the expected estimate, so that trusted parameters keep their values even if the
/// camera is rotated.
PosePriorFactor prior_of(const MountingAssumption& assumption) {
  constexpr double kFreeSigma = 0.1;  // [m, rad]
  constexpr double kFixedSigma = 1e-4;
  Vector6 sigma = Vector6::Constant(kFreeSigma);
  Vector6 off = assumption.off;
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i == kHeight || assumption.trusted[at]) sigma[i] = kFixedSigma;
    if (sigma[i] < kFreeSigma) off[i] = 0;
  }
  const SE3 centre(SO3::exp(off.tail<3>()) * assumption.base_T_cam.rotation(),
                   assumption.base_T_cam.translation() + off.head<3>());
  const Matrix6 P = sigma.cwiseAbs2().asDiagonal();
  return {centre, whitening_of(from_coordinate_covariance(centre, P).covariance)};
}

/// Reduces the weight of heights. Pose errors due to tags are rotations about the tags, so the farther the
/// base is from the tags, the more its apparent height varies. If the assumed height noise is only the
/// roughness of the floor, the base is pulled towards the tags, where heights vary least. The number of
/// unknown poses grows with the number of observations (Neyman and Scott, "Consistent estimates based on
/// partially consistent observations", 1948). The pull is proportional to the square of the weight.
void loosen_heights(Bundle& bundle) {
  constexpr double kFactor = 4;
  for (OnFloorTerm& term : bundle.on_floor) term.factor.height_sigma_m *= kFactor;
}

/// Makes the focal length of the first camera an unknown with a prior; all other camera parameters stay
/// fixed.
void free_focal_length(double share, Bundle& bundle) {
  bundle.intrinsics.resize(bundle.cameras.size());
  BundleIntrinsics& free = bundle.intrinsics[0];
  free.prior = intrinsics_of(bundle.cameras[0]);
  constexpr double kExactSigma = 1e-6;
  free.sigma = Eigen::VectorXd::Constant(free.prior.size(), kExactSigma);
  free.sigma.head<2>() = share * free.prior.head<2>().cwiseAbs();
}

void read_focal_length(const Bundle& bundle, const BundleCovariance& known, MountingEstimate& estimate) {
  if (bundle.intrinsics.empty() || known.intrinsics[0].size() == 0) return;
  const Eigen::Vector2d given = bundle.intrinsics[0].prior.head<2>();
  estimate.focal_scale = given.cwiseInverse().dot(intrinsics_of(bundle.cameras[0]).head<2>()) / 2;
  estimate.focal_scale_sigma = internal::focal_scale_sigma(bundle, known.intrinsics[0]);
}

}  // namespace

namespace internal {

double focal_scale_sigma(const Bundle& bundle, const Eigen::MatrixXd& intrinsics_covariance) {
  const Eigen::Vector2d mean = bundle.intrinsics[0].prior.head<2>().cwiseInverse() / 2;
  const Eigen::Matrix2d P = intrinsics_covariance.topLeftCorner<2, 2>();
  return std::sqrt(std::max(0.0, mean.dot(P * mean)));
}

}  // namespace internal

std::optional<MountingEstimate> estimate_mounting(LapBundle& lap, int max_iterations,
                                                  const BundleProgress& progress,
                                                  const std::optional<MountingAssumption>& given) {
  if (lap.bundle.odometry.empty()) return std::nullopt;
  BundlePose& cam = lap.bundle.poses[lap.cam];
  constexpr double kSlip_s = 0.1;
  constexpr double kCameraLatency_s = 0.1;
  constexpr double kTurnLead_s = 0.03;
  constexpr double kYawBias_rad_s = 0.02;
  for (BundleScales& scales : lap.bundle.odometry_scales)
    scales.sigma = {scales.sigma.distance, scales.sigma.yaw, kSlip_s,
                    kCameraLatency_s,      kTurnLead_s,      kYawBias_rad_s};
  const MountingAssumption assumption = given.value_or(MountingAssumption{.base_T_cam = cam.value});
  if (cam.fixed) {
    cam.fixed = false;
    loosen_heights(lap.bundle);
    lap.bundle.priors.push_back({lap.cam, prior_of(assumption)});
  }
  if (assumption.focal_share > 0 && lap.bundle.intrinsics.empty())
    free_focal_length(assumption.focal_share, lap.bundle);
  const BundleSummary summary = solve(lap.bundle, {.max_iterations = max_iterations}, progress);
  if (!summary.usable()) return std::nullopt;
  MountingEstimate estimate{.base_T_cam = lap.bundle.poses[lap.cam].value, .camera = lap.bundle.cameras[0]};
  const BundleCovariance known = covariance(lap.bundle);
  estimate.scales = lap.bundle.odometry_scales[0].value;
  estimate.scales_sigma = OdometryScales::of(known.scales[0].diagonal().cwiseMax(0.0).cwiseSqrt());
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, known.poses[lap.cam]});
  estimate.sigma = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  read_focal_length(lap.bundle, known, estimate);
  estimate.off = between(assumption.base_T_cam, estimate.base_T_cam);
  for (int i = 0; i < 6; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const bool held = i == kHeight || assumption.trusted[at];
    estimate.out[at] = !held && is_significant(estimate.off, estimate.sigma, i);
    estimate.unobservable[at] = held || (!estimate.out[at] && estimate.sigma[i] > kUsualAccuracy[at]);
  }
  return estimate;
}

}  // namespace waymark

namespace waymark::internal {
namespace {

/// The frame before which half of the observations in use were made.
std::size_t middle_frame(const LapBundle& lap) {
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < lap.observations.size(); ++i) {
    if (lap.bundle.corners[i].used) frames.push_back(lap.observations[i].frame);
  }
  if (frames.empty()) return 0;
  const auto middle = frames.begin() + std::ssize(frames) / 2;
  std::ranges::nth_element(frames, middle);
  return *middle;
}

/// Whether any observed tag is fixed by something other than the frames in which it was observed.
bool is_placed(const Bundle& bundle) {
  std::vector<char> known(bundle.poses.size(), 0);
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = bundle.poses[i].fixed ? 1 : 0;
  for (const PriorTerm& term : bundle.priors) known[term.pose] = 1;
  for (const PairPriorTerm& term : bundle.pair_priors) known[term.a] = known[term.b] = 1;
  return std::ranges::any_of(bundle.corners,
                             [&](const CornerTerm& term) { return term.used && known[term.tag] != 0; });
}

/// Fixes the first pose of a half of the lap. If none of its tags is known, its pose on the floor is
/// otherwise arbitrary.
void fix_pose_on_floor(PoseIndex base, Bundle& bundle) {
  constexpr double kFixed = 1e-6;
  Vector6 weight = Vector6::Zero();
  weight[0] = weight[1] = weight[5] = 1 / kFixed;
  bundle.priors.push_back({base, {bundle.poses[base].value, weight.asDiagonal()}});
}

/// The part of a lap from frame `first` up to, but not including, frame `last`. Poses keep their indices.
LapBundle part_of(const LapBundle& lap, std::size_t first, std::size_t last) {
  std::vector<char> within(lap.bundle.poses.size(), 0);
  std::optional<PoseIndex> start;
  for (std::size_t i = first; i < last; ++i) {
    if (!lap.bases[i]) continue;
    within[*lap.bases[i]] = 1;
    if (!start) start = lap.bases[i];
  }
  const Bundle& all = lap.bundle;
  LapBundle part{.cam = lap.cam, .floor = lap.floor};
  part.bundle = {.cameras = all.cameras,
                 .intrinsics = all.intrinsics,
                 .poses = all.poses,
                 .odometry_scales = all.odometry_scales,
                 .sizes = all.sizes,
                 .common_size = all.common_size,
                 .priors = all.priors,
                 .pair_priors = all.pair_priors};
  std::ranges::copy_if(all.corners, std::back_inserter(part.bundle.corners),
                       [&](const CornerTerm& term) { return term.used && within[term.rig] != 0; });
  std::ranges::copy_if(all.odometry, std::back_inserter(part.bundle.odometry),
                       [&](const OdometryTerm& term) { return within[term.a] != 0 && within[term.b] != 0; });
  std::ranges::copy_if(all.on_floor, std::back_inserter(part.bundle.on_floor),
                       [&](const OnFloorTerm& term) { return within[term.base] != 0; });
  if (start && !is_placed(part.bundle)) fix_pose_on_floor(*start, part.bundle);
  return part;
}

/// The decrease in the cost of the observations from which `own` was estimated if the value is `others`
/// instead of zero.
double gain(double own, double sigma, double others) {
  const double off = own - others;
  return (own * own - off * off) / (sigma * sigma);
}

std::array<bool, 6> confirmed_by_halves(const LapBundle& freed, const SE3& assumed, int max_iterations,
                                        const BundleProgress& progress) {
  constexpr double kMinGainOfHalves = 4;  // decrease in chi-square, summed over both halves
  std::array<bool, 6> confirmed{};
  const std::size_t middle = middle_frame(freed);
  const auto estimate = [&](std::size_t first, std::size_t last) {
    LapBundle part = part_of(freed, first, last);
    return estimate_mounting(part, max_iterations, progress, MountingAssumption{.base_T_cam = assumed});
  };
  const auto before = estimate(0, middle);
  if (!before) return confirmed;
  const auto after = estimate(middle, freed.bases.size());
  if (!after) return confirmed;
  for (int i = 0; i < 6; ++i) {
    const double gained = gain(before->off[i], before->sigma[i], after->off[i]) +
                          gain(after->off[i], after->sigma[i], before->off[i]);
    confirmed[static_cast<std::size_t>(i)] = gained > kMinGainOfHalves;
  }
  return confirmed;
}

}  // namespace

void find_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress) {
  // Sufficient to estimate three variances to within a few per cent each.
  constexpr std::size_t kMaxFrames = 3000;
  if (lap.bases.size() <= kMaxFrames) {
    fit_odometry_noise(lap, max_iterations, progress);
    return;
  }
  const std::size_t first = (lap.bases.size() - kMaxFrames) / 2;
  LapBundle part = part_of(lap, first, first + kMaxFrames);
  const OdometryNoise noise = fit_odometry_noise(part, max_iterations, progress);
  for (OdometryTerm& term : lap.bundle.odometry)
    term.factor.whitening = noise.cwiseInverse().asDiagonal() * term.factor.whitening;
}

void keep_confirmed(LapBundle& freed, const SE3& assumed, int max_iterations, const BundleProgress& progress,
                    MountingEstimate& mounting) {
  if (!mounting.any_significant()) return;
  const std::array<bool, 6> halves = confirmed_by_halves(freed, assumed, max_iterations, progress);
  const auto keep = [&](const std::array<bool, 6>& out) {
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const bool kept = out[i] && halves[i];
      mounting.unobservable[i] = !kept && (mounting.unobservable[i] || mounting.out[i]);
      mounting.out[i] = kept;
    }
  };
  const std::array<bool, 6> first = mounting.out;
  keep(first);
  if (!mounting.any_significant()) return;
  find_odometry_noise(freed, max_iterations, progress);
  const MountingAssumption assumption{.base_T_cam = assumed};
  // With the estimated odometry noise, additional parameters may become significant.
  if (const auto again = estimate_mounting(freed, max_iterations, progress, assumption)) keep(again->out);
}

namespace {

/// Divides the base poses into `count` consecutive parts of equal size. Each tag belongs to the part that
/// contains most of its observations.
std::vector<int> stretches_of(const LapBundle& lap, int count) {
  std::vector<int> stretch(lap.bundle.poses.size(), -1);
  const std::vector<PoseIndex> bases = lap.base_poses();
  for (std::size_t i = 0; i < bases.size(); ++i)
    stretch[bases[i]] = static_cast<int>(i * static_cast<std::size_t>(count) / bases.size());
  std::map<PoseIndex, std::map<int, int>> seen;
  for (const CornerTerm& term : lap.bundle.corners) {
    if (term.used && stretch[term.rig] >= 0) ++seen[term.tag][stretch[term.rig]];
  }
  for (const auto& [tag, counts] : seen)
    stretch[tag] =
        std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
  return stretch;
}

Vector6 deviations(const Matrix6& P) { return P.diagonal().cwiseMax(0.0).cwiseSqrt(); }

}  // namespace

void spread_by_stretches(const LapBundle& lap, MountingEstimate& estimate) {
  constexpr int kStretches = 32;
  const auto spread =
      stretch_covariance(lap.bundle, {.pose = lap.cam, .stretch = stretches_of(lap, kStretches)});
  if (!spread) return;
  estimate.scales_sigma = OdometryScales::of(deviations(spread->scales));
  estimate.sigma = deviations(coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, spread->pose}));
  // A tag printed in a wrong size has the same error in every stretch in which it is observed.
  if (spread->intrinsics.size() > 0)
    estimate.focal_scale_sigma =
        std::max(estimate.focal_scale_sigma, focal_scale_sigma(lap.bundle, spread->intrinsics));
}

}  // namespace waymark::internal
