#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/mapping/scene/scene_bundle.hpp"
#include "waymark/mapping/solver/map_search.hpp"

namespace waymark {

/// Error model.
enum class SceneModel : std::uint8_t {
  /// Constant extrinsics, estimated corner noise, outliers rejected.
  Waymark,
  /// The cost of TagSLAM: every observation, its pixel noise, cameras that wiggle if its files specify that.
  Tagslam,
};

struct SceneMapOptions {
  SceneModel model = SceneModel::Waymark;
  SearchOptions search{};
  int min_observations = 2;
  bool free_intrinsics = false;  ///< estimate camera parameters too, near those given (model waymark only)
  /// The images are from one video: those with persistent errors together get the weight of one image (model
  /// waymark only).
  bool correlated_noise = false;
  /// Relative standard deviation of the common print size of all tags, included in every covariance. Empty:
  /// 0.005 if distances are given, otherwise the size is exact.
  std::optional<double> size_sigma{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    SearchOptions::fields(self.search, visit);
    visit(self.min_observations,
          Field{"min_observations", "Minimum number of images in which an unlisted tag must be observed.", 1,
                1000});
  }
};

/// Tags that are connected to the rest only by observations of a few tags.
struct SceneCut {
  std::vector<TagId> beyond{};  ///< the weakly connected tags
  std::vector<TagId> by{};      ///< tags whose observations connect them
  int observations = 0;
};

/// An observation assigned to a tag other than that of its id.
struct CorrectedId {
  std::size_t frame = 0;
  TagId read{}, is{};
};

/// Given and estimated parameters of a camera.
struct FoundIntrinsics {
  std::size_t camera = 0;
  std::vector<std::string> names{};
  Eigen::VectorXd given{}, prior_sigma{}, found{}, sigma{};
};

struct SceneMap {
  TagScene scene{};  ///< including unlisted tags that were observed
  SceneObservations observations{};
  SceneBundle problem{};
  std::vector<char> placed{};  ///< of each pose of the problem
  BundleCovariance covariance{};
  BundleSummary summary{};
  double cost = 0;      ///< half the sum of squared residuals in use, with the model's noise
  double noise_px = 0;  ///< standard deviation of a corner coordinate, estimated or from the model
  double reprojection_mean_px = 0;  ///< of the corners in use
  double reprojection_median_px = 0;
  std::vector<RejectedObservation> rejected{};
  std::vector<CorrectedId> corrected_ids{};       ///< misread ids assigned to another tag
  std::vector<std::vector<TagId>> unconnected{};  ///< groups of tags without a connection to the map
  std::vector<SceneCut> left_out_cuts{};          ///< unconnected groups with only unconfirmed connections
  std::vector<SceneCut> thin_cuts{};              ///< weakly connected parts of the map, the largest first
  std::vector<TagId> undetermined{};              ///< in the map, but without a determined pose
  std::vector<FoundIntrinsics> intrinsics{};      ///< of estimated cameras; `scene` contains the estimates
  double size_scale = 1;            ///< factor of all tag sizes, estimated if distances are given
  double size_sigma = 0;            ///< of size_scale; 0: not estimated
  double size_prior_sigma = 0.005;  ///< prior standard deviation of size_scale
  std::vector<Vector6> by_size{};   ///< d(pose) / d(size_scale), already included in `covariance`
  double correlated_frames = 1;     ///< this many images count as one
  std::vector<TagId>
      rejected_tags{};  ///< unlisted with too few observations, or inconsistent: not in the map

  /// Pose of a tag of a static body; empty if it is not in the map.
  [[nodiscard]] std::optional<SE3> map_T_tag(std::size_t body, std::size_t tag) const;
};

/// Estimates the tags, extrinsics and motions that best explain all observations. Initial values come only
/// from the priors in the scene. Fails if no observed tag is connected to the map, and if `progress` stops
/// the search.
[[nodiscard]] Result<SceneMap> map_scene(const TagScene& scene, const SceneRecording& recording,
                                         const SceneMapOptions& options = {},
                                         const MapProgress& progress = {});

}  // namespace waymark
