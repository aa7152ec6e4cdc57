#include "waymark/mapping/solver/tag_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "waymark/mapping/solver/tag_place.hpp"

namespace waymark {
namespace {

constexpr double kReleasedSigma = 0.2;
constexpr double kTags = 4;

}  // namespace

std::vector<SizeEstimate> size_estimates(const Bundle& bundle, const BundleCovariance& covariance) {
  constexpr double kLeastInformation = 1e-3;  // share of the prior's variance that the observations remove
  std::vector<SizeEstimate> estimates;
  for (std::size_t i = 0; i < bundle.sizes.size(); ++i) {
    const double prior = bundle.sizes[i].sigma * bundle.sizes[i].sigma;
    const double posterior = covariance.size_deviations[i];
    const double removed = prior - posterior;
    if (!(posterior > 0) || removed < kLeastInformation * prior) continue;
    const double variance = prior * posterior / removed;
    estimates.push_back({i, (bundle.sizes[i].log_scale - bundle.common_size.log_scale) * prior / removed,
                         std::sqrt(variance), std::sqrt(variance + (covariance.sizes[i] - posterior))});
  }
  return estimates;
}

double size_spread(const std::vector<SizeEstimate>& estimates, double assumed_sigma) {
  constexpr double kSmallest = 0.1;  // of the assumed value
  constexpr double kLargest = 30;
  constexpr int kSteps = 100;
  const double assumed = assumed_sigma * assumed_sigma;
  double best = assumed_sigma;
  double most = -std::numeric_limits<double>::infinity();
  for (int step = 0; step <= kSteps; ++step) {
    const double sigma =
        assumed_sigma * kSmallest * std::pow(kLargest / kSmallest, static_cast<double>(step) / kSteps);
    const double variance = sigma * sigma;
    double log_likelihood = -kTags / 2 * (std::log(variance) + assumed / variance);
    for (const SizeEstimate& estimate : estimates) {
      const double total = variance + estimate.sigma * estimate.sigma;
      log_likelihood -= (std::log(total) + estimate.log_scale * estimate.log_scale / total) / 2;
    }
    if (log_likelihood <= most) continue;
    most = log_likelihood;
    best = sigma;
  }
  return best;
}

namespace {

double deviations(const SizeEstimate& estimate, double sigma) {
  return std::abs(estimate.log_scale) / std::hypot(sigma, estimate.sigma);
}

/// Whether a size deviates by more than three standard deviations, and by more than any of all sizes does by
/// chance in 99 maps of a hundred.
bool is_wrong(const SizeEstimate& estimate, double sigma, std::size_t sizes) {
  constexpr double kMinDeviations = 3;
  constexpr double kChance = 0.01;
  const double z = deviations(estimate, sigma);
  return z > kMinDeviations && static_cast<double>(sizes) * std::erfc(z / std::numbers::sqrt2) < kChance;
}

/// The estimate that contradicts a prior with this standard deviation most; nullptr if none does.
const SizeEstimate* worst_of(const std::vector<SizeEstimate>& estimates, double sigma) {
  const auto worst = std::ranges::max_element(
      estimates, {}, [&](const SizeEstimate& estimate) { return deviations(estimate, sigma); });
  return worst != estimates.end() && is_wrong(*worst, sigma, estimates.size()) ? &*worst : nullptr;
}

/// The size to be released next: a suspect, or the one that contradicts its prior most. `estimates` do not
/// contain those that are settled.
std::optional<std::size_t> next_size(const std::vector<SizeEstimate>& estimates, double assumed_sigma,
                                     const SizeSearch& search, const std::vector<std::size_t>& settled) {
  if (search.suspects) {
    for (const std::size_t size : search.suspects()) {
      if (std::ranges::find(settled, size) == settled.end()) return size;
    }
  }
  const SizeEstimate* worst = worst_of(estimates, assumed_sigma);
  if (worst == nullptr) return std::nullopt;
  // The worst one does not count for the spread by which it is judged.
  std::vector<SizeEstimate> others = estimates;
  others.erase(others.begin() + (worst - estimates.data()));
  worst = worst_of(estimates, std::max(assumed_sigma, size_spread(others, assumed_sigma)));
  if (worst == nullptr) return std::nullopt;
  return worst->size;
}

/// Releases the last of these sizes.
SizeCause release(Bundle& bundle, const SizeSearch& search, const std::vector<std::size_t>& released) {
  if (search.cause) return search.cause(released, kReleasedSigma);
  bundle.sizes[released.back()].sigma = kReleasedSigma;
  search.adjust();
  return SizeCause::Size;
}

}  // namespace

ReleasedSizes release_sizes(Bundle& bundle, double assumed_sigma, const SizeSearch& search) {
  ReleasedSizes result{.released = {}, .spread = assumed_sigma};
  std::vector<std::size_t> settled;  // released, or with another cause
  const auto is_free = [](const BundleSize& size) { return size.sigma > 0; };
  if (std::ranges::none_of(bundle.sizes, is_free)) return result;
  constexpr int kMaxUnexplained = 4;  // limits the time if something else is wrong
  int unexplained = 0;
  std::vector<SizeEstimate> estimates;
  while (true) {
    estimates = size_estimates(bundle, covariance(bundle));
    // A suspect that fits its given size once all its observations are used again was not wrong.
    const std::size_t right = std::erase_if(result.released, [&](std::size_t size) {
      const auto estimate = std::ranges::find(estimates, size, &SizeEstimate::size);
      const bool wrong = estimate != estimates.end() && is_wrong(*estimate, assumed_sigma, estimates.size());
      if (!wrong) bundle.sizes[size].sigma = assumed_sigma;
      return !wrong;
    });
    unexplained += static_cast<int>(right);
    std::erase_if(estimates, [&](const SizeEstimate& estimate) {
      return std::ranges::find(settled, estimate.size) != settled.end();
    });
    const auto size = next_size(estimates, assumed_sigma, search, settled);
    if (!size || unexplained >= kMaxUnexplained) break;
    settled.push_back(*size);
    result.released.push_back(*size);
    const SizeCause cause = release(bundle, search, result.released);
    if (cause == SizeCause::Size) continue;
    bundle.sizes[*size].sigma = assumed_sigma;
    result.released.pop_back();
    unexplained += cause == SizeCause::Unknown ? 1 : 0;
  }
  result.spread = size_spread(estimates, assumed_sigma);
  for (std::size_t i = 0; i < bundle.sizes.size(); ++i) {
    const bool released = std::ranges::find(result.released, i) != result.released.end();
    if (bundle.sizes[i].sigma > 0 && !released) bundle.sizes[i].sigma = result.spread;
  }
  if (!settled.empty()) search.adjust();
  return result;
}

bool SizeObservations::contradict() const {
  constexpr double kMaxRejectedShare = 0.3;
  constexpr double kMaxUnusedShare = 0.5;
  constexpr int kMinRejected = 4;
  return rejected + unconfirmed >= kMinRejected &&
         (rejected > kMaxRejectedShare * (used + rejected) || share_unused() > kMaxUnusedShare);
}

std::vector<SizeObservations> observations_by_size(const Bundle& bundle, const std::vector<char>& placed) {
  std::vector<SizeObservations> sizes(bundle.sizes.size());
  for (const CornerTerm& term : bundle.corners) {
    if (!term.size || !is_placed(term, placed)) continue;
    SizeObservations& of_tag = sizes[*term.size];
    ++(term.used ? of_tag.used : term.unconfirmed ? of_tag.unconfirmed : of_tag.rejected);
  }
  return sizes;
}

bool are_few_tags(std::size_t tags, const std::vector<SizeObservations>& observations) {
  constexpr std::size_t kMaxTags = 3;
  constexpr double kMaxShare = 0.25;
  const auto observed =
      std::ranges::count_if(observations, [](const SizeObservations& tag) { return tag.all() > 0; });
  return tags <= kMaxTags || static_cast<double>(tags) <= kMaxShare * static_cast<double>(observed);
}

std::vector<std::size_t> contradicted_sizes(const std::vector<SizeObservations>& observations) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    if (observations[i].contradict()) found.push_back(i);
  }
  if (!are_few_tags(found.size(), observations)) return {};
  std::ranges::stable_sort(found, std::greater<>{},
                           [&](std::size_t i) { return observations[i].share_unused(); });
  return found;
}

std::vector<char> sizes_that_fit(const Bundle& bundle, const std::vector<double>& chi2,
                                 const std::vector<SizeObservations>& observations) {
  constexpr int kMinUsed = 4;
  constexpr double kMaxRejectedShare = 0.05;
  constexpr double kMaxRatio = 1.25;
  constexpr double kSigmas = 3;
  std::vector<double> sums(bundle.sizes.size(), 0);
  double sum = 0;
  double count = 0;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (!bundle.corners[i].used) continue;
    if (bundle.corners[i].size) sums[*bundle.corners[i].size] += chi2[i];
    sum += chi2[i];
    ++count;
  }
  std::vector<char> fit(sums.size(), 0);
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double used = observations[i].used;
    if (used < kMinUsed || count <= used) continue;
    const double ratio = sums[i] / used / ((sum - sums[i]) / (count - used));
    const double max_ratio = kMaxRatio + kSigmas / std::sqrt(4 * used);  // chi-square with 8 dof each
    fit[i] = observations[i].share_unused() <= kMaxRejectedShare + 1 / used && ratio < max_ratio ? 1 : 0;
  }
  return fit;
}

std::optional<WrongSize> wrong_size(const TagId& tag, double given_m, std::size_t size, const Bundle& bundle,
                                    const std::vector<SizeEstimate>& estimates, double spread) {
  const auto estimate = std::ranges::find(estimates, size, &SizeEstimate::size);
  if (estimate == estimates.end()) return std::nullopt;
  const double found_m = given_m * std::exp(bundle.sizes[size].log_scale);
  return WrongSize{tag, given_m, found_m, estimate->side_sigma * found_m, deviations(*estimate, spread)};
}

}  // namespace waymark
