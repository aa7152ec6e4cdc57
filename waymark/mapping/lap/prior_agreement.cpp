#include "waymark/mapping/lap/prior_agreement.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"
#include "waymark/mapping/lap/printed_tags.hpp"
#include "waymark/pose/agreement.hpp"

namespace waymark::internal {
namespace {

constexpr double kPrinted_m = 0.0005;  ///< paper, glue and the detector's own error; it lasts
constexpr double kFarthest_m = 0.5;

using Matrices = std::map<PoseIndex, Matrix6>;

Matrix6 print_of(const Matrices& printed, const LapBundle& lap, const TagId& tag) {
  const auto pose = lap.tags.find(tag);
  const auto at = pose != lap.tags.end() ? printed.find(pose->second) : printed.end();
  return at != printed.end() ? at->second : Matrix6::Zero();
}

/// How far the lap has a tag, which may be wrong by `P`, from where the map has it: squared, by what both may
/// be wrong by.
double distance2(const SE3& map_T_tag, const Matrix6& P, const MappedTag& before) {
  const Matrix6 slack = 1e-6 * Matrix6::Identity();  // a millimetre, a milliradian
  const Vector6 off = minus(map_T_tag, before.map_T_tag);
  const Matrix6 S = P + before.covariance.value_or(Matrix6::Zero()) + slack;
  return off.dot(S.llt().solve(off));
}

std::string contradiction(const TagId& tag, const SE3& now, const SE3& before) {
  return fmt::format(
      "{} stands {:.0f} mm and {:.1f} deg from where the map has it, more than both can be wrong by: it was "
      "moved, and the map has its new place",
      to_string(tag), 1000 * (now.translation() - before.translation()).norm(),
      to_degrees((now.rotation().inverse() * before.rotation()).angle()));
}

void tell(const LapPrior& prior, const LapBundle& lap, TiedPrior& tied) {
  tied.words.clear();
  for (const ComparedTag& compared : tied.comparison.tags) {
    if (compared.change == TagChange::Swapped && compared.tag < *compared.with)
      tied.words.push_back(fmt::format("{} and {} are swapped against the map that is extended",
                                       to_string(compared.tag), to_string(*compared.with)));
    if (std::ranges::find(tied.moved, compared.tag) != tied.moved.end())
      tied.words.push_back(contradiction(compared.tag, lap.bundle.poses[lap.tags.at(compared.tag)].value,
                                         prior.map.find(compared.tag)->map_T_tag));
  }
}

/// What the prior map knows of a tag is said of this pose from now on.
void say_of(PoseIndex pose, const TagId& tag, LapBundle& lap, TiedPrior& tied) {
  for (RelativeTerm& term : lap.bundle.relatives) term.b = term.b == tied.before.at(tag) ? pose : term.b;
  tied.before[tag] = pose;
}

bool tie_more(const LapPrior& prior, const Matrices& printed, const BundleCovariance& known, LapBundle& lap,
              TiedPrior& tied) {
  const auto agrees = [&](const TagId& tag) {
    const PoseIndex pose = lap.tags.at(tag);
    const SE3& map_T_tag = lap.bundle.poses[pose].value;
    const MappedTag& before = *prior.map.find(tag);
    return !tied.untied.contains(tag) &&
           (map_T_tag.translation() - before.map_T_tag.translation()).norm() < kFarthest_m &&
           distance2(map_T_tag, known.poses[pose] + print_of(printed, lap, tag), before) < kPoseGate;
  };
  const auto now = std::ranges::stable_partition(tied.moved, std::not_fn(agrees));
  for (const TagId& tag : now) {
    const PoseIndex own = lap.tags.at(tag);
    BundlePose& pose = lap.bundle.poses[own];
    pose.fixed = is_held(prior, tag, *prior.map.find(tag));
    if (pose.fixed) pose.value = prior.map.find(tag)->map_T_tag;
    lap.bundle.poses[tied.before.at(tag)].fixed = true;  // nothing is said of it any more
    say_of(own, tag, lap, tied);
    tied.agreeing.push_back(tag);
  }
  const bool more = !now.empty();
  tied.moved.erase(now.begin(), now.end());
  return more;
}

/// The same of a tied tag by what lap and other tags say: its own place in the map is taken out of the
/// estimate (its information subtracted). 0 where nothing is left.
double distance2_without(const TagId& tag, const MappedTag& before, const Matrix6& of_print,
                         const BundleCovariance& known, const LapBundle& lap) {
  const PoseIndex pose = lap.tags.at(tag);
  if (lap.bundle.poses[pose].fixed || !before.covariance) return 0;
  const Matrix6& P = known.poses[pose];
  const Eigen::LLT<Matrix6> told(*before.covariance - P);
  if (told.info() != Eigen::Success) return 0;
  const Vector6 off = minus(lap.bundle.poses[pose].value, before.map_T_tag);
  const Vector6 off_without = *before.covariance * told.solve(off);
  const Matrix6 P_without = *before.covariance * told.solve(P);
  return distance2(SE3::exp(off_without) * before.map_T_tag, P_without + of_print, before);
}

bool untie_worst(const LapPrior& prior, const Matrices& printed, const BundleCovariance& known,
                 LapBundle& lap, TiedPrior& tied) {
  std::vector<double> off;
  off.reserve(tied.agreeing.size());
  for (const TagId& tag : tied.agreeing)
    off.push_back(distance2_without(tag, *prior.map.find(tag), print_of(printed, lap, tag), known, lap));
  const auto worst = std::ranges::max_element(off);
  if (worst == off.end() || *worst < kPoseGate) return false;
  const auto at = tied.agreeing.begin() + (worst - off.begin());
  say_of(lap.bundle.add(prior.map.find(*at)->map_T_tag), *at, lap, tied);
  tied.untied.insert(*at);
  tied.moved.push_back(*at);
  tied.agreeing.erase(at);
  return true;
}

}  // namespace

bool is_measured(const TagMap& map) {
  return std::ranges::all_of(map.tags,
                             [](const auto& tag) { return tag.second.covariance && !tag.second.tie; });
}

bool is_held(const LapPrior& prior, const TagId& tag, const MappedTag& mapped) {
  return prior.frozen.contains(tag) || !mapped.covariance;
}

bool stands_where_it_was(const MapComparison& comparison, const TagId& tag) {
  const auto at = std::ranges::find(comparison.tags, tag, &ComparedTag::tag);
  return at != comparison.tags.end() && (at->change == TagChange::Same || at->change == TagChange::Resized);
}

void find_agreeing(const LapPrior& prior, const TagMap& now, const LapBundle& lap, const TagId& anchor,
                   const BundleCovariance& known, TiedPrior& tied) {
  // The lap stands on the anchor as the prior map has it: what is wrong with that moves all the others, the
  // more the farther they are.
  const MappedTag* stands_on = prior.map.find(anchor);
  const Matrix6 of_anchor =
      stands_on != nullptr ? stands_on->covariance.value_or(Matrix6::Zero()) : Matrix6::Zero();
  const bool measured = is_measured(prior.map);
  for (const ComparedTag& compared : tied.comparison.tags) {
    const MappedTag* before = prior.map.find(compared.tag);
    if (before == nullptr || now.find(compared.tag) == nullptr || compared.change == TagChange::Swapped)
      continue;
    const PoseIndex pose = lap.tags.at(compared.tag);
    const bool agrees = measured ? stands_where_it_was(tied.comparison, compared.tag)
                                 : compared.distance_m < kFarthest_m &&
                                       distance2(lap.bundle.poses[pose].value, known.poses[pose] + of_anchor,
                                                 *before) < kPoseGate;
    (agrees ? tied.agreeing : tied.moved).push_back(compared.tag);
  }
  tell(prior, lap, tied);
}

bool revise_agreement(const LapPrior& prior, LapBundle& lap, TiedPrior& tied) {
  bool changed = false;
  if (is_measured(prior.map)) {
    const BundleCovariance known = covariance(lap.bundle);
    const Matrices printed = covariance_of_print(lap.bundle, kPrinted_m);
    changed = tie_more(prior, printed, known, lap, tied) || untie_worst(prior, printed, known, lap, tied);
  }
  tell(prior, lap, tied);  // by where the poses are now
  return changed;
}

}  // namespace waymark::internal
