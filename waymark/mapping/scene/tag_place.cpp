#include "waymark/mapping/scene/tag_place.hpp"

#include <array>
#include <cstddef>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace waymark {

std::vector<const CornerTerm*> terms_beside_others(const SceneMap& map, std::size_t size) {
  std::map<std::pair<PoseIndex, PoseIndex>, std::set<PoseIndex>> tags_in_use;
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.used) tags_in_use[{term.rig, term.body}].insert(term.tag);
  }
  std::vector<const CornerTerm*> terms;
  for (const CornerTerm& term : map.problem.bundle.corners) {
    if (term.size != size || !map.is_placed(term)) continue;
    const auto others = tags_in_use.find({term.rig, term.body});
    if (others != tags_in_use.end() && others->second.size() > others->second.count(term.tag))
      terms.push_back(&term);
  }
  return terms;
}

TagSquares squares_of(const Bundle& bundle, const std::vector<const CornerTerm*>& terms) {
  constexpr double kSigmaPx = 0.5;
  TagSquares squares;
  squares.reserve(terms.size());
  for (const CornerTerm* term : terms) squares.push_back(internal::poses_of_square(bundle, *term, kSigmaPx));
  return squares;
}

namespace {

/// The votes for the pose of the terms' tag.
std::vector<internal::Vote<SE3>> votes_for_tag(const Bundle& bundle,
                                               const std::vector<const CornerTerm*>& terms,
                                               const TagSquares& squares) {
  const Matrix6 known = 1e-4 * Matrix6::Identity();
  std::vector<internal::Vote<SE3>> votes;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    std::array<std::vector<internal::Hypothesis>, 4> values;
    std::array<const std::vector<internal::Hypothesis>*, 4> sets{};
    for (std::size_t role = 0; role < 4; ++role) {
      const PoseIndex pose = internal::pose_of(*terms[i], static_cast<internal::Role>(role));
      values[role] = {{bundle.poses[pose].value, known, 0}};
      sets[role] = &values[role];
    }
    internal::Vote<SE3> vote = internal::vote_for(internal::Role::Tag, sets, squares[i]);
    if (!vote.empty()) votes.push_back(std::move(vote));
  }
  return votes;
}

}  // namespace

std::optional<SE3> agreed_place(const Bundle& bundle, const std::vector<const CornerTerm*>& terms,
                                const TagSquares& squares) {
  const auto votes = votes_for_tag(bundle, terms, squares);
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  if (!agreed || 2 * static_cast<std::ptrdiff_t>(agreed->votes) < std::ssize(votes)) return std::nullopt;
  return agreed->value.mean;
}

}  // namespace waymark
