#include <algorithm>
#include <array>
#include <cmath>

#include "waymark/mapping/scene/place_poses.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark {
namespace {

using internal::Hypothesis;
using internal::Role;
using internal::Vote;

constexpr std::size_t kMostVotes = 120;

struct Appearance {
  std::size_t term = 0;
  Role role = Role::Rig;
};

double loss(const Bundle& bundle, const CornerTerm& term, double good_chi2) {
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera],
                                 {bundle.poses[term.rig].value, bundle.poses[term.cam].value,
                                  bundle.poses[term.body].value, bundle.poses[term.tag].value});
  // Out of sight is as bad as it gets.
  return std::log1p((r ? r->squaredNorm() : 1e12) / good_chi2);
}

std::vector<Vote<SE3>> votes_for(const Bundle& bundle, const std::vector<Appearance>& where, std::size_t most,
                                 const PlaceOptions& options) {
  std::vector<Vote<SE3>> votes;
  for (const Appearance& at : where) {
    if (votes.size() >= most) break;
    const CornerTerm& term = bundle.corners[at.term];
    std::array<std::vector<Hypothesis>, 4> values;
    std::array<const std::vector<Hypothesis>*, 4> sets{};
    for (std::size_t i = 0; i < 4; ++i) {
      values[i] = {{bundle.poses[pose_of(term, static_cast<Role>(i))].value, 1e-4 * Matrix6::Identity(), 0}};
      sets[i] = &values[i];
    }
    Vote<SE3> vote =
        vote_for(at.role, sets, internal::poses_of_square(bundle, term, options.corner_sigma_px));
    if (!vote.empty()) votes.push_back(std::move(vote));
  }
  return votes;
}

/// Where a pose explains its observations best: where it is, or any place one of them suggests.
bool better_place(Bundle& bundle, PoseIndex pose, const std::vector<Appearance>& where, bool moves,
                  double good_chi2, const PlaceOptions& options) {
  const auto total = [&] {
    double sum = 0;
    for (const Appearance& at : where) sum += loss(bundle, bundle.corners[at.term], good_chi2);
    return sum;
  };
  const SE3 before = bundle.poses[pose].value;
  SE3 best = before;
  double least = total();
  constexpr double kWorthIt = 1.0;
  const double enough = least - kWorthIt;
  const auto attempt = [&](const SE3& value) {
    bundle.poses[pose].value = value;
    const double now = total();
    if (now < least) {
      least = now;
      best = value;
    }
  };
  const std::vector<Vote<SE3>> votes = votes_for(bundle, where, moves ? 8 : kMostVotes, options);
  if (moves) {
    for (const Vote<SE3>& vote : votes) {
      for (const auto& alternative : vote) attempt(alternative.value);
    }
  }
  if (const auto agreed = internal::agree(votes, internal::kPoseGate)) attempt(agreed->value.mean);
  const bool better = least < enough;
  bundle.poses[pose].value = better ? best : before;
  return better;
}

}  // namespace

int replace_contradicted(Bundle& bundle, const std::vector<char>& placed, const std::vector<KnownPose>& known,
                         double good_chi2, const PlaceOptions& options) {
  std::vector<std::vector<Appearance>> appearances(bundle.poses.size());
  const auto can_count = [&](const CornerTerm& term) {
    return placed[term.rig] != 0 && placed[term.cam] != 0 && placed[term.body] != 0 && placed[term.tag] != 0;
  };
  std::vector<char> good(bundle.corners.size(), 0);
  for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    if (!can_count(term) || term.doubtful) continue;
    good[i] = loss(bundle, term, good_chi2) < std::log1p(1.0) ? 1 : 0;
    for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag})
      appearances[pose_of(term, role)].push_back({i, role});
  }
  int moved = 0;
  for (bool moves : {false, true}) {
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      if (bundle.poses[i].fixed || known[i].moves != moves || appearances[i].empty()) continue;
      const auto agreeing =
          std::ranges::count_if(appearances[i], [&](const Appearance& at) { return good[at.term] != 0; });
      if (2 * agreeing >= std::ssize(appearances[i])) continue;
      moved += better_place(bundle, i, appearances[i], moves, good_chi2, options) ? 1 : 0;
    }
  }
  for (CornerTerm& term : bundle.corners) term.used = can_count(term) && !term.doubtful;
  return moved;
}

}  // namespace waymark
