#include "waymark/mapping/solver/tag_moves.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include <Eigen/Cholesky>

#include "waymark/mapping/solver/tag_place.hpp"

namespace waymark {
namespace {

constexpr int kMinTermsOfPlace = 4;

/// The normal equations of one tag's pose.
struct TagEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  int terms = 0;

  void add(const TagEquations& other) {
    information += other.information;
    gradient += other.gradient;
    terms += other.terms;
  }
  [[nodiscard]] TagEquations without(const TagEquations& part) const {
    return {information - part.information, gradient - part.gradient, terms - part.terms};
  }
  /// The step that minimises the squared residuals.
  [[nodiscard]] Vector6 step() const { return -information.ldlt().solve(gradient); }
  /// How much the squared residuals decrease with that step.
  [[nodiscard]] double gain() const { return -gradient.dot(step()); }
};

/// Large residuals count less, so that a few wrong observations do not decide.
TagEquations equations_of(const Bundle& bundle, const CornerTerm& term) {
  constexpr double kLargeChi2 = 26.1;  // 0.999 quantile of chi-square with 8 degrees of freedom
  CornerJacobians J;
  J.wants_rig = J.wants_cam = J.wants_body = false;
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term), &J);
  if (!r) return {};
  const double weight = std::min(1.0, std::sqrt(kLargeChi2 / r->squaredNorm()));
  return {weight * J.tag.transpose() * J.tag, weight * J.tag.transpose() * *r, 1};
}

/// The normal equations of a tag for each frame in which it was observed.
using FrameEquations = std::map<std::size_t, TagEquations>;

/// For each tag with a size in `sizes`.
std::map<std::size_t, FrameEquations> equations_of_tags(const Bundle& bundle, const std::vector<char>& placed,
                                                        const ObservationTimes& times,
                                                        const std::vector<std::size_t>& sizes) {
  std::vector<char> wanted(bundle.sizes.size(), 0);
  for (const std::size_t size : sizes) wanted[size] = 1;
  std::map<std::size_t, FrameEquations> tags;
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    if (!term.size || wanted[*term.size] == 0 || !is_placed(term, placed)) continue;
    tags[*term.size][times.frames[i]].add(equations_of(bundle, term));
  }
  return tags;
}

TagEquations sum_of(const FrameEquations& frames) {
  TagEquations all;
  for (const auto& [frame, equations] : frames) all.add(equations);
  return all;
}

std::vector<LikelyMove> possible_moves(const ObservationTimes& times, std::size_t size,
                                       const FrameEquations& frames) {
  const TagEquations all = sum_of(frames);
  const double gain_of_one_place = all.gain();
  std::vector<LikelyMove> moves;
  TagEquations before;
  std::size_t last = 0;
  for (const auto& [frame, equations] : frames) {
    const TagEquations after = all.without(before);
    const double gap_s = times.frame_s[frame] - times.frame_s[last];
    if (before.terms >= kMinTermsOfPlace && after.terms >= kMinTermsOfPlace && gap_s > 0 &&
        gap_s >= times.min_move_s)
      moves.push_back({size, last, frame, gap_s, before.gain() + after.gain() - gain_of_one_place});
    before.add(equations);
    last = frame;
  }
  return moves;
}

std::optional<LikelyMove> best_move(const ObservationTimes& times, std::size_t size,
                                    const FrameEquations& frames) {
  const std::vector<LikelyMove> moves = possible_moves(times, size, frames);
  const auto best = std::ranges::max_element(moves, {}, &LikelyMove::gain);
  constexpr double kMoreUnknowns = 6;
  const double terms = sum_of(frames).terms;
  if (best == moves.end() || best->gain < kMoreUnknowns * std::log(8 * terms) + 2 * std::log(terms))
    return std::nullopt;
  return *best;
}

/// Puts a pose where the votes of its terms agree. Otherwise, it takes one step from its present value.
void start_place(Bundle& bundle, const std::vector<char>& placed, std::size_t size, PoseIndex pose) {
  if (bundle.poses[pose].fixed) return;
  std::vector<const CornerTerm*> terms = terms_beside_others(bundle, placed, size);
  std::erase_if(terms, [&](const CornerTerm* term) { return term->tag != pose; });
  if (std::ssize(terms) >= kMinTermsOfPlace) {
    if (const auto place = agreed_place(bundle, terms, squares_of(bundle, terms))) {
      bundle.poses[pose].value = *place;
      return;
    }
  }
  TagEquations all;
  for (const CornerTerm& term : bundle.corners) {
    if (term.tag == pose && is_placed(term, placed)) all.add(equations_of(bundle, term));
  }
  if (all.terms > 0) bundle.poses[pose].value = SE3::exp(all.step()) * bundle.poses[pose].value;
}

}  // namespace

std::vector<LikelyMove> likely_moves(const Bundle& bundle, const std::vector<char>& placed,
                                     const ObservationTimes& times, const std::vector<std::size_t>& sizes) {
  std::vector<LikelyMove> moves;
  for (const auto& [size, frames] : equations_of_tags(bundle, placed, times, sizes)) {
    if (const auto move = best_move(times, size, frames)) moves.push_back(*move);
  }
  std::ranges::stable_sort(moves, std::greater<>{}, &LikelyMove::gain);
  return moves;
}

std::vector<LikelyMove> moves_to_try(const Bundle& bundle, const std::vector<char>& placed,
                                     const ObservationTimes& times, std::size_t size) {
  constexpr std::size_t kLongest = 2;
  const auto tags = equations_of_tags(bundle, placed, times, {size});
  if (tags.empty()) return {};
  std::vector<LikelyMove> moves = possible_moves(times, size, tags.begin()->second);
  if (moves.empty()) return {};
  const LikelyMove best = std::ranges::max(moves, {}, &LikelyMove::gain);
  std::ranges::stable_sort(moves, std::greater<>{}, &LikelyMove::gap_s);
  moves.resize(std::min(moves.size(), kLongest));
  if (std::ranges::find(moves, best.first_after, &LikelyMove::first_after) == moves.end())
    moves.push_back(best);
  return moves;
}

namespace {

/// The sizes of the tags that were most often observed together with another one.
std::vector<std::size_t> neighbours_of(const Bundle& bundle, const ObservationTimes& times,
                                       std::size_t size) {
  constexpr std::size_t kMaxNeighbours = 6;
  std::set<std::size_t> frames;
  const std::vector<CornerTerm>& corners = bundle.corners;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i].size == size) frames.insert(times.frames[i]);
  }
  std::map<std::size_t, int> together;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (corners[i].size && corners[i].size != size && frames.contains(times.frames[i]))
      ++together[*corners[i].size];
  }
  std::vector<std::size_t> neighbours;
  neighbours.reserve(together.size());
  for (const auto& [neighbour, images] : together) neighbours.push_back(neighbour);
  std::ranges::stable_sort(neighbours, std::greater<>{}, [&](std::size_t i) { return together.at(i); });
  neighbours.resize(std::min(neighbours.size(), kMaxNeighbours));
  return neighbours;
}

}  // namespace

std::vector<LikelyMove> moves_of_neighbours(const Bundle& bundle, const std::vector<char>& placed,
                                            const ObservationTimes& times, const LikelyMove& move) {
  std::vector<LikelyMove> moves;
  for (const auto& [size, frames] :
       equations_of_tags(bundle, placed, times, neighbours_of(bundle, times, move.size))) {
    std::vector<LikelyMove> possible = possible_moves(times, size, frames);
    std::erase_if(possible, [&](const LikelyMove& other) {
      return other.first_after <= move.last_before || other.last_before >= move.first_after;
    });
    const auto longest = std::ranges::max_element(possible, {}, &LikelyMove::gap_s);
    if (longest != possible.end()) moves.push_back(*longest);
  }
  return moves;
}

namespace {

/// Applies what is given about pose `from` to pose `to` of the same tag.
void move_given_facts(Bundle& bundle, PoseIndex from, PoseIndex to) {
  const auto change = [&](PoseIndex& pose) { pose = pose == from ? to : pose; };
  for (PriorTerm& prior : bundle.priors) change(prior.pose);
  for (PointDistanceTerm& term : bundle.point_distances) {
    change(term.a.tag);
    change(term.b.tag);
  }
  for (PointCoordinateTerm& term : bundle.point_coordinates) change(term.point.tag);
  for (DirectionTerm& term : bundle.directions) change(term.tag);
}

}  // namespace

SeparatedTag separate_earlier(Bundle& bundle, std::vector<char>& placed, const ObservationTimes& times,
                              const LikelyMove& move) {
  SeparatedTag tag{.move = move, .earlier = bundle.poses.size()};
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    CornerTerm& term = bundle.corners[i];
    if (term.size != move.size) continue;
    if (term.tag != tag.earlier) tag.later = term.tag;
    if (times.frames[i] < move.first_after) term.tag = tag.earlier;
  }
  bundle.poses.push_back(bundle.poses[tag.later]);
  bundle.poses[tag.later].fixed = false;
  move_given_facts(bundle, tag.later, tag.earlier);
  if (!placed.empty()) placed.push_back(1);
  start_place(bundle, placed, move.size, tag.earlier);
  start_place(bundle, placed, move.size, tag.later);
  return tag;
}

void join_again(Bundle& bundle, const SeparatedTag& tag) {
  for (CornerTerm& term : bundle.corners) {
    if (term.tag == tag.earlier) term.tag = tag.later;
  }
  move_given_facts(bundle, tag.earlier, tag.later);
  BundlePose& later = bundle.poses[tag.later];
  later.fixed = bundle.poses[tag.earlier].fixed;
  if (later.fixed) later.value = bundle.poses[tag.earlier].value;
  bundle.poses[tag.earlier].fixed = true;
}

MovedTag describe_move(const Bundle& bundle, const ObservationTimes& times, const SeparatedTag& separated,
                       const TagId& tag) {
  const SE3 change = bundle.poses[separated.earlier].value.inverse() * bundle.poses[separated.later].value;
  return {.tag = tag,
          .earlier = separated.earlier,
          .last_before_s = times.frame_s[separated.move.last_before],
          .first_after_s = times.frame_s[separated.move.first_after],
          .distance_m = change.translation().norm(),
          .angle_rad = change.rotation().log().norm()};
}

bool is_far(const MovedTag& moved) {
  constexpr double kMinDistance_m = 0.005;
  constexpr double kMinAngle_rad = 0.02;
  return moved.distance_m > kMinDistance_m || moved.angle_rad > kMinAngle_rad;
}

double cost_with_rejected(const Bundle& bundle, const std::vector<char>& placed, double outlier_chi2) {
  const auto rejected = std::ranges::count_if(bundle.corners, [&](const CornerTerm& term) {
    return !term.used && is_placed(term, placed) && !term.unconfirmed;
  });
  return cost(bundle) + static_cast<double>(rejected) * outlier_chi2 / 2;
}

double schwarz_criterion(double cost, double more_unknowns, std::ptrdiff_t observations) {
  return cost + more_unknowns / 2 * std::log(8 * static_cast<double>(observations));
}

}  // namespace waymark
