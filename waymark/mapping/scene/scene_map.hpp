#pragma once

#include <map>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/mapping/scene/scene_bundle.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"
#include "waymark/mapping/solver/map_search.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"
#include "waymark/mapping/solver/thin_cuts.hpp"

namespace waymark {

/// The error model.
enum class SceneModel : std::uint8_t {
  /// Extrinsics are constant, corner noise is estimated, and outliers are rejected.
  Waymark,
  /// TagSLAM's cost: every observation is used with TagSLAM's pixel noise, and cameras wiggle if its files
  /// specify this.
  Tagslam,
};

struct SceneMapOptions {
  SceneModel model = SceneModel::Waymark;
  SearchOptions search{};
  int min_observations = 2;
  bool free_intrinsics = false;  ///< also estimate camera parameters, near those given (model waymark only)

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    SearchOptions::fields(self.search, visit);
    visit(self.min_observations,
          Field{"min_observations", "Minimum number of images in which an unlisted tag must be observed.", 1,
                1000});
  }
};

/// An observation that was assigned to a tag with a different id.
struct CorrectedId {
  std::size_t frame = 0;
  TagId read{}, is{};
};

/// A second tag that carries the id of a tag in the map. The map does not contain it, but its observations
/// have determined other poses.
struct DuplicateTag {
  TagId tag{};
  PoseIndex other = 0;  ///< its pose; SceneBundle::tags has that of the tag in the map
  /// Centres of the tag in the map and of the other one, in the map; in the frame of the body if it moves.
  Eigen::Vector3d here_m = Eigen::Vector3d::Zero(), there_m = Eigen::Vector3d::Zero();
  std::string moving_body{};  ///< name of the body if it moves
  double distance_m = 0;      ///< between them
  int here = 0, there = 0;    ///< number of observations in use of both
  /// Both were observed at the same time. Otherwise, it may be one tag that was moved.
  bool at_once = false;
  /// Most observations of one tag are earlier than those of the other, as if one tag had been moved: all but
  /// less than a fifth of the smaller number.
  bool one_after_the_other = false;
};

/// Odometry that contradicts the observations before and after it. The map does not use it there.
struct RejectedOdometry {
  std::size_t body = 0;
  double from_s = 0, to_s = 0;  ///< since the first frame
  double off_m = 0, off_rad = 0;
  double chi2 = 0;  ///< with 6 degrees of freedom and the estimated noise
};

/// Tags that odometry alone connects to the others. Nothing can detect an error of that odometry.
struct OdometryLink {
  std::vector<TagId> beyond{};
  double length_m = 0;  ///< of the shortest connection
  int frames = 0;       ///< number of odometry steps in it
};

/// Given and estimated parameters of a camera.
struct FoundIntrinsics {
  std::size_t camera = 0;
  std::vector<std::string> names{};
  Eigen::VectorXd given{}, prior_sigma{}, found{}, sigma{};
};

struct SceneMap {
  TagScene scene{};  ///< includes unlisted tags that were observed
  SceneObservations observations{};
  SceneBundle problem{};
  std::vector<char> placed{};  ///< whether each pose of the problem has been placed
  BundleCovariance covariance{};
  BundleSummary summary{};
  double cost = 0;      ///< half the sum of squared residuals in use, with the model's noise
  double noise_px = 0;  ///< standard deviation of a corner coordinate, either estimated or from the model
  double reprojection_mean_px = 0;  ///< mean error of the corners in use
  double reprojection_median_px = 0;
  std::vector<RejectedObservation> rejected{};
  std::vector<CorrectedId> corrected_ids{};       ///< misread ids that were assigned to another tag
  std::vector<std::vector<TagId>> unconnected{};  ///< groups of tags that are not connected to the map
  std::vector<TagCut> left_out_cuts{};  ///< unconnected groups that have only unconfirmed connections
  std::vector<TagCut> thin_cuts{};      ///< weakly connected parts of the map, with the largest first
  std::vector<TagId> undetermined{};    ///< tags that are in the map but have no determined pose
  std::map<TagId, int> prior_only{};    ///< see tags_on_prior_alone()
  /// Parameters of estimated cameras; `scene` contains the estimates.
  std::vector<FoundIntrinsics> intrinsics{};
  std::vector<std::size_t>
      released_sizes{};                  ///< indices into Bundle::sizes of sizes without their usual prior
  std::vector<WrongSize> wrong_sizes{};  ///< their tags are in the map with the size that was found
  std::vector<PoseIndex> rejected_priors{};  ///< poses whose given value is not used, since others refute it
  std::vector<MovedTag> moved_tags{};        ///< their last pose is in the map
  std::vector<MissingTag> missing_tags{};    ///< expected in images that do not show them
  /// Ids of two tags. The map has the tag at the given pose. If no pose is given, it has the tag that was
  /// observed later, if their observations follow each other, and otherwise the one with more observations.
  std::vector<DuplicateTag> duplicate_tags{};
  double assumed_size_spread = 0;  ///< SearchOptions::tag_size_sigma_percent as a share
  double size_spread = 0;          ///< relative standard deviation of the other printed sizes
  double size_scale = 1;           ///< common factor for all tag sizes; 1 if it was not estimated
  double size_sigma = 0;           ///< standard deviation of size_scale; 0 if it was not estimated
  double size_prior_sigma = 0;     ///< SearchOptions::common_tag_size_sigma_percent as a share
  double odometry_ratio = 1;       ///< ratio of estimated to given noise of odometry, at least 1
  std::vector<RejectedOdometry> rejected_odometry{};  ///< the largest first
  std::vector<OdometryLink> odometry_links{};         ///< the group with the most tags first
  double correlated_frames = 1;        ///< this many images count as one, because corner errors last
  std::vector<TagId> rejected_tags{};  ///< not in the map: unlisted and observed too rarely, or inconsistent

  /// Whether all poses of a term have been placed.
  [[nodiscard]] bool is_placed(const CornerTerm& term) const;
  /// Pose of a tag on a static body; empty if the tag is not in the map.
  [[nodiscard]] std::optional<SE3> map_T_tag(std::size_t body, std::size_t tag) const;
};

/// Estimates the tags, extrinsics and motions that best explain all observations. Initial values are taken
/// only from the priors in the scene. Fails if no observed tag is connected to the map or if `progress` stops
/// the search.
[[nodiscard]] Result<SceneMap> map_scene(const TagScene& scene, const SceneRecording& recording,
                                         const SceneMapOptions& options = {},
                                         const MapProgress& progress = {});

}  // namespace waymark
