#include "waymark/pose/multi_tag_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/pose/consensus.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/pose/starting_poses.hpp"
#include "waymark/samples/tag_sizes.hpp"

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

/// Collects what could not be used.
struct Rejections {
  Detections detections;
  std::vector<RejectedTag> list{};

  void add(std::size_t detection, RejectReason reason, std::string words, double chi2 = 0) {
    list.push_back({detection, detections[detection].tag, reason, std::move(words), chi2});
  }
};

/// Detections that are the only one of their id; the others are rejected. Repeats count as one when all of
/// them agree.
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
              "{} was seen {} times in one image, up to {:.1f} px apart: which one is true cannot be known",
              id, same.size() + 1, apart));
    } else if (!same.empty() && same.front() < i) {
      rejected.add(i, RejectReason::Duplicate, fmt::format("{} was seen twice in one place", id));
    } else {
      unique.push_back(i);
    }
  }
  return unique;
}

/// What is wrong with an entry of the map, in words; empty when nothing is.
std::string map_entry_problem(const MappedTag& mapped) {
  if (!is_tag_size(mapped.size_m)) return fmt::format("the map gives it a size of {} m", mapped.size_m);
  if (!is_finite(mapped.map_T_tag)) return "its pose in the map is not finite";
  if (!mapped.covariance) return {};
  const PoseCovariance& C = *mapped.covariance;
  if (!C.allFinite() || !C.isApprox(C.transpose(), 1e-6) || !Eigen::LDLT<PoseCovariance>(C).isPositive()) {
    return "its covariance in the map is not symmetric and positive";
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

/// Root mean square distance of a tag's corners from where they project; infinite when one does not.
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
      rejected.add(
          candidates[i].detection, RejectReason::NotVisible,
          fmt::format(
              "{} was seen, but from the pose of the other tags it lies behind the camera or beyond the "
              "lens",
              id));
      continue;
    }
    rejected.add(
        candidates[i].detection, RejectReason::Outlier,
        fmt::format(
            "{} lies {:.1f} px from where the pose of the others puts it (chi2 {:.1f} over 8 residuals, "
            "gate {:.1f}; worst corner {:.1f}, gate {:.1f})",
            id, rms_px(camera, consensus.cam_T_map, candidates[i]), fit.normal.chi2, options.tag_gate_chi2,
            fit.worst_corner_chi2, options.corner_gate_chi2),
        fit.normal.chi2);
  }
}

void reject_all(const std::vector<Candidate>& candidates, Rejections& rejected) {
  for (const Candidate& candidate : candidates) {
    rejected.add(candidate.detection, RejectReason::Outlier,
                 fmt::format("the corners of {} fit no pose of a square within the gate",
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
