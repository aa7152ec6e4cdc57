#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/mounting.hpp"
#include "waymark/mapping/lap/noise.hpp"
#include "waymark/mapping/solver/changed_tags.hpp"
#include "waymark/mapping/solver/map_search.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"
#include "waymark/mapping/solver/thin_cuts.hpp"

namespace waymark {

struct BundleMapOptions {
  SearchOptions search{};
  bool estimate_noise = true;
  bool find_mounting = false;
  bool keep_mounting = false;
  /// Relative standard deviation of the focal length if the mounting is estimated; 0 if the focal length is
  /// exact. The focal length is observable only with a prior map.
  double focal_share = 0;
  LapModelOptions model{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    SearchOptions::fields(self.search, visit);
    visit(self.estimate_noise,
          Field{"estimate_noise",
                "Estimate the corner noise from the residuals instead of using the detector's covariance."});
    visit(self.find_mounting, Field{"find_mounting",
                                    "Estimate the mounting of the camera together with the map, whether or "
                                    "not the lap is inconsistent with the robot file."});
    visit(self.keep_mounting,
          Field{"keep_mounting",
                "Keep the mounting of the robot file even if the lap is inconsistent with it."});
    LapModelOptions::fields(self.model, visit);
  }
};

/// The residuals in one ninth of the image.
struct ResidualRegion {
  int corners = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< mean of projected minus measured
  double rms_px = 0;
};

struct BundleMap {
  TagMap map{};             ///< tags with their covariances
  Trajectory trajectory{};  ///< poses of the base, one for each frame with tags or odometry
  TagMap start_map{};       ///< map of the chain, from which the search starts
  Trajectory start_trajectory{};
  std::vector<Matrix6> trajectory_covariance{};  ///< for each pose, as a left tangent in map
  std::map<TagId, int> observations{};           ///< number of observations in use
  std::vector<RejectedObservation> rejected{};
  std::vector<TagId> unconnected{};
  /// No two of their observations agree, so their ids are probably misread.
  std::vector<TagId> unconfirmed{};
  int frames_without_pose = 0;
  double noise_ratio = 1;                  ///< estimated corner noise relative to the detector's covariances
  std::vector<WrongSize> wrong_sizes{};    ///< their tags are in the map with the size that was found
  std::vector<MovedTag> moved_tags{};      ///< their last pose is in the map
  std::vector<MissingTag> missing_tags{};  ///< expected in images that do not show them
  std::vector<TagCut> thin_cuts{};         ///< parts of the map that depend on few observations
  double assumed_size_spread = 0;          ///< SearchOptions::tag_size_sigma_percent as a share
  double size_spread = 0;                  ///< relative standard deviation of the other printed sizes
  double size_scale = 1;                   ///< common factor for all tag sizes; 1 if it was not estimated
  double size_scale_sigma = 0;             ///< its standard deviation; 0 if it was not estimated
  double size_prior_sigma = 0;             ///< SearchOptions::common_tag_size_sigma_percent as a share
  double correlated_frames = 1;            ///< this many images count as one because corner errors persist
  OdometryScales odometry_scales{};
  OdometryScales odometry_scales_sigma{0, 0};  ///< standard deviations of the scales; 0 without odometry
  std::optional<TurnNoise> turn_noise{};       ///< noise of the odometry as recorded
  /// Whether the gyro agreed with the tags clearly better than odometry turns did.
  bool turns_by_gyro = false;
  double without_gyro_share = 0;  ///< share of the odometry time without gyro samples; 1 without a gyro
  std::array<ResidualRegion, 9> regions{};     ///< row by row from the upper left
  std::optional<MountingEstimate> mounting{};  ///< camera mounting estimated from the lap
  bool mounting_used = false;                  ///< whether the map uses it
  double rms_px = 0;                           ///< root mean square of all corner coordinates in use
  double moved_m = 0;                          ///< largest distance by which the optimisation moved a tag
  /// Warnings about tags that are not at their pose in the prior map.
  std::vector<std::string> prior_warnings{};
  int prior_agreeing = 0;  ///< number of tags that are at their pose in the prior map
  BundleSummary summary{};
};

/// The sizes of the tags in a map: the given ones with the common factor that was found, except for tags
/// whose given size contradicts the observations. Checks of a map use these sizes.
[[nodiscard]] TagSizes found_sizes(TagSizes given, const BundleMap& map);

/// Estimates the tags and the trajectory that best explain all corners, odometry and the floor (maximum
/// likelihood). The search starts from the teach chain and uses a robust loss to find outliers. It then
/// rejects these and finishes without the robust loss, so that the covariance is consistent. The anchor is
/// fixed at its given pose. If there is a prior map, the lap is then aligned with it and adjusted using its
/// information. Tags in the prior map that the lap did not observe are kept. Fails if map_by_chain() fails,
/// if fewer than two tags agree with the prior map, or if `progress` stops the search.
[[nodiscard]] Result<BundleMap> map_by_bundle(const LapInput& lap, const ChainOptions& chain = {},
                                              const BundleMapOptions& options = {},
                                              const MapProgress& progress = {});

/// The same without a copy of the lap, which takes most of the memory that mapping a long recording needs.
/// The lap is changed during the search; it has its given content again when the function returns.
[[nodiscard]] Result<BundleMap> map_by_bundle_in_place(LapInput& lap, const ChainOptions& chain = {},
                                                       const BundleMapOptions& options = {},
                                                       const MapProgress& progress = {});

}  // namespace waymark
