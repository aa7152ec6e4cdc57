#include "waymark/mapping/lap/mounting_halves.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "waymark/mapping/lap/odometry_noise.hpp"

namespace waymark::internal {
namespace {

/// The frame at which half of the observations in use are past.
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

/// Whether a tag that was seen is held by something else than the frames that saw it.
bool is_placed(const Bundle& bundle) {
  std::vector<char> known(bundle.poses.size(), 0);
  for (std::size_t i = 0; i < known.size(); ++i) known[i] = bundle.poses[i].fixed ? 1 : 0;
  for (const PriorTerm& term : bundle.priors) known[term.pose] = 1;
  for (const PairPriorTerm& term : bundle.pair_priors) known[term.a] = known[term.b] = 1;
  return std::ranges::any_of(bundle.corners,
                             [&](const CornerTerm& term) { return term.used && known[term.tag] != 0; });
}

/// Where on the floor a half is does not matter: where none of its tags is known, its first pose is held.
void hold(PoseIndex base, Bundle& bundle) {
  constexpr double kHeld = 1e-6;
  Vector6 weight = Vector6::Zero();
  weight[0] = weight[1] = weight[5] = 1 / kHeld;
  bundle.priors.push_back({base, {bundle.poses[base].value, weight.asDiagonal()}});
}

/// A lap of the frames from `first` to before `last` alone; poses keep their indices.
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
                 .priors = all.priors,
                 .pair_priors = all.pair_priors};
  std::ranges::copy_if(all.corners, std::back_inserter(part.bundle.corners),
                       [&](const CornerTerm& term) { return term.used && within[term.rig] != 0; });
  std::ranges::copy_if(all.odometry, std::back_inserter(part.bundle.odometry),
                       [&](const OdometryTerm& term) { return within[term.a] != 0 && within[term.b] != 0; });
  std::ranges::copy_if(all.on_floor, std::back_inserter(part.bundle.on_floor),
                       [&](const OnFloorTerm& term) { return within[term.base] != 0; });
  if (start && !is_placed(part.bundle)) hold(*start, part.bundle);
  return part;
}

/// By how much the observations that found `own` cost less at what the others found than at zero.
double gain(double own, double sigma, double others) {
  const double off = own - others;
  return (own * own - off * off) / (sigma * sigma);
}

std::array<bool, 6> confirmed_by_halves(const LapBundle& freed, const SE3& assumed, int max_iterations,
                                        const BundleProgress& progress) {
  constexpr double kConvincing = 4;  // of chi-square, over both halves
  std::array<bool, 6> confirmed{};
  const std::size_t middle = middle_frame(freed);
  const auto estimate = [&](std::size_t first, std::size_t last) {
    LapBundle part = part_of(freed, first, last);
    return estimate_mounting(part, max_iterations, progress, MountingBelief{.base_T_cam = assumed});
  };
  const auto before = estimate(0, middle);
  if (!before) return confirmed;
  const auto after = estimate(middle, freed.bases.size());
  if (!after) return confirmed;
  for (int i = 0; i < 6; ++i) {
    const double gained = gain(before->off[i], before->sigma[i], after->off[i]) +
                          gain(after->off[i], after->sigma[i], before->off[i]);
    confirmed[static_cast<std::size_t>(i)] = gained > kConvincing;
  }
  return confirmed;
}

}  // namespace

void find_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress) {
  constexpr std::size_t kEnough = 3000;  // frames: three variances, each to a few percent
  if (lap.bases.size() <= kEnough) {
    fit_odometry_noise(lap, max_iterations, progress);
    return;
  }
  const std::size_t first = (lap.bases.size() - kEnough) / 2;
  LapBundle part = part_of(lap, first, first + kEnough);
  const OdometryNoise noise = fit_odometry_noise(part, max_iterations, progress);
  for (OdometryTerm& term : lap.bundle.odometry)
    term.factor.whitening = noise.cwiseInverse().asDiagonal() * term.factor.whitening;
}

void keep_confirmed(LapBundle& freed, const SE3& assumed, int max_iterations, const BundleProgress& progress,
                    MountingEstimate& mounting) {
  if (!mounting.stands_out()) return;
  const std::array<bool, 6> halves = confirmed_by_halves(freed, assumed, max_iterations, progress);
  const auto keep = [&](const std::array<bool, 6>& out) {
    for (std::size_t i = 0; i < halves.size(); ++i) {
      const bool kept = out[i] && halves[i];
      mounting.untold[i] = !kept && (mounting.untold[i] || mounting.out[i]);
      mounting.out[i] = kept;
    }
  };
  const std::array<bool, 6> first = mounting.out;
  keep(first);
  if (!mounting.stands_out()) return;
  find_odometry_noise(freed, max_iterations, progress);
  const MountingBelief belief{.base_T_cam = assumed};
  // With the noise that the wheels show, a number may stand out that did not before.
  if (const auto again = estimate_mounting(freed, max_iterations, progress, belief)) keep(again->out);
}

}  // namespace waymark::internal
