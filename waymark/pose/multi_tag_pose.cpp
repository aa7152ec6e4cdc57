#include "waymark/pose/multi_tag_pose.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/pose/pose_refinement.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark::internal {
namespace {

/// A detection of a map tag, prepared for the search.
struct Candidate {
  std::size_t detection = 0;
  const TagDetection* seen = nullptr;
  const MappedTag* mapped = nullptr;
  Corners3 map_corners{};
  Whitening whitening{};  ///< whitening of the corners; includes the map's covariance once linearised
  std::array<SE3, 2> cam_T_map{};  ///< both poses that the tag suggests, unrefined
  double area_px2 = 0;
};

/// How well a tag fits a given pose.
struct TagFit {
  bool visible = false;
  NormalEquations normal{};
  double worst_corner_chi2 = 0;
};

/// A pose and the tags that agree with it.
struct Consensus {
  SE3 cam_T_map{};
  Matrix6 covariance{};         ///< covariance of cam_T_map in the left tangent of the camera frame
  double chi2 = 0;              ///< sum over the members
  std::vector<char> members{};  ///< one flag per candidate
  std::vector<TagFit> fits{};   ///< one per candidate
  std::size_t count = 0;
};

/// Grows a consensus from one pose of one tag. Reuses its memory from one search to the next.
class Growth {
 public:
  Growth(const CameraModel& camera, std::vector<Candidate>& candidates, const MultiTagOptions& options)
      : camera_(camera),
        candidates_(candidates),
        options_(options),
        fits_(candidates.size()),
        tags_(candidates.size()) {
    for (const Candidate& c : candidates)
      map_is_uncertain_ = map_is_uncertain_ || c.mapped->covariance.has_value();
  }

  /// The consensus grown from one pose of one tag; `nullopt` if not even that tag fits. Any tag may be
  /// removed again, including the seed.
  std::optional<Consensus> from(std::size_t seed, const SE3& start) { return search(seed, start, true); }
  /// The consensus of the seed tag alone.
  std::optional<Consensus> alone(std::size_t seed, const SE3& start) { return search(seed, start, false); }

 private:
  struct Tag {
    bool is_member = false;
    int expulsions = 0;
    bool tried = false;  ///< already fitted together with the current members, without success
    /// fraction of the tag's chi2 that remains after one Gauss-Newton step together with the members
    double unexplained = 1;
  };
  struct Solved {
    NormalEquations sum;
    Vector6 xi;
  };

  [[nodiscard]] Eigen::Vector3d pivot_of(const SE3& cam_T_map) const { return cam_T_map * map_pivot_; }
  [[nodiscard]] bool may_join(std::size_t i) const;
  void set_member(std::size_t i, bool is_member);
  void evaluate(const Candidate& candidate, const SE3& cam_T_map, TagFit& fit) const;
  [[nodiscard]] bool evaluate_members(const SE3& cam_T_map);
  void evaluate_others(const SE3& cam_T_map);
  [[nodiscard]] std::optional<SE3> refine_alone(std::size_t seed, const SE3& start) const;
  [[nodiscard]] std::optional<Solved> solve() const;
  bool minimise(SE3& cam_T_map, bool others_may_join);
  bool add_fitting_tags(const Solved& members);
  bool add_tag_by_trial(SE3& cam_T_map);
  bool try_one(std::size_t i, SE3& cam_T_map);
  [[nodiscard]] double excess(std::size_t i) const;
  bool remove_worst();
  bool linearise_map_again(const SE3& cam_T_map);
  void linearise_map(const SE3& cam_T_map);
  [[nodiscard]] std::optional<Consensus> finish(const SE3& cam_T_map) const;
  std::optional<Consensus> search(std::size_t seed, const SE3& start, bool others_may_join);

  const CameraModel& camera_;
  std::vector<Candidate>& candidates_;
  const MultiTagOptions& options_;
  std::vector<TagFit> fits_;
  std::vector<Tag> tags_;
  Eigen::Vector3d map_pivot_ = Eigen::Vector3d::Zero();
  bool map_is_uncertain_ = false;
  SE3 linearised_at_{};
  int linearisations_ = 0;
};

/// A tag that does not fit to first order is tried iteratively if a first-order step leaves less than this
/// fraction of its chi2.
constexpr double kMaxUnexplained = 0.25;
/// How often a tag may be removed and added again after other tags have changed.
constexpr int kMaxRemovals = 2;
/// The map's uncertainty is linearised again if the pose has moved by at least this many standard deviations,
/// but at most kMaxLinearisations times.
constexpr double kMovedSigmas = 0.1;
constexpr int kMaxLinearisations = 4;

bool Growth::may_join(std::size_t i) const {
  return !tags_[i].is_member && fits_[i].visible && tags_[i].expulsions < kMaxRemovals;
}

void Growth::set_member(std::size_t i, bool is_member) {
  tags_[i].is_member = is_member;
  for (Tag& tag : tags_) tag.tried = false;
}

void Growth::evaluate(const Candidate& candidate, const SE3& cam_T_map, TagFit& fit) const {
  const Eigen::Matrix3d R = cam_T_map.rotation().matrix();
  Corners3 cam_corners;
  for (std::size_t i = 0; i < 4; ++i) cam_corners[i] = R * candidate.map_corners[i] + cam_T_map.translation();
  Vector8 e;
  Matrix86 J;
  fit.normal = NormalEquations();
  fit.visible = corner_residuals(camera_, cam_corners, pivot_of(cam_T_map), candidate.seen->corners_px, e, J);
  if (!fit.visible) return;
  fit.worst_corner_chi2 = candidate.whitening.worst_corner_chi2(e);
  candidate.whitening.apply(e, J);
  fit.normal.add(e, J);
}

/// Returns false if a member is not visible from the pose.
bool Growth::evaluate_members(const SE3& cam_T_map) {
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!tags_[i].is_member) continue;
    evaluate(candidates_[i], cam_T_map, fits_[i]);
    if (!fits_[i].visible) return false;
  }
  return true;
}

void Growth::evaluate_others(const SE3& cam_T_map) {
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (!tags_[i].is_member) evaluate(candidates_[i], cam_T_map, fits_[i]);
  }
}

std::optional<SE3> Growth::refine_alone(std::size_t seed, const SE3& start) const {
  const auto add_seed = [&](const SE3& cam_T_map, const Eigen::Vector3d&, NormalEquations& normal) {
    TagFit fit;
    evaluate(candidates_[seed], cam_T_map, fit);
    normal = fit.normal;
    return fit.visible;
  };
  const auto pivot = [this](const SE3& cam_T_map) { return pivot_of(cam_T_map); };
  const auto refined = refine(start, options_.max_iterations, pivot, add_seed);
  if (!refined || !(refined->normal.chi2 <= options_.tag_gate_chi2)) return std::nullopt;
  return refined->cam_T_ref;
}

/// The Gauss-Newton step for the members.
std::optional<Growth::Solved> Growth::solve() const {
  Solved solved;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (tags_[i].is_member) solved.sum.add(fits_[i].normal);
  }
  const std::optional<Cholesky6> cholesky = Cholesky6::of(solved.sum.H);
  if (!cholesky) return std::nullopt;
  solved.xi = -cholesky->solve(solved.sum.g);
  return solved;
}

/// Iterates the members to their minimum; other tags may join in the process. Returns false if no member is
/// visible.
bool Growth::minimise(SE3& cam_T_map, bool others_may_join) {
  for (int step = 0; step < options_.max_iterations; ++step) {
    if (!evaluate_members(cam_T_map)) return false;
    std::optional<Solved> solved = solve();
    if (!solved) return false;
    if (others_may_join) {
      evaluate_others(cam_T_map);
      if (add_fitting_tags(*solved)) solved = solve();
      if (!solved) return false;
    }
    const double gain = -solved->xi.dot(solved->sum.g);
    cam_T_map = perturbed(solved->xi, cam_T_map, pivot_of(cam_T_map));
    if (gain <= kGainTolerance * (1e-3 + solved->sum.chi2)) return true;
  }
  return false;
}

/// Adds every tag that, to first order, raises the total chi2 by no more than the gate: equation (22).
bool Growth::add_fitting_tags(const Solved& members) {
  bool joined = false;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!may_join(i)) continue;
    const NormalEquations& tag = fits_[i].normal;
    const std::optional<Cholesky6> both = Cholesky6::of(members.sum.H + tag.H);
    if (!both) continue;
    const Vector6 g = members.sum.g + tag.g;
    const double rise = tag.chi2 - members.sum.g.dot(members.xi) - g.dot(both->solve(g));
    tags_[i].unexplained = rise / tag.chi2;
    if (rise <= options_.tag_gate_chi2) {
      set_member(i, true);
      joined = true;
    }
  }
  return joined;
}

/// Used when the members leave the pose too uncertain for a first-order prediction. Fits the members together
/// with one more tag, starting with the most promising one, until a tag fits with all of them.
bool Growth::add_tag_by_trial(SE3& cam_T_map) {
  while (true) {
    std::size_t best = tags_.size();
    double least = kMaxUnexplained;
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      if (!may_join(i) || tags_[i].tried || !(tags_[i].unexplained < least)) continue;
      best = i;
      least = tags_[i].unexplained;
    }
    if (best == tags_.size()) return false;
    if (try_one(best, cam_T_map)) return true;
  }
}

bool Growth::try_one(std::size_t i, SE3& cam_T_map) {
  SE3 trial = cam_T_map;
  tags_[i].is_member = true;
  bool fits = minimise(trial, false);
  for (std::size_t k = 0; k < tags_.size() && fits; ++k) fits = !tags_[k].is_member || excess(k) <= 1;
  if (fits) {
    set_member(i, true);
    cam_T_map = trial;
    return true;
  }
  tags_[i].is_member = false;
  tags_[i].tried = true;
  // Restores the members' equations after the trial.
  [[maybe_unused]] const bool visible = evaluate_members(cam_T_map);
  assert(visible);
  return false;
}

/// How far a tag exceeds its gates; it is outside them if the result is more than 1.
double Growth::excess(std::size_t i) const {
  return std::max(fits_[i].normal.chi2 / options_.tag_gate_chi2,
                  fits_[i].worst_corner_chi2 / options_.corner_gate_chi2);
}

/// Removes the member that exceeds its gates the most. Returns false if all members are within their gates.
bool Growth::remove_worst() {
  std::size_t worst = tags_.size();
  double worst_excess = 1.0;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!tags_[i].is_member || !(excess(i) > worst_excess)) continue;
    worst = i;
    worst_excess = excess(i);
  }
  if (worst == tags_.size()) return false;
  set_member(worst, false);
  ++tags_[worst].expulsions;
  return true;
}

/// Adds the effect of a map tag's uncertainty on its corners, equation (21), linearised at this pose.
void Growth::linearise_map(const SE3& cam_T_map) {
  if (!map_is_uncertain_) return;
  ++linearisations_;
  linearised_at_ = cam_T_map;
  const Eigen::Matrix3d R = cam_T_map.rotation().matrix();
  for (Candidate& candidate : candidates_) {
    if (!candidate.mapped->covariance) continue;
    Matrix86 J_px_tag;
    bool visible = true;
    for (std::size_t i = 0; i < 4 && visible; ++i) {
      Matrix23 J_px_p;
      visible = camera_.project(cam_T_map * candidate.map_corners[i], &J_px_p).has_value();
      const Matrix23 J_px_map = J_px_p * R;
      J_px_tag.middleRows<2>(static_cast<Eigen::Index>(2 * i)) << J_px_map,
          -J_px_map * SO3::hat(candidate.map_corners[i]);
    }
    if (!visible) continue;
    const CornerCovariance corners = candidate.seen->corner_covariance_px2.value_or(
        CornerCovariance::Identity() * options_.corner_sigma_px * options_.corner_sigma_px);
    const auto whitening =
        Whitening::of(corners + J_px_tag * *candidate.mapped->covariance * J_px_tag.transpose());
    if (whitening) candidate.whitening = *whitening;
  }
}

std::optional<Consensus> Growth::finish(const SE3& cam_T_map) const {
  Consensus consensus{.cam_T_map = cam_T_map, .members = std::vector<char>(tags_.size(), 0), .fits = fits_};
  NormalEquations sum;
  for (std::size_t i = 0; i < tags_.size(); ++i) {
    if (!tags_[i].is_member) continue;
    sum.add(fits_[i].normal);
    consensus.members[i] = 1;
    ++consensus.count;
  }
  const std::optional<Cholesky6> information = Cholesky6::of(sum.H);
  if (consensus.count == 0 || !information) return std::nullopt;
  const Matrix6 Ad = shift_adjoint(pivot_of(cam_T_map));
  consensus.covariance = Ad * information->inverse() * Ad.transpose();
  consensus.chi2 = sum.chi2;
  return consensus;
}

/// Linearises the map's uncertainty again if the pose has moved noticeably since the last linearisation.
bool Growth::linearise_map_again(const SE3& cam_T_map) {
  if (!map_is_uncertain_ || linearisations_ >= kMaxLinearisations) return false;
  const std::optional<Solved> solved = solve();
  Vector6 moved;
  moved << pivot_of(cam_T_map) - pivot_of(linearised_at_),
      (cam_T_map.rotation() * linearised_at_.rotation().inverse()).log();
  if (!solved || moved.dot(solved->sum.H * moved) < kMovedSigmas * kMovedSigmas) return false;
  linearise_map(cam_T_map);
  return true;
}

std::optional<Consensus> Growth::search(std::size_t seed, const SE3& start, bool others_may_join) {
  map_pivot_ = candidates_[seed].mapped->map_T_tag.translation();
  linearisations_ = 0;
  linearise_map(start);
  const std::optional<SE3> seed_only = refine_alone(seed, start);
  if (!seed_only) return std::nullopt;
  SE3 cam_T_map = *seed_only;
  tags_.assign(tags_.size(), Tag());
  tags_[seed].is_member = true;
  // Each tag is added and removed only a bounded number of times; the limit on rounds merely guards against a
  // bug.
  for (std::size_t rounds = 0; rounds < 10 + 4 * tags_.size(); ++rounds) {
    if (!minimise(cam_T_map, others_may_join)) return std::nullopt;
    if (remove_worst()) continue;
    if (others_may_join && add_tag_by_trial(cam_T_map)) continue;
    if (linearise_map_again(cam_T_map)) continue;
    evaluate_others(cam_T_map);
    return finish(cam_T_map);
  }
  return std::nullopt;
}

/// Two poses of the same tags count as one if they are closer than this many standard deviations, because the
/// covariance of each then covers the other.
constexpr double kSamePoseSigmas = 1.0;

/// Distance from a to b in standard deviations of a.
double sigmas_apart(const Consensus& a, const Consensus& b) {
  const Vector6 xi = (b.cam_T_map * a.cam_T_map.inverse()).log();
  const std::optional<Cholesky6> cholesky = Cholesky6::of(a.covariance);
  return cholesky ? std::sqrt(xi.dot(cholesky->solve(xi))) : 0;
}

bool is_better(const Consensus& a, const Consensus& b) {
  return a.count != b.count ? a.count > b.count : a.chi2 < b.chi2;
}

void keep_if_new(std::vector<Consensus>& found, std::optional<Consensus> consensus) {
  if (!consensus) return;
  for (Consensus& known : found) {
    if (known.members == consensus->members && sigmas_apart(known, *consensus) < kSamePoseSigmas) {
      if (is_better(*consensus, known)) known = std::move(*consensus);
      return;
    }
  }
  found.push_back(std::move(*consensus));
}

/// All consensuses to be reported: first the best one, then those that explain as many tags and have a chi2
/// that is larger by less than options.ambiguity_chi2. The candidates must be in descending order of area.
std::vector<Consensus> find_consensus(const CameraModel& camera, std::vector<Candidate>& candidates,
                                      const MultiTagOptions& options) {
  Growth growth(camera, candidates, options);
  std::vector<Consensus> found;
  for (std::size_t seed = 0; seed < candidates.size(); ++seed) {
    // A larger consensus must contain a tag that the best one lacks, so only such tags are used as seeds.
    const auto best = std::min_element(found.begin(), found.end(), is_better);
    if (best != found.end() && best->members[seed] != 0) continue;
    for (const SE3& start : candidates[seed].cam_T_map) {
      std::optional<Consensus> grown = growth.from(seed, start);
      if (!grown || grown->members[seed] == 0) keep_if_new(found, growth.alone(seed, start));
      keep_if_new(found, std::move(grown));
    }
  }
  std::sort(found.begin(), found.end(), is_better);
  if (found.empty()) return found;
  // Poses of the same tags are compared by likelihood. Poses of different tags are compared only by the
  // number of tags, because their chi2 values refer to different data.
  const Consensus best = found.front();
  std::erase_if(found, [&](const Consensus& c) {
    return c.count < best.count || (c.members == best.members && c.chi2 > best.chi2 + options.ambiguity_chi2);
  });
  return found;
}

}  // namespace
}  // namespace waymark::internal

namespace waymark {
namespace {

using internal::Candidate;
using internal::Consensus;
using internal::Corners2;
using internal::Whitening;

using Detections = std::span<const TagDetection>;

double area_px2(const Corners2& c) {
  const Eigen::Vector2d a = c[2] - c[0];
  const Eigen::Vector2d b = c[3] - c[1];
  return std::abs(a.x() * b.y() - a.y() * b.x()) / 2;
}

double largest_distance_px(const Corners2& a, const Corners2& b) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i) largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

bool is_finite(const SE3& T) {
  return T.translation().allFinite() && T.rotation().quaternion().coeffs().allFinite();
}

/// Collects unusable detections.
struct Rejections {
  Detections detections;
  std::vector<RejectedTag> list{};

  void add(std::size_t detection, RejectReason reason, std::string words, double chi2 = 0) {
    list.push_back({detection, detections[detection].tag, reason, std::move(words), chi2});
  }
};

/// The detections with unique ids; all others are rejected. Duplicates that all agree count as one detection.
std::vector<std::size_t> unique_detections(Detections detections, double tolerance_px, Rejections& rejected) {
  std::vector<std::size_t> unique;
  unique.reserve(detections.size());
  std::vector<std::size_t> same;
  for (std::size_t i = 0; i < detections.size(); ++i) {
    same.clear();
    double apart = 0;
    for (std::size_t j = 0; j < detections.size(); ++j) {
      if (j == i || detections[j].tag != detections[i].tag) continue;
      same.push_back(j);
      apart = std::max(apart, largest_distance_px(detections[i].corners_px, detections[j].corners_px));
      if (!std::isfinite(apart)) break;
    }
    const std::string id = same.empty() ? std::string() : to_string(detections[i].tag);
    if (!same.empty() && !(apart <= tolerance_px)) {
      rejected.add(
          i, RejectReason::ContradictoryDuplicate,
          fmt::format(
              "{} was detected {} times in one image, up to {:.1f} px apart; the correct one is ambiguous",
              id, same.size() + 1, apart));
    } else if (!same.empty() && same.front() < i) {
      rejected.add(i, RejectReason::Duplicate, fmt::format("{} was detected twice at one position", id));
    } else {
      unique.push_back(i);
    }
  }
  return unique;
}

/// Describes what is wrong with a map entry; empty if it is valid.
std::string map_entry_problem(const MappedTag& mapped) {
  if (!is_tag_size(mapped.size_m)) return fmt::format("invalid tag size {} m in the map", mapped.size_m);
  if (!is_finite(mapped.map_T_tag)) return "non-finite pose in the map";
  if (!mapped.covariance) return {};
  const PoseCovariance& C = *mapped.covariance;
  if (!C.allFinite() || !C.isApprox(C.transpose(), 1e-6) || !Eigen::LDLT<PoseCovariance>(C).isPositive()) {
    return "the covariance in the map is not symmetric and positive definite";
  }
  return {};
}

std::optional<Candidate> prepare(std::size_t detection, Detections detections, const TagMap& map,
                                 const CameraModel& camera, const MultiTagOptions& options,
                                 Rejections& rejected) {
  const TagDetection& seen = detections[detection];
  const MappedTag* mapped = map.find(seen.tag);
  if (mapped == nullptr) {
    rejected.add(detection, RejectReason::NotInMap, fmt::format("{} is not in the map", to_string(seen.tag)));
    return std::nullopt;
  }
  if (std::string problem = map_entry_problem(*mapped); !problem.empty()) {
    rejected.add(detection, RejectReason::BadMapEntry, fmt::format("{}: {}", to_string(seen.tag), problem));
    return std::nullopt;
  }
  if (const Status status = check_usable_corners(seen); !status) {
    rejected.add(detection, RejectReason::UnreliableCorners,
                 fmt::format("{}: {}", to_string(seen.tag), status.error().message));
    return std::nullopt;
  }
  const auto starts = internal::starting_poses(seen, mapped->size_m, camera);
  const auto whitening = internal::whitening_of(seen, options.corner_sigma_px);
  if (!starts || !whitening) {
    const Error& error = starts ? whitening.error() : starts.error();
    rejected.add(detection, RejectReason::BadDetection,
                 fmt::format("{}: {}", to_string(seen.tag), error.message));
    return std::nullopt;
  }
  Candidate candidate{.detection = detection, .seen = &seen, .mapped = mapped, .whitening = *whitening};
  candidate.area_px2 = area_px2(seen.corners_px);
  candidate.map_corners = square_corners(mapped->size_m);
  for (Eigen::Vector3d& corner : candidate.map_corners) corner = mapped->map_T_tag * corner;
  const SE3 tag_T_map = mapped->map_T_tag.inverse();
  for (std::size_t i = 0; i < 2; ++i) candidate.cam_T_map[i] = (*starts)[i] * tag_T_map;
  return candidate;
}

/// Root mean square distance between the corners of a tag and their projections; infinite if a corner does
/// not project.
double rms_px(const CameraModel& camera, const SE3& cam_T_map, const Candidate& candidate) {
  double squared = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto px = camera.project(cam_T_map * candidate.map_corners[i]);
    if (!px) return std::numeric_limits<double>::infinity();
    squared += (*px - candidate.seen->corners_px[i]).squaredNorm();
  }
  return std::sqrt(squared / 4);
}

CameraPoseEstimate report(const Consensus& consensus, const std::vector<Candidate>& candidates,
                          const CameraModel& camera) {
  const Uncertain<SE3> map_X_cam =
      inverse(Uncertain<SE3>{consensus.cam_T_map, consensus.covariance});  // equation (20)
  CameraPoseEstimate estimate{
      .map_T_cam = map_X_cam.mean, .covariance = map_X_cam.covariance, .chi2 = consensus.chi2};
  double squared = 0;
  estimate.detections.reserve(consensus.count);
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (consensus.members[i] == 0) continue;
    estimate.detections.push_back(candidates[i].detection);
    const double rms = rms_px(camera, consensus.cam_T_map, candidates[i]);
    squared += rms * rms;
  }
  std::sort(estimate.detections.begin(), estimate.detections.end());
  estimate.rms_px = std::sqrt(squared / static_cast<double>(consensus.count));
  return estimate;
}

void reject_outliers(const Consensus& consensus, const std::vector<Candidate>& candidates,
                     const CameraModel& camera, const MultiTagOptions& options, Rejections& rejected) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (consensus.members[i] != 0) continue;
    const std::string id = to_string(candidates[i].seen->tag);
    const internal::TagFit& fit = consensus.fits[i];
    if (!fit.visible) {
      rejected.add(candidates[i].detection, RejectReason::NotVisible,
                   fmt::format("{} was detected, but according to the pose from the other tags it is behind "
                               "the camera or beyond the "
                               "lens",
                               id));
      continue;
    }
    rejected.add(
        candidates[i].detection, RejectReason::Outlier,
        fmt::format(
            "{} is {:.1f} px from its position predicted by the other tags (chi2 {:.1f} over 8 residuals, "
            "gate {:.1f}; worst corner {:.1f}, gate {:.1f})",
            id, rms_px(camera, consensus.cam_T_map, candidates[i]), fit.normal.chi2, options.tag_gate_chi2,
            fit.worst_corner_chi2, options.corner_gate_chi2),
        fit.normal.chi2);
  }
}

void reject_all(const std::vector<Candidate>& candidates, Rejections& rejected) {
  for (const Candidate& candidate : candidates) {
    rejected.add(candidate.detection, RejectReason::Outlier,
                 fmt::format("no pose of a square fits the corners of {} within the gate",
                             to_string(candidate.seen->tag)));
  }
}

}  // namespace

const char* to_string(RejectReason reason) {
  switch (reason) {
    case RejectReason::NotInMap:
      return "not_in_map";
    case RejectReason::BadMapEntry:
      return "bad_map_entry";
    case RejectReason::Duplicate:
      return "duplicate";
    case RejectReason::ContradictoryDuplicate:
      return "contradictory_duplicate";
    case RejectReason::BadDetection:
      return "bad_detection";
    case RejectReason::NotVisible:
      return "not_visible";
    case RejectReason::Outlier:
      return "outlier";
    case RejectReason::UnreliableCorners:
      return "unreliable_corners";
  }
  return "";
}

Result<MultiTagPose> estimate_camera_pose(Detections detections, const TagMap& map, const CameraModel& camera,
                                          const MultiTagOptions& options) {
  if (const Status status = check_ranges(options); !status) return tl::unexpected<Error>(status.error());
  Rejections rejected{.detections = detections};
  std::vector<Candidate> candidates;
  candidates.reserve(detections.size());
  for (const std::size_t i : unique_detections(detections, options.duplicate_px, rejected)) {
    if (auto candidate = prepare(i, detections, map, camera, options, rejected))
      candidates.push_back(*candidate);
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.area_px2 > b.area_px2; });
  const std::vector<Consensus> found = internal::find_consensus(camera, candidates, options);

  MultiTagPose result;
  for (const Consensus& consensus : found) result.estimates.push_back(report(consensus, candidates, camera));
  if (found.empty()) {
    reject_all(candidates, rejected);
  } else {
    reject_outliers(found.front(), candidates, camera, options, rejected);
  }
  std::sort(rejected.list.begin(), rejected.list.end(),
            [](const RejectedTag& a, const RejectedTag& b) { return a.detection < b.detection; });
  result.rejected = std::move(rejected.list);
  return result;
}

}  // namespace waymark
