#include "waymark/mapping/scene/moved_tags.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include <Eigen/Cholesky>

#include "waymark/mapping/scene/tag_place.hpp"

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
TagEquations equations_of(const SceneMap& map, const CornerTerm& term) {
  constexpr double kLargeChi2 = 26.1;  // 0.999 quantile of chi-square with 8 degrees of freedom
  CornerJacobians J;
  J.wants_rig = J.wants_cam = J.wants_body = false;
  const Bundle& bundle = map.problem.bundle;
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term), &J);
  if (!r) return {};
  const double weight = std::min(1.0, std::sqrt(kLargeChi2 / r->squaredNorm()));
  return {weight * J.tag.transpose() * J.tag, weight * J.tag.transpose() * *r, 1};
}

/// The normal equations of a tag for each frame in which it was observed.
using FrameEquations = std::map<std::size_t, TagEquations>;

/// For each tag with a size in `sizes`.
std::map<std::size_t, FrameEquations> equations_of_tags(const SceneMap& map,
                                                        const std::vector<std::size_t>& sizes) {
  std::vector<char> wanted(map.problem.bundle.sizes.size(), 0);
  for (const std::size_t size : sizes) wanted[size] = 1;
  std::map<std::size_t, FrameEquations> tags;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const CornerTerm& term = map.problem.bundle.corners[i];
    if (!term.size || wanted[*term.size] == 0 || !map.is_placed(term)) continue;
    tags[*term.size][map.observations.seen[i].frame].add(equations_of(map, term));
  }
  return tags;
}

TagEquations sum_of(const FrameEquations& frames) {
  TagEquations all;
  for (const auto& [frame, equations] : frames) all.add(equations);
  return all;
}

double seconds_between(const SceneRecording& recording, std::size_t from, std::size_t to) {
  return to_seconds(recording.frames[to].stamp - recording.frames[from].stamp);
}

std::vector<LikelyMove> possible_moves(const SceneRecording& recording, std::size_t size,
                                       const FrameEquations& frames) {
  constexpr double kLeastGap_s = 0.5;
  const TagEquations all = sum_of(frames);
  std::vector<LikelyMove> moves;
  TagEquations before;
  std::size_t last = 0;
  for (const auto& [frame, equations] : frames) {
    const TagEquations after = all.without(before);
    const double gap_s = seconds_between(recording, last, frame);
    if (before.terms >= kMinTermsOfPlace && after.terms >= kMinTermsOfPlace && gap_s >= kLeastGap_s)
      moves.push_back({size, last, frame, gap_s, before.gain() + after.gain() - all.gain()});
    before.add(equations);
    last = frame;
  }
  return moves;
}

std::optional<LikelyMove> best_move(const SceneRecording& recording, std::size_t size,
                                    const FrameEquations& frames) {
  const std::vector<LikelyMove> moves = possible_moves(recording, size, frames);
  const auto best = std::ranges::max_element(moves, {}, &LikelyMove::gain);
  constexpr double kMoreUnknowns = 6;
  const double terms = sum_of(frames).terms;
  if (best == moves.end() || best->gain < kMoreUnknowns * std::log(8 * terms) + 2 * std::log(terms))
    return std::nullopt;
  return *best;
}

/// Puts a pose where the votes of its terms agree. Otherwise, it takes one step from its present value.
void start_place(SceneMap& map, std::size_t size, PoseIndex pose) {
  Bundle& bundle = map.problem.bundle;
  if (bundle.poses[pose].fixed) return;
  std::vector<const CornerTerm*> terms = terms_beside_others(map, size);
  std::erase_if(terms, [&](const CornerTerm* term) { return term->tag != pose; });
  if (std::ssize(terms) >= kMinTermsOfPlace) {
    if (const auto place = agreed_place(bundle, terms, squares_of(bundle, terms))) {
      bundle.poses[pose].value = *place;
      return;
    }
  }
  TagEquations all;
  for (const CornerTerm& term : bundle.corners) {
    if (term.tag == pose && map.is_placed(term)) all.add(equations_of(map, term));
  }
  if (all.terms > 0) bundle.poses[pose].value = SE3::exp(all.step()) * bundle.poses[pose].value;
}

}  // namespace

std::vector<LikelyMove> likely_moves(const SceneRecording& recording, const SceneMap& map,
                                     const std::vector<std::size_t>& sizes) {
  std::vector<LikelyMove> moves;
  for (const auto& [size, frames] : equations_of_tags(map, sizes)) {
    if (const auto move = best_move(recording, size, frames)) moves.push_back(*move);
  }
  std::ranges::stable_sort(moves, std::greater<>{}, &LikelyMove::gain);
  return moves;
}

std::vector<LikelyMove> moves_to_try(const SceneRecording& recording, const SceneMap& map, std::size_t size) {
  constexpr std::size_t kLongest = 2;
  const auto tags = equations_of_tags(map, {size});
  if (tags.empty()) return {};
  std::vector<LikelyMove> moves = possible_moves(recording, size, tags.begin()->second);
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
std::vector<std::size_t> neighbours_of(const SceneMap& map, std::size_t size) {
  constexpr std::size_t kMaxNeighbours = 6;
  std::set<std::size_t> frames;
  const std::vector<SceneObservation>& seen = map.observations.seen;
  const std::vector<CornerTerm>& corners = map.problem.bundle.corners;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (corners[i].size == size) frames.insert(seen[i].frame);
  }
  std::map<std::size_t, int> together;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (corners[i].size && corners[i].size != size && frames.contains(seen[i].frame))
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

std::vector<LikelyMove> moves_of_neighbours(const SceneRecording& recording, const SceneMap& map,
                                            const LikelyMove& move) {
  std::vector<LikelyMove> moves;
  for (const auto& [size, frames] : equations_of_tags(map, neighbours_of(map, move.size))) {
    std::vector<LikelyMove> possible = possible_moves(recording, size, frames);
    std::erase_if(possible, [&](const LikelyMove& other) {
      return other.first_after <= move.last_before || other.last_before >= move.first_after;
    });
    const auto longest = std::ranges::max_element(possible, {}, &LikelyMove::gap_s);
    if (longest != possible.end()) moves.push_back(*longest);
  }
  return moves;
}

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

SeparatedTag separate_earlier(SceneMap& map, const LikelyMove& move) {
  Bundle& bundle = map.problem.bundle;
  SeparatedTag tag{.move = move, .earlier = bundle.poses.size()};
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    CornerTerm& term = bundle.corners[i];
    if (term.size != move.size) continue;
    if (term.tag != tag.earlier) tag.later = term.tag;
    if (map.observations.seen[i].frame < move.first_after) term.tag = tag.earlier;
  }
  bundle.poses.push_back(bundle.poses[tag.later]);
  bundle.poses[tag.later].fixed = false;
  move_given_facts(bundle, tag.later, tag.earlier);
  map.placed.push_back(1);
  map.problem.moves.push_back(0);
  start_place(map, move.size, tag.earlier);
  start_place(map, move.size, tag.later);
  return tag;
}

void join_again(SceneMap& map, const SeparatedTag& tag) {
  Bundle& bundle = map.problem.bundle;
  for (CornerTerm& term : bundle.corners) {
    if (term.tag == tag.earlier) term.tag = tag.later;
  }
  move_given_facts(bundle, tag.earlier, tag.later);
  BundlePose& later = bundle.poses[tag.later];
  later.fixed = bundle.poses[tag.earlier].fixed;
  if (later.fixed) later.value = bundle.poses[tag.earlier].value;
  bundle.poses[tag.earlier].fixed = true;
}

MovedTag describe_move(const SceneRecording& recording, const SceneMap& map, const SeparatedTag& tag) {
  MovedTag moved{.earlier = tag.earlier};
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const SceneObservation& seen = map.observations.seen[i];
    if (map.problem.bundle.corners[i].tag == tag.later)
      moved.tag = map.scene.bodies[seen.body].tags[seen.tag].id;
  }
  moved.last_before_s = seconds_between(recording, 0, tag.move.last_before);
  moved.first_after_s = seconds_between(recording, 0, tag.move.first_after);
  const std::vector<BundlePose>& poses = map.problem.bundle.poses;
  const SE3 change = poses[tag.earlier].value.inverse() * poses[tag.later].value;
  moved.distance_m = change.translation().norm();
  moved.angle_rad = change.rotation().log().norm();
  return moved;
}

const MovedTag* find_moved(const SceneMap& map, const TagId& tag) {
  const auto moved = std::ranges::find(map.moved_tags, tag, &MovedTag::tag);
  return moved == map.moved_tags.end() ? nullptr : &*moved;
}

}  // namespace waymark
