#include "waymark/mapping/solver/tag_place.hpp"

#include <array>
#include <cstddef>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace waymark {

bool is_placed(const CornerTerm& term, const std::vector<char>& placed) {
  return placed.empty() ||
         (placed[term.rig] != 0 && placed[term.cam] != 0 && placed[term.body] != 0 && placed[term.tag] != 0);
}

std::vector<const CornerTerm*> terms_beside_others(const Bundle& bundle, const std::vector<char>& placed,
                                                   std::size_t size) {
  std::map<std::pair<PoseIndex, PoseIndex>, std::set<PoseIndex>> tags_in_use;
  for (const CornerTerm& term : bundle.corners) {
    if (term.used) tags_in_use[{term.rig, term.body}].insert(term.tag);
  }
  std::vector<const CornerTerm*> terms;
  for (const CornerTerm& term : bundle.corners) {
    if (term.size != size || !is_placed(term, placed)) continue;
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
    votes.push_back(internal::vote_for(internal::Role::Tag, sets, squares[i]));
  }
  return votes;
}

std::optional<SE3> agreed_place(const Bundle& bundle, const std::vector<const CornerTerm*>& terms,
                                const TagSquares& squares) {
  auto votes = votes_for_tag(bundle, terms, squares);
  std::erase_if(votes, [](const internal::Vote<SE3>& vote) { return vote.empty(); });
  const auto agreed = internal::agree(votes, internal::kPoseGate);
  if (!agreed || 2 * static_cast<std::ptrdiff_t>(agreed->votes) < std::ssize(votes)) return std::nullopt;
  return agreed->value.mean;
}

}  // namespace waymark
