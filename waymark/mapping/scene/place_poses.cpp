#include "waymark/mapping/scene/place_poses.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>

#include <Eigen/LU>

#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

namespace waymark {
namespace {

using internal::Alternative;
using internal::Hypothesis;
using internal::Role;
using internal::Vote;

constexpr std::size_t kMaxFrameVotes = 8;     // maximum number of votes used for a frame
constexpr std::size_t kMaxStaticVotes = 120;  // maximum number of votes used for a static pose
constexpr double kRuledOutChi2 = 16;          // hypotheses with a larger excess are dropped

double size_px(const CornerTerm& term) {
  const auto& c = term.factor.corners_px;
  return std::max((c[2] - c[0]).norm(), (c[3] - c[1]).norm());
}

/// A term in which a pose appears, and its role there.
struct Appearance {
  std::size_t term = 0;
  Role role = Role::Rig;
};

class Placer {
 public:
  Placer(Bundle& bundle, const std::vector<KnownPose>& known, const PlaceOptions& options)
      : bundle_(bundle),
        known_(known),
        options_(options),
        hypotheses_(bundle.poses.size()),
        appearances_(bundle.poses.size()),
        motions_(bundle.poses.size()),
        carried_(bundle.poses.size(), 0),
        squares_(bundle.corners.size()),
        dirty_(bundle.poses.size(), 1),
        agreed_(bundle.poses.size()) {
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      if (bundle.poses[i].fixed || known[i].placed)
        hypotheses_[i] = {{bundle.poses[i].value, known[i].covariance, 0}};
    }
    for (std::size_t i = 0; i < bundle.corners.size(); ++i) {
      for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag})
        appearances_[pose_of(bundle.corners[i], role)].push_back({i, role});
    }
    for (std::size_t i = 0; i < bundle.relatives.size(); ++i) {
      motions_[bundle.relatives[i].a].push_back(i);
      motions_[bundle.relatives[i].b].push_back(i);
    }
    for (auto& list : appearances_) {
      std::ranges::stable_sort(list, std::greater<>{},
                               [&](const Appearance& at) { return size_px(bundle_.corners[at.term]); });
    }
  }

  std::vector<char> run() {
    while (true) {
      place_frames();
      if (place_statics(std::max(3, fewest())) || place_statics(fewest())) {
        forget_carried();
        if (unconfirmed_too_) set_unconfirmed_too(false);
      } else if (carry(1)) {
        continue;
      } else if (unconfirmed_too_ || std::ranges::none_of(bundle_.corners, &CornerTerm::unconfirmed)) {
        break;
      } else {
        set_unconfirmed_too(true);
      }
    }
    carry(std::numeric_limits<double>::infinity());
    std::vector<char> placed(bundle_.poses.size(), 0);
    for (std::size_t i = 0; i < placed.size(); ++i) {
      placed[i] = hypotheses_[i].empty() ? 0 : 1;
      if (placed[i] != 0) bundle_.poses[i].value = hypotheses_[i].front().value;
    }
    for (CornerTerm& term : bundle_.corners) {
      for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag})
        term.used = term.used && placed[pose_of(term, role)] != 0;
    }
    return placed;
  }

 private:
  [[nodiscard]] int fewest() const {
    return unconfirmed_too_ ? options_.min_unconfirmed_votes : options_.min_votes;
  }

  /// Sets whether unconfirmed terms vote.
  void set_unconfirmed_too(bool unconfirmed_too) {
    unconfirmed_too_ = unconfirmed_too;
    for (const CornerTerm& term : bundle_.corners) {
      for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag}) {
        if (term.unconfirmed) dirty_[pose_of(term, role)] = 1;
      }
    }
  }

  void set(PoseIndex pose, std::vector<Hypothesis> hypotheses) {
    hypotheses_[pose] = std::move(hypotheses);
    for (const Appearance& at : appearances_[pose]) {
      for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag}) {
        const PoseIndex other = pose_of(bundle_.corners[at.term], role);
        if (other != pose) dirty_[other] = 1;
      }
    }
  }

  [[nodiscard]] const std::vector<Hypothesis>& squares(std::size_t term) {
    if (options_.squares != nullptr) return (*options_.squares)[term];
    auto& at = squares_[term];
    if (!at) at = internal::poses_of_square(bundle_, bundle_.corners[term], options_.two_poses_sigma_px);
    return *at;
  }

  /// The votes for a pose, with the largest tags first.
  std::vector<Vote<SE3>> votes(PoseIndex pose, std::size_t most) {
    std::vector<Vote<SE3>> result;
    for (const Appearance& at : appearances_[pose]) {
      if (result.size() >= most) break;
      if (bundle_.corners[at.term].unconfirmed && !unconfirmed_too_) continue;
      std::array<const std::vector<Hypothesis>*, 4> sets{};
      bool ready = true;
      for (Role role : {Role::Rig, Role::Cam, Role::Body, Role::Tag}) {
        sets[static_cast<std::size_t>(role)] = &hypotheses_[pose_of(bundle_.corners[at.term], role)];
        ready = ready && (role == at.role || !hypotheses_[pose_of(bundle_.corners[at.term], role)].empty());
      }
      if (!ready) continue;
      Vote<SE3> vote = vote_for(at.role, sets, squares(at.term));
      if (!vote.empty()) result.push_back(std::move(vote));
    }
    return result;
  }

  /// Places every frame in which a placed tag is in view, and places it again when further tags in view have
  /// been placed.
  void place_frames() {
    // If a rig observes a body, the rig is placed first, then the body.
    for (int pass = 0; pass < 2; ++pass) {
      std::vector<PoseIndex> touched;
      for (std::size_t i = 0; i < bundle_.poses.size(); ++i) {
        if (!known_[i].moves || bundle_.poses[i].fixed || dirty_[i] == 0) continue;
        dirty_[i] = 0;
        touched.push_back(i);
      }
      for (PoseIndex i : touched) {
        std::vector<Hypothesis> found = hypotheses_of_frame(votes(i, kMaxFrameVotes));
        if (found.empty()) continue;
        set(i, std::move(found));
        carried_[i] = 0;
      }
    }
  }

  std::vector<Hypothesis> hypotheses_of_frame(const std::vector<Vote<SE3>>& votes) {
    if (votes.empty()) return {};
    const auto agreed = internal::agree(votes, internal::kPoseGate);
    if (agreed && agreed->votes >= 2) return {{agreed->value.mean, agreed->value.covariance, 0}};
    std::vector<Hypothesis> all;
    for (const Alternative<SE3>& alternative : votes.front()) {
      const double worse = alternative.chi2 - votes.front().front().chi2;
      if (worse < kRuledOutChi2 && all.size() < 2)
        all.push_back({alternative.value, alternative.information.inverse(), worse});
    }
    return all;
  }

  /// Places the static poses that have the most agreeing votes, which must be at least `fewest`. If motions
  /// carried frames, the best-determined poses are placed first instead. Returns whether there was any such
  /// pose.
  bool place_statics(int fewest) {
    constexpr double kAsWellDetermined = 4;  // ratio of variances
    const bool carried = std::ranges::find(carried_, 1) != carried_.end();
    std::vector<PoseIndex> found;
    int best = 0;
    double least = std::numeric_limits<double>::infinity();
    const auto variance = [&](PoseIndex i) {
      return uncertainty({agreed_[i]->value.mean, agreed_[i]->value.covariance, 0});
    };
    for (std::size_t i = 0; i < bundle_.poses.size(); ++i) {
      if (known_[i].moves || !hypotheses_[i].empty() || appearances_[i].empty()) continue;
      if (dirty_[i] != 0) agreed_[i] = internal::agree(votes(i, kMaxStaticVotes), internal::kPoseGate);
      dirty_[i] = 0;
      if (!agreed_[i] || agreed_[i]->votes < fewest) continue;
      best = std::max(best, agreed_[i]->votes);
      least = std::min(least, variance(i));
      found.push_back(i);
    }
    for (PoseIndex i : found) {
      const bool first = carried ? variance(i) <= kAsWellDetermined * least : 2 * agreed_[i]->votes >= best;
      if (first) set(i, {{agreed_[i]->value.mean, agreed_[i]->value.covariance, 0}});
    }
    return !found.empty();
  }

  /// The variance of a hypothesis relative to the largest at which motions still place frames.
  [[nodiscard]] double uncertainty(const Hypothesis& hypothesis) const {
    const Vector6 sigma = coordinate_deviations(Uncertain<SE3>{hypothesis.value, hypothesis.covariance});
    return sigma.head<3>().squaredNorm() / (options_.max_carried_m * options_.max_carried_m) +
           sigma.tail<3>().squaredNorm() / (options_.max_carried_rad * options_.max_carried_rad);
  }

  /// A motion from a placed frame to another one.
  struct Carry {
    double uncertainty = 0;
    PoseIndex from = 0;
    std::size_t motion = 0;

    bool operator>(const Carry& other) const {
      return std::tie(uncertainty, motion) > std::tie(other.uncertainty, other.motion);
    }
  };

  /// The hypotheses of the frame at the other end of a motion.
  [[nodiscard]] std::vector<Hypothesis> carried_by(const RelativeTerm& term, PoseIndex from) const {
    const SE3& S = term.factor.body_T_sensor;
    const SE3 M = from == term.a ? term.factor.measured : term.factor.measured.inverse();
    const Matrix6 W_inverse = term.factor.whitening.inverse();
    std::vector<Hypothesis> result;
    for (const Hypothesis& at : hypotheses_[from]) {
      const SE3 value = at.value * (S * M * S.inverse());
      // The error is in the frame of the sensor at A.
      const Matrix6 Ad = ((from == term.a ? at.value : value) * S).adjoint();
      const Matrix6 scaled = Ad * W_inverse;
      result.push_back({value, at.covariance + scaled * scaled.transpose(), at.chi2});
    }
    return result;
  }

  /// Places frames that see no placed tag using motions, the shortest way from a frame that sees one first
  /// (Dijkstra), up to this uncertainty. Returns whether there was any such frame. O(motions log motions).
  bool carry(double limit) {
    std::priority_queue<Carry, std::vector<Carry>, std::greater<>> next;
    const auto look_beyond = [&](PoseIndex from) {
      for (const std::size_t motion : motions_[from]) {
        const RelativeTerm& term = bundle_.relatives[motion];
        if (!hypotheses_[term.a == from ? term.b : term.a].empty()) continue;
        const double reached = uncertainty(carried_by(term, from).front());
        if (reached <= limit) next.push({reached, from, motion});
      }
    };
    for (std::size_t i = 0; i < motions_.size(); ++i) {
      if (!hypotheses_[i].empty()) look_beyond(i);
    }
    bool any = false;
    while (!next.empty()) {
      const Carry step = next.top();
      next.pop();
      const RelativeTerm& term = bundle_.relatives[step.motion];
      const PoseIndex to = term.a == step.from ? term.b : term.a;
      if (!hypotheses_[to].empty()) continue;
      set(to, carried_by(term, step.from));
      carried_[to] = 1;
      any = true;
      look_beyond(to);
    }
    return any;
  }

  /// Removes poses that motions carried, because newly placed tags determine them better.
  void forget_carried() {
    for (std::size_t i = 0; i < carried_.size(); ++i) {
      if (carried_[i] == 0) continue;
      set(i, {});
      carried_[i] = 0;
      dirty_[i] = 1;
    }
  }

  Bundle& bundle_;
  const std::vector<KnownPose>& known_;
  PlaceOptions options_;
  std::vector<std::vector<Hypothesis>> hypotheses_;
  std::vector<std::vector<Appearance>> appearances_;
  std::vector<std::vector<std::size_t>> motions_;  ///< indices of Bundle::relatives, for each pose
  std::vector<char> carried_;                      ///< whether the pose was placed by motions alone
  std::vector<std::optional<std::vector<Hypothesis>>> squares_;
  std::vector<char> dirty_;  ///< for each pose, whether another pose in one of its terms has changed
  std::vector<std::optional<internal::Agreement<SE3>>> agreed_;  ///< for poses that have not been placed yet
  bool unconfirmed_too_ = false;
};

}  // namespace

std::vector<char> place_poses(Bundle& bundle, const std::vector<KnownPose>& known,
                              const PlaceOptions& options) {
  return Placer(bundle, known, options).run();
}

namespace {

constexpr std::size_t kMaxVotes = 120;

double loss(const Bundle& bundle, const CornerTerm& term, double good_chi2) {
  const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term));
  // A tag that is not visible is given the maximum loss.
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
        vote_for(at.role, sets, internal::poses_of_square(bundle, term, options.two_poses_sigma_px));
    if (!vote.empty()) votes.push_back(std::move(vote));
  }
  return votes;
}

/// Moves a pose to the hypothesis that explains its observations best, if that is better than the current
/// one.
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
  constexpr double kMinGain = 1.0;
  const double enough = least - kMinGain;
  const auto attempt = [&](const SE3& value) {
    bundle.poses[pose].value = value;
    const double now = total();
    if (now < least) {
      least = now;
      best = value;
    }
  };
  const std::vector<Vote<SE3>> votes = votes_for(bundle, where, moves ? 8 : kMaxVotes, options);
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
    if (!can_count(term) || term.unconfirmed) continue;
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
  for (CornerTerm& term : bundle.corners) term.used = can_count(term) && !term.unconfirmed;
  return moved;
}

}  // namespace waymark
