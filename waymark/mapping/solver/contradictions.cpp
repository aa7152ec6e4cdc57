#include "waymark/mapping/solver/contradictions.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "waymark/mapping/solver/tag_place.hpp"

namespace waymark {
namespace {

MovedTag move_of(SearchedMap& map, const SeparatedTag& tag) {
  return describe_move(map.bundle(), map.times(), tag, {});
}

/// Whether another tag of the same body is at one of the two poses of a tag, and the id was misread there.
bool is_misread_place(const Bundle& bundle, const SeparatedTag& tag, PoseIndex pose) {
  const auto of_pose = std::ranges::find(bundle.corners, pose, &CornerTerm::tag);
  if (of_pose == bundle.corners.end()) return false;
  const double side = side_m(bundle, *of_pose);
  std::set<PoseIndex> bodies;
  for (const CornerTerm& term : bundle.corners) {
    if (term.tag == pose) bodies.insert(term.body);
  }
  std::map<PoseIndex, int> used;
  for (const CornerTerm& term : bundle.corners) {
    if (term.used && bodies.contains(term.body)) ++used[term.tag];
  }
  const ObservedPose place{bundle.poses[pose].value, static_cast<double>(used[pose])};
  return std::ranges::any_of(used, [&](const auto& other) {
    return other.first != tag.earlier && other.first != tag.later &&
           is_misread(place, {bundle.poses[other.first].value, static_cast<double>(other.second)}, side);
  });
}

/// Whether the two places are those of one tag, and not of two or of another one.
bool may_have_moved(SearchedMap& map, const SeparatedTag& tag) {
  const MovedTag move = move_of(map, tag);
  return is_far(move) && map.are_of_one_tag(tag, move.distance_m) &&
         !is_misread_place(map.bundle(), tag, tag.earlier) && !is_misread_place(map.bundle(), tag, tag.later);
}

}  // namespace

ReleasedSizes ContradictionSearch::explain(double assumed_sigma) {
  ReleasedSizes sizes;
  if (assumed_sigma > 0)
    sizes = explain_by_sizes(assumed_sigma);
  else
    explain_exact_sizes();
  map_.end_attempts();
  join_unmoved_tags();
  return sizes;
}

ReleasedSizes ContradictionSearch::explain_by_sizes(double assumed_sigma) {
  const auto cause = [&](const std::vector<std::size_t>& released, double sigma) {
    const std::size_t size = released.back();
    const std::any before = map_.state();
    map_.bundle().sizes[size].sigma = sigma;
    map_.start_released(size);
    use_again(released);
    if (may_fit(size)) map_.adjust();
    return cause_of(size, before);
  };
  return release_sizes(map_.bundle(), assumed_sigma,
                       {[&] { return map_.suspects(); }, [&] { map_.adjust(); }, cause});
}

void ContradictionSearch::explain_exact_sizes() {
  constexpr int kMaxUnexplained = 4;  // limits the time if something else is wrong
  std::set<std::size_t> tried;
  int unexplained = 0;
  while (unexplained < kMaxUnexplained && map_.goes_on()) {
    const std::vector<std::size_t> sizes = map_.suspects();
    const auto next =
        std::ranges::find_if(sizes, [&](std::size_t size) { return tried.insert(size).second; });
    if (next == sizes.end()) break;
    unexplained += cause_of(*next, map_.state()) == SizeCause::Unknown ? 1 : 0;
  }
}

void ContradictionSearch::use_again(const std::vector<std::size_t>& sizes) {
  constexpr double kLargeChi2 = 20000;
  constexpr double kMediumChi2 = 200;
  for (CornerTerm& term : map_.bundle().corners) {
    const bool wanted = term.size && std::ranges::find(sizes, *term.size) != sizes.end();
    if (wanted && is_placed(term, map_.placed())) term.used = true;
  }
  map_.reinitialise();
  for (const double chi2 : {kLargeChi2, kMediumChi2, map_.robust_chi2()}) map_.find(chi2);
}

bool ContradictionSearch::may_fit(std::size_t size) {
  constexpr double kMaxShare = 0.2;
  map_.gate();
  return map_.goes_on() &&
         observations_by_size(map_.bundle(), map_.placed())[size].share_unused() < kMaxShare;
}

bool ContradictionSearch::fits(std::size_t size) const {
  const Bundle& bundle = map_.bundle();
  return sizes_that_fit(bundle, map_.chi2(), observations_by_size(bundle, map_.placed()))[size] != 0;
}

Explanation ContradictionSearch::explanation(double more_unknowns) const {
  return {.state = map_.state(), .noise = map_.noise(), .more_unknowns = more_unknowns};
}

SizeCause ContradictionSearch::cause_of(std::size_t size, const std::any& before) {
  if (map_.is_stopped()) return SizeCause::Unknown;
  std::vector<Explanation> explanations(1);
  if (map_.goes_on() && map_.bundle().sizes[size].sigma > 0 && fits(size)) {
    explanations.push_back(explanation(1));
    explanations.back().cause = SizeCause::Size;
  }
  const auto go_back = [&] { map_.go_to(before); };
  go_back();
  explanations.front() = explanation(0);
  explanations.front().cause = SizeCause::Unknown;
  for (const LikelyMove& move : moves_to_try(map_.bundle(), map_.placed(), map_.times(), size)) {
    go_back();
    if (auto moved = explain_by_move(move)) explanations.push_back(std::move(*moved));
  }
  map_.add_explanations(*this, size, go_back, explanations);
  if (map_.is_stopped()) return SizeCause::Unknown;
  Explanation best = best_of(std::move(explanations), size);
  if (best.move) best = move_among_neighbours(std::move(best), before);
  map_.go_to(std::move(best.state));
  if (best.move) map_.moves().push_back(*best.move);
  if (best.accept) best.accept();
  return best.cause;
}

std::optional<Explanation> ContradictionSearch::explain_by_move(const LikelyMove& move) {
  const auto is_same = [&](const SeparatedTag& tag) { return tag.move.size == move.size; };
  if (!map_.may_have_moved(move.size) || std::ranges::any_of(map_.moves(), is_same)) return std::nullopt;
  const SeparatedTag tag = map_.separate(move);
  use_again({move.size});
  if (!may_fit(move.size)) return std::nullopt;
  map_.adjust();
  if (!map_.goes_on() || !fits(move.size) || !may_have_moved(map_, tag)) return std::nullopt;
  Explanation moved = explanation(6);
  moved.move = tag;
  return moved;
}

/// The move of this tag or of a neighbour, whichever explains more. Images that show both follow the tag with
/// more observations, and contradict the other one.
Explanation ContradictionSearch::move_among_neighbours(Explanation found, const std::any& before) {
  const LikelyMove move = found.move->move;
  std::vector<Explanation> explanations;
  explanations.push_back(std::move(found));
  map_.go_to(before);
  for (const LikelyMove& other : moves_of_neighbours(map_.bundle(), map_.placed(), map_.times(), move)) {
    map_.go_to(before);
    if (auto moved = explain_by_move(other); moved && fits(move.size))
      explanations.push_back(std::move(*moved));
  }
  return best_of(std::move(explanations), move.size);
}

/// The most likely one, if corners have the smallest noise of all.
Explanation ContradictionSearch::best_of(std::vector<Explanation> explanations, std::size_t size) {
  map_.go_to(explanations.front().state);
  const auto n = std::ranges::count(map_.bundle().corners, std::optional(size), &CornerTerm::size);
  const double noise = std::ranges::min(explanations, {}, &Explanation::noise).noise;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = 0;
  for (std::size_t i = 0; i < explanations.size(); ++i) {
    map_.go_to(explanations[i].state);
    map_.set_noise(noise);
    map_.gate();
    const double criterion =
        schwarz_criterion(cost_with_rejected(map_.bundle(), map_.placed(), map_.outlier_chi2()),
                          explanations[i].more_unknowns, n);
    if (criterion < least) best = i;
    least = std::min(least, criterion);
  }
  return std::move(explanations[best]);
}

/// A move that later explanations made unnecessary is undone.
void ContradictionSearch::join_unmoved_tags() {
  if (!map_.goes_on()) return;
  const std::size_t joined = std::erase_if(map_.moves(), [&](const SeparatedTag& tag) {
    if (is_far(move_of(map_, tag))) return false;
    map_.join(tag);
    return true;
  });
  if (joined > 0) map_.adjust();
}

std::vector<std::size_t> sizes_of_moved_tags(const Bundle& bundle, const std::vector<char>& placed,
                                             const ObservationTimes& times,
                                             const std::vector<std::size_t>& sizes) {
  const std::vector<LikelyMove> moves = likely_moves(bundle, placed, times, sizes);
  if (!are_few_tags(moves.size(), observations_by_size(bundle, placed))) return {};
  std::vector<std::size_t> moved;
  moved.reserve(moves.size());
  for (const LikelyMove& move : moves) moved.push_back(move.size);
  return moved;
}

}  // namespace waymark
