#include "waymark/mapping/lap/corner_noise.hpp"

#include <cmath>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"

namespace waymark::internal {
namespace {

constexpr double kNumbers = 8;  // of an observation

/// Of chi-square (Wilson and Hilferty, "The Distribution of Chi-Square", PNAS 17, 1931).
double median_chi2(double freedom) { return freedom * std::pow(1 - 2 / (9 * freedom), 3); }

/// trace(J P J^T) of a term's base and tag.
double used_up(const CornerTerm& term, const Bundle& bundle, const BundleCovariance& P,
               const Matrix6& P_rig_tag) {
  CornerJacobians J;
  J.wants_cam = J.wants_body = false;
  const CornerPoses poses{bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                          bundle.poses[term.body].value, bundle.poses[term.tag].value};
  if (!corner_residual(term.factor, bundle.cameras[term.camera], poses, &J)) return 0;
  return (J.rig * P.poses[term.rig]).cwiseProduct(J.rig).sum() +
         (J.tag * P.poses[term.tag]).cwiseProduct(J.tag).sum() +
         2 * (J.rig * P_rig_tag).cwiseProduct(J.tag).sum();
}

}  // namespace

std::vector<double> freedom_left(const LapBundle& lap) {
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const CornerTerm& term : lap.bundle.corners) {
    if (term.used) pairs.emplace_back(term.rig, term.tag);
  }
  const BundleCovariance P = covariance(lap.bundle, pairs);
  std::vector<double> freedom(lap.bundle.corners.size(), kNumbers);
  std::size_t pair = 0;
  for (std::size_t i = 0; i < freedom.size(); ++i) {
    const CornerTerm& term = lap.bundle.corners[i];
    if (term.used) freedom[i] -= used_up(term, lap.bundle, P, P.pairs[pair++]);
  }
  return freedom;
}

double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& freedom) {
  constexpr std::size_t kEnough = 50;
  constexpr double kLeast = 2;  // of a tag alone in its frame hardly anything is left
  std::vector<double> ratios;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (std::isfinite(chi2[i]) && freedom[i] > kLeast) ratios.push_back(chi2[i] / median_chi2(freedom[i]));
  }
  if (ratios.size() < kEnough) return 1;
  return std::sqrt(median(std::move(ratios)));
}

double frames_that_count_as_one(const LapBundle& lap) {
  std::vector<std::size_t> frames;
  frames.reserve(lap.observations.size());
  for (const LapBundle::Observation& seen : lap.observations) frames.push_back(seen.frame);
  return correlated_frames(lap.bundle, frames);
}

void scale_noise(Bundle& bundle, double ratio) {
  for (CornerTerm& term : bundle.corners) term.factor.whitening /= ratio;
}

}  // namespace waymark::internal
