#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/mapping/scene/scene_bundle.hpp"
#include "waymark/mapping/solver/map_search.hpp"

namespace waymark {

/// What the errors are taken to be.
enum class SceneModel : std::uint8_t {
  Waymark,  ///< extrinsics that stay, corner noise estimated, observations that contradict the others left
            ///< out
  Tagslam,  ///< what TagSLAM minimises: every observation, its pixel noise, cameras that wiggle where its
            ///< files say so
};

struct SceneMapOptions {
  SceneModel model = SceneModel::Waymark;
  SearchOptions search{};
  int min_observations = 2;
  bool free_intrinsics = false;  ///< cameras are found as well, near what is given (model waymark only)
  /// Pictures of one video: errors that last from picture to picture weigh as one (model waymark only).
  bool correlated_noise = false;
  /// Relative standard deviation of the size that all tags were printed in, which then is part of every
  /// covariance. Nothing: 0.005 where distances are given, else the size is exact.
  std::optional<double> size_sigma{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    SearchOptions::fields(self.search, visit);
    visit(self.min_observations,
          Field{"min_observations",
                "Minimum number of pictures in which a tag that is on no list must be observed.", 1, 1000});
  }
};

/// Tags that hang on the rest by observations of some of them.
struct SceneCut {
  std::vector<TagId> beyond{};  ///< what hangs
  std::vector<TagId> by{};      ///< on observations of these
  int observations = 0;
};

/// An observation that counts for another tag than the one whose id was read.
struct CorrectedId {
  std::size_t frame = 0;
  TagId read{}, is{};
};

/// The numbers of a camera: as given, as found.
struct FoundIntrinsics {
  std::size_t camera = 0;
  std::vector<std::string> names{};
  Eigen::VectorXd given{}, prior_sigma{}, found{}, sigma{};
};

struct SceneMap {
  TagScene scene{};  ///< with the tags that were found
  SceneObservations observations{};
  SceneBundle problem{};
  std::vector<char> placed{};  ///< of each pose of the problem
  BundleCovariance covariance{};
  BundleSummary summary{};
  double cost = 0;                  ///< half the sum of squares of everything in use, by the model's noise
  double noise_px = 0;              ///< of a corner coordinate: estimated, or the model's
  double reprojection_mean_px = 0;  ///< distance of corners in use from where they project
  double reprojection_median_px = 0;
  std::vector<RejectedObservation> rejected{};
  std::vector<CorrectedId> corrected_ids{};       ///< misread: their corners are exactly those of another tag
  std::vector<std::vector<TagId>> unconnected{};  ///< not tied to the map: tags that hang together
  std::vector<SceneCut> left_out_cuts{};  ///< of the unconnected: tied by observations that nothing confirms
  std::vector<SceneCut> thin_cuts{};      ///< of what is in the map, the largest part first
  std::vector<TagId> undetermined{};      ///< in the map, but nothing determines where
  std::vector<FoundIntrinsics> intrinsics{};  ///< of cameras that were free; `scene` has them as found
  double size_scale = 1;                      ///< of all tags, found where distances are given
  double size_sigma = 0;                      ///< of size_scale; 0: it was not looked for
  double size_prior_sigma = 0.005;            ///< of it beforehand
  std::vector<Vector6> by_size{};             ///< d(pose) / d(size_scale), in `covariance` already
  double correlated_frames = 1;               ///< so many pictures weigh as one
  std::vector<TagId> rejected_tags{};         ///< on no list and hardly seen, or contradicted: not in the map

  /// Where a tag of a static body is; nothing when it is not in the map.
  [[nodiscard]] std::optional<SE3> map_T_tag(std::size_t body, std::size_t tag) const;
};

/// Tags, extrinsics and motions that explain all observations best, from no start but what the scene knows.
/// Fails when nothing leads to the map, and when `progress` ends it.
[[nodiscard]] Result<SceneMap> map_scene(const TagScene& scene, const SceneRecording& recording,
                                         const SceneMapOptions& options = {},
                                         const MapProgress& progress = {});

}  // namespace waymark
