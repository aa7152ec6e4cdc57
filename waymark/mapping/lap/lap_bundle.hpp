#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/pose/agreement.hpp"

namespace waymark {

/// How much the measurements of a lap are trusted.
struct LapModelOptions {
  /// Of corners without a covariance (as TagPoseOptions::corner_sigma_px): weighs them against odometry.
  double corner_sigma_px = 0.3;
  double odometry_sigma_m = 0.001;
  double odometry_sigma_m_per_sqrt_m = 0.02;
  double odometry_sigma_rad = 0.002;
  double odometry_sigma_rad_per_sqrt_m = 0.03;
  double odometry_sigma_rad_per_sqrt_rad = 0.03;
  FloorOptions floor{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(
        self.corner_sigma_px,
        Field{"corner_sigma_px",
              "Standard deviation of a corner coordinate when the detector gives no covariance.", 1e-6, 1e3});
    visit(self.odometry_sigma_m,
          Field{"odometry_sigma_m",
                "Standard deviation of the odometry's distance between two frames, at any distance.", 1e-9,
                10});
    visit(
        self.odometry_sigma_m_per_sqrt_m,
        Field{
            "odometry_sigma_m_per_sqrt_m",
            "Standard deviation of the odometry's distance that driving adds, m per square root of a metre.",
            0, 10});
    visit(self.odometry_sigma_rad,
          Field{"odometry_sigma_rad",
                "Standard deviation of the odometry's rotation between two frames, at any rotation.", 1e-9,
                10});
    visit(self.odometry_sigma_rad_per_sqrt_m, Field{"odometry_sigma_rad_per_sqrt_m",
                                                    "Standard deviation of the odometry's rotation that "
                                                    "driving adds, rad per square root of a metre.",
                                                    0, 10});
    visit(self.odometry_sigma_rad_per_sqrt_rad, Field{"odometry_sigma_rad_per_sqrt_rad",
                                                      "Standard deviation of the odometry's rotation that "
                                                      "turning adds, rad per square root of a radian.",
                                                      0, 10});
  }
};

/// A map that is there already and that a lap is to improve.
struct LapPrior {
  TagMap map{};              ///< a tag without covariance is known exactly and held
  std::set<TagId> frozen{};  ///< held where the map has them, whatever the lap says
};

struct TimeSpan {
  SensorTime from{}, to{};
};

/// A lap as it goes into bundle adjustment.
struct LapInput {
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};  ///< may be empty
  CameraModel camera;
  SE3 base_T_cam{};
  TagSizes sizes{};
  TagId anchor{};
  SE3 map_T_anchor{};
  std::vector<ImuSample> imu{};               ///< may be empty
  std::optional<LapPrior> prior{};            ///< then the anchor is one of its tags, where it has it
  std::vector<MountedCamera> more_cameras{};  ///< beside the first, whose frames name none of them
  /// Where the turns of the odometry come from something else than in the rest of it, one after the other;
  /// they have scales of their own.
  std::vector<TimeSpan> other_turns{};
};

/// The bundle of a lap, and where to find what in it.
struct LapBundle {
  Bundle bundle{};
  PoseIndex map = 0;                   ///< identity
  PoseIndex cam = 0;                   ///< base_T_cam of the first camera
  std::vector<PoseIndex> more_cams{};  ///< of the others, in the order of LapInput
  PoseIndex floor = 0;                 ///< map_T_floor: the plane z = 0 of floor is what the robot drives on
  std::map<TagId, PoseIndex> tags{};
  std::optional<PoseIndex> anchor{};  ///< the tag that defines where the map is
  std::vector<std::optional<PoseIndex>>
      bases{};  ///< of each frame; nothing: neither tags nor odometry place it. Frames of several cameras
                ///< with one stamp share theirs
  /// Of each corner term: its frame and the index of its detection there.
  struct Observation {
    std::size_t frame = 0;
    std::size_t detection = 0;
  };
  std::vector<Observation> observations{};

  /// Every base pose, once.
  [[nodiscard]] std::vector<PoseIndex> base_poses() const;
  /// A tag that stays where it is, whatever most of its observations say.
  [[nodiscard]] bool is_held(PoseIndex tag) const { return bundle.poses[tag].fixed || tag == anchor; }
};

/// What is known of the floor beforehand: how it leans, exactly or hardly at all. Its height is found; where
/// its origin is on it, and its heading, mean nothing.
[[nodiscard]] PosePriorFactor floor_prior(const SE3& map_T_floor, bool lean_known);

/// Unknown: every tag of the start, every base pose, the height of the floor, the scales of odometry (the
/// first of Bundle::odometry_scales; the second, where there is one, of LapInput::other_turns). The map
/// is level with the floor; the anchor holds its place and its heading, and how it leans is found. Where the
/// lap extends a map whose floor is not known, the anchor is held and the lean of the floor is found instead.
/// Frames without a tag are placed by odometry alone. The mountings of the cameras
/// are taken as known.
[[nodiscard]] LapBundle lap_bundle(const LapInput& lap, const ChainResult& start,
                                   const LapModelOptions& options = {});

/// A tag that the start does not know, once the base poses are known: its pose becomes an unknown, its
/// observations (all of frames that have a pose) terms.
void add_tag(const LapInput& lap, const TagId& tag, const SE3& map_T_tag,
             const std::vector<LapBundle::Observation>& observations, const LapModelOptions& options,
             LapBundle& result);

}  // namespace waymark

namespace waymark::internal {

/// Where a tag would have to be for one observation from a known base pose, once for each of its poses that
/// is possible; empty when the observation gives no pose. `camera`: the name of the one that saw it.
[[nodiscard]] Vote<SE3> vote_for_place(const TagDetection& detection, const std::string& camera,
                                       const LapInput& lap, const SE3& map_T_base);

/// Where the base would have to be for one observation of a tag in a known place.
[[nodiscard]] Vote<SE3> vote_for_base(const TagDetection& detection, const std::string& camera,
                                      const LapInput& lap, const SE3& map_T_tag);

}  // namespace waymark::internal
