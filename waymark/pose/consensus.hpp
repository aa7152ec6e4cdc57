#pragma once

#include <array>
#include <optional>
#include <vector>

#include "waymark/camera/camera_model.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/reprojection.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark::internal {

/// A detection of a mapped tag, ready for the search.
struct Candidate {
  std::size_t detection = 0;
  const TagDetection* seen = nullptr;
  const MappedTag* mapped = nullptr;
  Corners3 map_corners{};
  Whitening whitening{};           ///< of the corners; with the map's covariance once linearised
  std::array<SE3, 2> cam_T_map{};  ///< both poses of the tag, unrefined
  double area_px2 = 0;
};

/// A tag under a pose.
struct TagFit {
  bool visible = false;
  NormalEquations normal{};
  double worst_corner_chi2 = 0;
};

/// A pose and the tags that agree with it.
struct Consensus {
  SE3 cam_T_map{};
  Matrix6 covariance{};         ///< of cam_T_map, in the camera frame's left tangent
  double chi2 = 0;              ///< of the members
  std::vector<char> members{};  ///< by candidate
  std::vector<TagFit> fits{};   ///< of all candidates
  std::size_t count = 0;
};

/// All consensuses worth reporting: best first, then those that explain as many tags with a chi2 larger by
/// less than options.ambiguity_chi2. Candidates must be in descending order of area.
std::vector<Consensus> find_consensus(const CameraModel& camera, std::vector<Candidate>& candidates,
                                      const MultiTagOptions& options);

}  // namespace waymark::internal
