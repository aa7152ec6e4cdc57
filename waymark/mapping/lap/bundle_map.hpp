#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/lap/mounting.hpp"
#include "waymark/mapping/lap/noise.hpp"
#include "waymark/mapping/solver/map_search.hpp"

namespace waymark {

struct BundleMapOptions {
  SearchOptions search{};
  bool estimate_noise = true;
  bool find_mounting = false;
  bool keep_mounting = false;
  /// By which the focal length of the camera may be off where the mounting is found; 0: it is known. Only a
  /// map that is there already tells it.
  double focal_share = 0;
  LapModelOptions model{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    SearchOptions::fields(self.search, visit);
    visit(self.estimate_noise,
          Field{"estimate_noise",
                "Estimate the corner noise from the residuals instead of taking the detector's covariance."});
    visit(self.find_mounting, Field{"find_mounting",
                                    "Estimate the mounting of the camera together with the map, whether or "
                                    "not the lap contradicts the robot's file."});
    visit(
        self.keep_mounting,
        Field{"keep_mounting", "Keep the mounting of the robot's file, also where the lap contradicts it."});
    LapModelOptions::fields(self.model, visit);
  }
};

/// What is left over in a ninth of the picture.
struct ResidualRegion {
  int corners = 0;
  Eigen::Vector2d mean_px = Eigen::Vector2d::Zero();  ///< projected less measured
  double rms_px = 0;
};

struct BundleMap {
  TagMap map{};             ///< with covariances
  Trajectory trajectory{};  ///< of the base, one pose for each frame that tags or odometry place
  TagMap start_map{};       ///< of the chain, where the search began
  Trajectory start_trajectory{};
  std::vector<Matrix6> trajectory_covariance{};  ///< of each pose, left tangent in map
  std::map<TagId, int> observations{};           ///< in use
  std::vector<RejectedObservation> rejected{};
  std::vector<TagId> unconnected{};
  std::vector<TagId> unconfirmed{};  ///< no two of their observations agree: most likely misread ids
  int frames_without_pose = 0;
  double noise_ratio = 1;        ///< corner noise found over what the detector claims
  double correlated_frames = 1;  ///< so many pictures weigh as one: errors of corners last
  OdometryScales odometry_scales{};
  OdometryScales odometry_scales_sigma{0, 0};  ///< standard deviations; 0 without odometry
  std::optional<TurnNoise> turn_noise{};       ///< of the wheels as they were recorded
  bool turns_by_gyro = false;                  ///< the wheels' own turns agreed with the tags clearly worse
  double without_gyro_share = 0;               ///< of the time of the odometry; 1 without any gyro
  std::array<ResidualRegion, 9> regions{};     ///< by rows, from the upper left
  std::optional<MountingEstimate> mounting{};  ///< where the camera sits by what the lap says
  bool mounting_used = false;                  ///< the map rests on it
  double rms_px = 0;                           ///< root mean square of all corner coordinates in use
  double moved_m = 0;                          ///< how far the optimisation moved the tag it moved most
  std::vector<std::string> prior_words{};      ///< tags that are not where the prior map has them
  int prior_agreeing = 0;                      ///< tags that are
  BundleSummary summary{};
};

/// Tags and trajectory that explain all corners, wheels and the floor best (maximum likelihood): starts from
/// the teach chain, finds what contradicts the rest with a robust loss, leaves it out, and finishes without
/// one, so that the covariance means what it says. The anchor is held where it is given. With a prior map the
/// lap is then moved onto it and adjusted together with what the map knows; tags the lap did not see stay in
/// the map. Fails as map_by_chain does, when fewer than two tags agree with the prior map, and when
/// `progress` ends it.
[[nodiscard]] Result<BundleMap> map_by_bundle(const LapInput& lap, const ChainOptions& chain = {},
                                              const BundleMapOptions& options = {},
                                              const MapProgress& progress = {});

}  // namespace waymark
