#include "waymark/mapping/solver/pose_votes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/solver/disjoint_sets.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark::internal {
namespace {

// No pose is assumed to be more certain than about 3 mm and 3 mrad.
constexpr double kPoseVarianceFloor = 1e-5;

/// A product of uncertain transforms whose errors are independent.
class Chain {
 public:
  Chain& times(const Hypothesis& next) {
    const Matrix6 Ad = value_.adjoint();
    covariance_ += Ad * next.covariance * Ad.transpose();
    value_ = value_ * next.value;
    chi2_ += next.chi2;
    return *this;
  }
  Chain& times_inverse(const Hypothesis& next) {
    value_ = value_ * next.value.inverse();
    const Matrix6 Ad = value_.adjoint();
    covariance_ += Ad * next.covariance * Ad.transpose();
    chi2_ += next.chi2;
    return *this;
  }
  [[nodiscard]] Alternative<SE3> result() const {
    const Matrix6 covariance = covariance_ + kPoseVarianceFloor * Matrix6::Identity();
    return {value_, covariance.inverse(), chi2_};
  }

 private:
  SE3 value_{};
  Matrix6 covariance_ = Matrix6::Zero();
  double chi2_ = 0;
};

/// Solves cam_T_tag = (rig cam)^-1 body tag for one of the poses.
Alternative<SE3> solved_for(Role role, const std::array<const Hypothesis*, 4>& at, const Hypothesis& Z) {
  Chain chain;
  switch (role) {
    case Role::Rig:
      return chain.times(*at[2]).times(*at[3]).times_inverse(Z).times_inverse(*at[1]).result();
    case Role::Cam:
      return chain.times_inverse(*at[0]).times(*at[2]).times(*at[3]).times_inverse(Z).result();
    case Role::Body:
      return chain.times(*at[0]).times(*at[1]).times(Z).times_inverse(*at[3]).result();
    case Role::Tag:
      break;
  }
  return chain.times_inverse(*at[2]).times(*at[0]).times(*at[1]).times(Z).result();
}

}  // namespace

std::vector<Hypothesis> poses_of_square(const Bundle& bundle, const CornerTerm& term,
                                        double corner_sigma_px) {
  TagDetection detection;
  detection.corners_px = term.factor.corners_px;
  const auto pose = estimate_tag_pose(detection, side_m(bundle, term), bundle.cameras[term.camera],
                                      {.corner_sigma_px = corner_sigma_px});
  std::vector<Hypothesis> squares;
  if (!pose) return squares;
  constexpr double kMaxExcessChi2 = 30;
  squares.push_back({pose->best.cam_T_tag, pose->best.covariance, 0});
  const double worse = pose->other ? pose->other->chi2 - pose->best.chi2 : kMaxExcessChi2;
  if (worse < kMaxExcessChi2) squares.push_back({pose->other->cam_T_tag, pose->other->covariance, worse});
  return squares;
}

Vote<SE3> vote_for(Role role, const std::array<const std::vector<Hypothesis>*, 4>& of_poses,
                   const std::vector<Hypothesis>& squares) {
  static const std::vector<Hypothesis> kNone(1);
  std::array<const std::vector<Hypothesis>*, 4> sets = of_poses;
  sets[static_cast<std::size_t>(role)] = &kNone;
  Vote<SE3> vote;
  for (const Hypothesis& rig : *sets[0]) {
    for (const Hypothesis& cam : *sets[1]) {
      for (const Hypothesis& body : *sets[2]) {
        for (const Hypothesis& tag : *sets[3]) {
          for (const Hypothesis& Z : squares) vote.push_back(solved_for(role, {&rig, &cam, &body, &tag}, Z));
        }
      }
    }
  }
  std::ranges::stable_sort(vote, {}, &Alternative<SE3>::chi2);
  return vote;
}

namespace {

constexpr std::size_t kMaxComparisons = 6;  // each observation of a tag is compared with this many later ones
constexpr std::size_t kMaxNeighbours = 12;  // neighbours tried for each comparison
constexpr double kMedian6 = 5.348;          // median of chi-square with 6 degrees of freedom

/// a^-1 b, with independent errors.
Hypothesis between(const Hypothesis& a, const Hypothesis& b) {
  const SE3 inverse = a.value.inverse();
  const Matrix6 Ad = inverse.adjoint();
  return {inverse * b.value, Ad * (a.covariance + b.covariance) * Ad.transpose(), a.chi2 + b.chi2};
}

double distance2(const Hypothesis& a, const Hypothesis& b) {
  const Matrix6 P = a.covariance + b.covariance + kPoseVarianceFloor * Matrix6::Identity();
  const Vector6 off = minus(a.value, b.value);
  return a.chi2 + b.chi2 + off.dot(P.llt().solve(off));
}

class Confirmer {
 public:
  Confirmer(const std::vector<ViewedTag>& seen, const std::vector<std::vector<Hypothesis>>& poses,
            const std::vector<ViewMotion>& motions)
      : seen_(seen), poses_(poses), motions_(motions), groups_(seen.size()) {
    for (std::size_t i = 0; i < seen.size(); ++i) {
      if (views_.size() <= seen[i].view) views_.resize(seen[i].view + 1);
      if (tags_.size() <= seen[i].tag) tags_.resize(seen[i].tag + 1);
      views_[seen[i].view].push_back(i);
      tags_[seen[i].tag].push_back(i);
    }
    for (auto& view : views_) std::ranges::stable_sort(view, {}, [&](std::size_t i) { return seen_[i].tag; });
  }

  Confirmation run() {
    gate_ = kPoseGate * scale();
    for (const std::vector<std::size_t>& of_tag : tags_) join_observations(of_tag);
    return confirmation();
  }

 private:
  /// For the root of each group of a tag, the views with one of its observations.
  using ViewsOfGroups = std::map<std::size_t, std::set<std::size_t>>;

  /// The end of the observations of the tag of the first one in a view. A view shows duplicate tags at once.
  [[nodiscard]] std::size_t end_of_tag(const std::vector<std::size_t>& view, std::size_t first) const {
    std::size_t end = first + 1;
    while (end < view.size() && seen_[view[end]].tag == seen_[view[first]].tag) ++end;
    return end;
  }

  /// The smallest squared distance between the poses of a tag according to a common neighbour; infinite if
  /// there is no common neighbour. Tries at most `most` neighbours and returns as soon as a distance is below
  /// `enough`.
  double apart_by_neighbours(std::size_t a, std::size_t b, double enough, std::size_t most) const {
    double least = std::numeric_limits<double>::infinity();
    const auto& in_a = views_[seen_[a].view];
    const auto& in_b = views_[seen_[b].view];
    for (std::size_t i = 0, j = 0; i < in_a.size() && j < in_b.size() && most > 0;) {
      const std::size_t tag_a = seen_[in_a[i]].tag;
      const std::size_t tag_b = seen_[in_b[j]].tag;
      if (tag_a != tag_b) {
        ++(tag_a < tag_b ? i : j);
        continue;
      }
      const std::size_t end_a = end_of_tag(in_a, i);
      const std::size_t end_b = end_of_tag(in_b, j);
      if (tag_a != seen_[a].tag && seen_[in_a[i]].body == seen_[a].body) {
        for (std::size_t m = i; m < end_a && least >= enough; ++m) {
          for (std::size_t n = j; n < end_b && least >= enough; ++n)
            least = std::min(least, apart(a, in_a[m], b, in_b[n], enough));
        }
        if (least < enough) return least;
        --most;
      }
      i = end_a;
      j = end_b;
    }
    return least;
  }

  /// The smallest squared distance between the poses of a tag relative to a neighbour in two views. The
  /// search ends at the first value below `enough`.
  double apart(std::size_t a, std::size_t beside_a, std::size_t b, std::size_t beside_b,
               double enough) const {
    double least = std::numeric_limits<double>::infinity();
    for (const Hypothesis& tag_a : poses_[a]) {
      for (const Hypothesis& other_a : poses_[beside_a]) {
        const Hypothesis in_a = between(tag_a, other_a);
        for (const Hypothesis& tag_b : poses_[b]) {
          for (const Hypothesis& other_b : poses_[beside_b]) {
            least = std::min(least, distance2(in_a, between(tag_b, other_b)));
            if (least < enough) return least;
          }
        }
      }
    }
    return least;
  }

  /// The squared distance according to the motion between the views; infinite if the motion is too uncertain
  /// to distinguish tags.
  double apart_by_motion(std::size_t a, std::size_t b) const {
    constexpr std::size_t kMaxViewGap = 30;
    const std::size_t from = seen_[a].view;
    const std::size_t to = seen_[b].view;
    double least = std::numeric_limits<double>::infinity();
    if (to <= from || to - from > kMaxViewGap) return least;
    Hypothesis motion;
    for (std::size_t v = from + 1; v <= to; ++v) {
      if (v >= motions_.size() || !motions_[v].known) return least;
      const Matrix6 Ad = motion.value.adjoint();
      motion.covariance += Ad * motions_[v].covariance * Ad.transpose();
      motion.value = motion.value * motions_[v].before_T_view;
    }
    for (const Hypothesis& tag_a : poses_[a]) {
      for (const Hypothesis& tag_b : poses_[b]) {
        const Matrix6 Ad = motion.value.adjoint();
        const Hypothesis moved{motion.value * tag_b.value,
                               motion.covariance + Ad * tag_b.covariance * Ad.transpose(), tag_b.chi2};
        constexpr double kShare = 0.1;  // as a share of the distance
        const double far = kShare * tag_a.value.translation().norm();
        const Eigen::Vector3d sigma2 = motion.covariance.diagonal().head<3>();
        if (sigma2.maxCoeff() < far * far) least = std::min(least, distance2(tag_a, moved));
      }
    }
    return least;
  }

  /// Whether the tag has nearly the same size in the next view and has moved by less than a third of its
  /// size.
  [[nodiscard]] bool stays_in_image(std::size_t a, std::size_t b) const {
    constexpr double kMaxMoveShare = 0.33;
    constexpr double kMaxGrowth = 1.25;
    const auto [less, more] = std::minmax(seen_[a].size_px, seen_[b].size_px);
    return seen_[b].view == seen_[a].view + 1 && less > 0 && more < kMaxGrowth * less &&
           (seen_[a].centre_px - seen_[b].centre_px).norm() < kMaxMoveShare * less;
  }

  /// The ratio of actual to assumed corner noise, estimated from successive observations.
  double scale() const {
    std::vector<double> apart;
    for (const std::vector<std::size_t>& of_tag : tags_) {
      for (std::size_t k = 0; k < of_tag.size(); k += 4) {
        std::size_t next = k + 1;  // in another view, because two observations in one view show two tags
        while (next < of_tag.size() && seen_[of_tag[next]].view == seen_[of_tag[k]].view) ++next;
        if (next == of_tag.size()) break;
        const double d2 = apart_by_neighbours(of_tag[k], of_tag[next], 0, 1);
        if (std::isfinite(d2)) apart.push_back(d2);
      }
    }
    return apart.empty() ? 1 : std::clamp(median(std::move(apart)) / kMedian6, 1.0, 1e4);
  }

  /// Whether the tag has the same pose in both views, according to their images, a neighbour or the motion.
  [[nodiscard]] bool agree(std::size_t a, std::size_t b) const {
    return stays_in_image(a, b) || apart_by_neighbours(a, b, gate_, kMaxNeighbours) < gate_ ||
           apart_by_motion(a, b) < gate_;
  }

  /// The observations of a tag in the view of one of them.
  [[nodiscard]] std::vector<std::size_t> shown_with(std::size_t i) const {
    std::vector<std::size_t> shown;
    std::ranges::copy_if(views_[seen_[i].view], std::back_inserter(shown),
                         [&](std::size_t other) { return seen_[other].tag == seen_[i].tag; });
    return shown;
  }

  /// How different two observations of a tag are, by their neighbours, or by their places in the image.
  [[nodiscard]] std::pair<double, double> difference(std::size_t a, std::size_t b) const {
    return {apart_by_neighbours(a, b, 0, kMaxNeighbours), (seen_[a].centre_px - seen_[b].centre_px).norm()};
  }

  /// Whether no other observation of the tag in these two views fits one of them better.
  [[nodiscard]] bool fit_best(std::size_t a, std::size_t b) const {
    const std::vector<std::size_t> with_a = shown_with(a);
    const std::vector<std::size_t> with_b = shown_with(b);
    if (with_a.size() == 1 && with_b.size() == 1) return true;
    const std::pair<double, double> here = difference(a, b);
    return std::ranges::none_of(with_b, [&](std::size_t i) { return i != b && difference(a, i) < here; }) &&
           std::ranges::none_of(with_a, [&](std::size_t i) { return i != a && difference(i, b) < here; });
  }

  void join_observations(const std::vector<std::size_t>& of_tag) {
    ViewsOfGroups views;
    for (const std::size_t i : of_tag) views[i] = {seen_[i].view};
    for (std::size_t k = 0; k < of_tag.size(); ++k) {
      int joined = 0;
      for (std::size_t next = k + 1; next < of_tag.size() && next <= k + kMaxComparisons && joined < 2;
           ++next) {
        if (groups_.root(of_tag[k]) == groups_.root(of_tag[next]) ||
            (seen_[of_tag[k]].view != seen_[of_tag[next]].view && agree(of_tag[k], of_tag[next]) &&
             fit_best(of_tag[k], of_tag[next]) && join(of_tag[k], of_tag[next], views)))
          ++joined;
      }
    }
  }

  /// Joins the groups of two observations, unless a view shows both groups. Returns whether it did.
  bool join(std::size_t a, std::size_t b, ViewsOfGroups& views) {
    std::size_t less = groups_.root(a);
    std::size_t more = groups_.root(b);
    if (views[less].size() > views[more].size()) std::swap(less, more);
    std::set<std::size_t>& of_more = views[more];
    if (std::ranges::any_of(views[less], [&](std::size_t view) { return of_more.contains(view); }))
      return false;
    groups_.join(less, more);
    of_more.merge(views[less]);
    views.erase(less);
    return true;
  }

  /// Whether the observation affects other tags, through a neighbour in its view or through a known motion.
  [[nodiscard]] bool could_mislead(std::size_t i) const {
    const std::size_t view = seen_[i].view;
    const auto moves = [&](std::size_t v) { return v < motions_.size() && motions_[v].known; };
    if (moves(view) || moves(view + 1)) return true;
    return std::ranges::any_of(views_[view], [&](std::size_t other) {
      return seen_[other].tag != seen_[i].tag && seen_[other].body == seen_[i].body;
    });
  }

  Confirmation confirmation() {
    std::vector<std::size_t> size(seen_.size(), 0);
    for (std::size_t i = 0; i < seen_.size(); ++i) ++size[groups_.root(i)];
    double alone = 0;
    double tags = 0;
    for (const std::vector<std::size_t>& of_tag : tags_) {
      tags += of_tag.empty() ? 0 : 1;
      for (std::size_t i : of_tag) alone += size[groups_.root(i)] == 1 && could_mislead(i) ? 1 : 0;
    }
    Confirmation result{.unconfirmed = std::vector<char>(seen_.size(), 0),
                        .groups = std::vector<std::size_t>(seen_.size()),
                        .min_votes = votes_beyond_chance(alone, tags)};
    std::vector<std::size_t> first(seen_.size(), seen_.size());  // of the group with this root
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      std::size_t& of_group = first[groups_.root(i)];
      of_group = std::min(of_group, i);
      result.groups[i] = of_group;
    }
    for (const std::vector<std::size_t>& of_tag : tags_) {
      std::size_t largest = 0;
      for (std::size_t i : of_tag) largest = std::max(largest, size[groups_.root(i)]);
      for (std::size_t i : of_tag) {
        const std::size_t group = size[groups_.root(i)];
        const bool confirmed =
            group >= 2 && (group == largest || group >= static_cast<std::size_t>(result.min_votes));
        result.unconfirmed[i] = !confirmed && could_mislead(i) ? 1 : 0;
      }
    }
    return result;
  }

  /// Among n wrong ids in a map of T tags, n^k / (k! T^(2k-2)) sets of k ids agree on the pose of a tag by
  /// chance.
  static int votes_beyond_chance(double wrong, double tags) {
    constexpr double kRare = 0.01;
    constexpr int kMaxVotes = 5;
    double sets = wrong;
    for (int k = 2; k < kMaxVotes; ++k) {
      sets *= wrong / (k * tags * tags);
      if (sets < kRare) return k;
    }
    return kMaxVotes;
  }

  const std::vector<ViewedTag>& seen_;
  const std::vector<std::vector<Hypothesis>>& poses_;
  const std::vector<ViewMotion>& motions_;
  std::vector<std::vector<std::size_t>> views_;  ///< observations in each view, listed by the tag they show
  std::vector<std::vector<std::size_t>> tags_;   ///< observations of each tag, in chronological order
  DisjointSets groups_;
  double gate_ = kPoseGate;
};

}  // namespace

Confirmation confirm_observations(const std::vector<ViewedTag>& seen,
                                  const std::vector<std::vector<Hypothesis>>& poses,
                                  const std::vector<ViewMotion>& motions) {
  return Confirmer(seen, poses, motions).run();
}

}  // namespace waymark::internal
