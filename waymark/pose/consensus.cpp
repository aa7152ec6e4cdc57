#include "waymark/pose/consensus.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "waymark/pose/growth.hpp"

namespace waymark::internal {
namespace {

/// Poses of the same tags nearer than this many standard deviations are one: the covariance of each covers
/// the other.
constexpr double kSamePoseSigmas = 1.0;

/// Distance of b from a in standard deviations of a.
double sigmas_apart(const Consensus& a, const Consensus& b) {
  const Vector6 xi = (b.cam_T_map * a.cam_T_map.inverse()).log();
  const std::optional<Cholesky6> cholesky = Cholesky6::of(a.covariance);
  return cholesky ? std::sqrt(xi.dot(cholesky->solve(xi))) : 0;
}

bool is_better(const Consensus& a, const Consensus& b) {
  return a.count != b.count ? a.count > b.count : a.chi2 < b.chi2;
}

void keep_if_new(std::vector<Consensus>& found, std::optional<Consensus> consensus) {
  if (!consensus) return;
  for (Consensus& known : found) {
    if (known.members == consensus->members && sigmas_apart(known, *consensus) < kSamePoseSigmas) {
      if (is_better(*consensus, known)) known = std::move(*consensus);
      return;
    }
  }
  found.push_back(std::move(*consensus));
}

}  // namespace

std::vector<Consensus> find_consensus(const CameraModel& camera, std::vector<Candidate>& candidates,
                                      const MultiTagOptions& options) {
  Growth growth(camera, candidates, options);
  std::vector<Consensus> found;
  for (std::size_t seed = 0; seed < candidates.size(); ++seed) {
    // A larger consensus holds a tag that the best one lacks, so only those need to propose.
    const auto best = std::min_element(found.begin(), found.end(), is_better);
    if (best != found.end() && best->members[seed] != 0) continue;
    for (const SE3& start : candidates[seed].cam_T_map) {
      std::optional<Consensus> grown = growth.from(seed, start);
      if (!grown || grown->members[seed] == 0) keep_if_new(found, growth.alone(seed, start));
      keep_if_new(found, std::move(grown));
    }
  }
  std::sort(found.begin(), found.end(), is_better);
  if (found.empty()) return found;
  // Poses of the same tags compare by likelihood; of different tags by their number alone: chi2 is of
  // different data.
  const Consensus best = found.front();
  std::erase_if(found, [&](const Consensus& c) {
    return c.count < best.count || (c.members == best.members && c.chi2 > best.chi2 + options.ambiguity_chi2);
  });
  return found;
}

}  // namespace waymark::internal
