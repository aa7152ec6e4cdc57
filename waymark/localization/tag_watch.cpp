#include "waymark/localization/tag_watch.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr int kEnough = 15;     // contradictions, confirmed, that exclude
constexpr int kFitsAgain = 30;  // observations in a row that fit

}  // namespace

TagWatch::TagWatch(const Landmarks& landmarks)
    : landmarks_(landmarks), all_(static_cast<std::size_t>(landmarks.size())) {}

void TagWatch::Sums::add(const WatchedObservation& seen) {
  ++count;
  p += seen.map_p_implied;
  p2 += seen.map_p_implied.squaredNorm();
  ratio += seen.range_ratio;
  ratio2 += seen.range_ratio * seen.range_ratio;
  direction += std::abs(seen.off_direction_rad);
}

void TagWatch::Sums::add(const Sums& other) {
  count += other.count;
  p += other.p;
  p2 += other.p2;
  ratio += other.ratio;
  ratio2 += other.ratio2;
  direction += other.direction;
}

void TagWatch::add(const WatchedObservation& seen) {
  One& one = all_[static_cast<std::size_t>(seen.landmark)];
  ++one.seen;
  one.accepted_in_a_row = seen.accepted ? one.accepted_in_a_row + 1 : 0;
  if (seen.accepted) {
    ++one.accepted;
    one.nis_sum += seen.nis_per_row;
  } else {
    one.pending.add(seen);
  }
  if (one.excluded && one.accepted_in_a_row >= kFitsAgain) {
    one.excluded = false;
    one.wrong = {};
  }
}

void TagWatch::confirm() {
  for (One& one : all_) {
    if (one.pending.count == 0) continue;
    one.wrong.add(one.pending);
    one.pending = {};
    // A tag that mostly fits is misread now and then; that is what the gate is for.
    const bool mostly_wrong = one.wrong.count > one.accepted;
    if (one.wrong.count >= kEnough && mostly_wrong) one.excluded = true;
  }
}

void TagWatch::forget_pending() {
  for (One& one : all_) one.pending = {};
}

double TagWatch::mean_nis_per_row(int landmark) const {
  const One& one = at(landmark);
  return one.accepted > 0 ? one.nis_sum / one.accepted : 0;
}

std::string TagWatch::name(int landmark) const {
  const Landmark& it = landmarks_[landmark];
  return it.family_known ? to_string(it.tag) : fmt::format("tag {}", it.tag.number);
}

bool TagWatch::swapped(int a, int b) const {
  if (!at(a).excluded || !at(b).excluded) return false;
  const Eigen::Vector2d map_a = landmarks_[a].map_T_tag.translation().head<2>();
  const Eigen::Vector2d map_b = landmarks_[b].map_T_tag.translation().head<2>();
  const double tolerance_m = std::max(0.15, 0.4 * (map_a - map_b).norm());
  const Eigen::Vector2d seen_a = at(a).wrong.p / at(a).wrong.count;
  const Eigen::Vector2d seen_b = at(b).wrong.p / at(b).wrong.count;
  return (seen_a - map_b).norm() < tolerance_m && (seen_b - map_a).norm() < tolerance_m &&
         (seen_a - map_b).norm() < (seen_a - map_a).norm() &&
         (seen_b - map_a).norm() < (seen_b - map_b).norm();
}

std::string TagWatch::words(int landmark) const {
  const Sums& wrong = at(landmark).wrong;
  const Landmark& it = landmarks_[landmark];
  const double n = wrong.count;
  const Eigen::Vector2d mean = wrong.p / n;
  const double spread_m = std::sqrt(std::max(0.0, wrong.p2 / n - mean.squaredNorm()));
  const double moved_m = (mean - it.map_T_tag.translation().head<2>()).norm();
  const double ratio = wrong.ratio / n;
  const double ratio_spread = std::sqrt(std::max(0.0, wrong.ratio2 / n - ratio * ratio));
  const bool same_direction = wrong.direction / n < 0.05;
  // A wrong size is the same share of every distance; of a tag that hangs kilometres off it is not.
  const bool same_ratio = ratio_spread < 0.3 * std::min(std::abs(ratio - 1), ratio);
  if (it.size_m > 0 && same_direction && std::abs(ratio - 1) > 0.08 && same_ratio)
    return fmt::format(
        "{} seems to be {:.3f} m large, where the map says {:.3f} m: not used. Measure its black square, and "
        "correct its size in the map",
        name(landmark), it.size_m / ratio, it.size_m);
  if (spread_m < 0.5 * moved_m)
    return fmt::format(
        "{} hangs {:.2f} m from where the map says, near ({:.2f}, {:.2f}): not used. Hang it back, correct "
        "the map, or extend it with a lap that sees the tag",
        name(landmark), moved_m, mean.x(), mean.y());
  return fmt::format(
      "{} is seen in places that do not agree with each other (several tags with this number, or misread): "
      "not used. Give the others numbers of their own",
      name(landmark));
}

/// Seen where the map says and, about as often, at one other place.
std::optional<std::string> TagWatch::words_of_second(int landmark) const {
  const One& one = at(landmark);
  constexpr double kShare = 0.25;
  if (one.excluded || one.wrong.count < kEnough || one.wrong.count < kShare * one.seen) return std::nullopt;
  const Eigen::Vector2d mean = one.wrong.p / one.wrong.count;
  const double spread_m = std::sqrt(std::max(0.0, one.wrong.p2 / one.wrong.count - mean.squaredNorm()));
  const double apart_m = (mean - landmarks_[landmark].map_T_tag.translation().head<2>()).norm();
  if (spread_m > 0.5 * apart_m) return std::nullopt;
  return fmt::format(
      "{} is seen where the map says and {:.2f} m from there, near ({:.2f}, {:.2f}): two tags with this "
      "number, "
      "or it was moved during the drive. What is seen at the second place is not used. Give one of them "
      "another number",
      name(landmark), apart_m, mean.x(), mean.y());
}

std::vector<std::string> TagWatch::findings() const {
  std::vector<std::string> all;
  std::vector<bool> said(all_.size(), false);
  for (int a = 0; a < landmarks_.size(); ++a) {
    if (auto second = words_of_second(a)) all.push_back(std::move(*second));
    if (!at(a).excluded || said[static_cast<std::size_t>(a)]) continue;
    for (int b = a + 1; b < landmarks_.size(); ++b) {
      if (!swapped(a, b)) continue;
      all.push_back(
          fmt::format("{} and {} are swapped in the map, or on the wall: neither is used. Swap them back, or "
                      "extend the map with a lap that sees both",
                      name(a), name(b)));
      said[static_cast<std::size_t>(a)] = said[static_cast<std::size_t>(b)] = true;
    }
    if (!said[static_cast<std::size_t>(a)]) all.push_back(words(a));
  }
  return all;
}

}  // namespace waymark
