#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/mapping/lap/chain.hpp"
#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/tag_moves.hpp"
#include "waymark/pose/agreement.hpp"

namespace waymark {

/// Weights for the measurements of a lap.
struct LapModelOptions {
  /// Standard deviation of corners without a covariance (like TagPoseOptions::corner_sigma_px); it determines
  /// their weight relative to odometry.
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
    visit(
        self.odometry_sigma_m,
        Field{
            "odometry_sigma_m",
            "Standard deviation of the odometry's distance between two frames, independent of the distance.",
            1e-9, 10});
    visit(
        self.odometry_sigma_m_per_sqrt_m,
        Field{
            "odometry_sigma_m_per_sqrt_m",
            "Standard deviation of the odometry's distance that driving adds, m per square root of a metre.",
            0, 10});
    visit(
        self.odometry_sigma_rad,
        Field{
            "odometry_sigma_rad",
            "Standard deviation of the odometry's rotation between two frames, independent of the rotation.",
            1e-9, 10});
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

/// An existing map that a lap extends.
struct LapPrior {
  TagMap map{};              ///< tags without a covariance are exact and fixed
  std::set<TagId> frozen{};  ///< tags that are fixed at their pose in the map
};

struct TimeSpan {
  SensorTime from{}, to{};
};

/// Input for the bundle adjustment of a lap.
struct LapInput {
  std::vector<TagFrame> frames{};
  std::vector<Odometry> odometry{};  ///< may be empty
  CameraModel camera;
  SE3 base_T_cam{};
  TagSizes sizes{};
  TagId anchor{};
  SE3 map_T_anchor{};
  std::vector<ImuSample> imu{};     ///< may be empty
  std::optional<LapPrior> prior{};  ///< if set, the anchor is one of its tags and has its pose there
  /// Additional cameras; frames from the first camera have no camera name.
  std::vector<MountedCamera> more_cameras{};
  /// Time spans, in order, during which the odometry turns come from another source than at other times. They
  /// have separate scales.
  std::vector<TimeSpan> other_turns{};
};

/// The bundle for a lap, and the indices of its parts.
struct LapBundle {
  Bundle bundle{};
  PoseIndex map = 0;                   ///< the identity pose
  PoseIndex cam = 0;                   ///< base_T_cam of the first camera
  std::vector<PoseIndex> more_cams{};  ///< mounting poses of the others, in the order of LapInput
  PoseIndex floor = 0;                 ///< map_T_floor; the robot drives on the floor's plane z = 0
  std::map<TagId, PoseIndex> tags{};
  std::map<TagId, std::size_t> sizes{};  ///< index of each tag into Bundle::sizes
  double size_sigma = 0;                 ///< BundleSize::sigma of tags that are added later
  std::optional<PoseIndex> anchor{};     ///< the tag that defines the map frame, where it was at first
  std::vector<SeparatedTag> moves{};     ///< tags that were moved; `tags` has their last poses
  /// The pose for each frame; empty if neither tags nor odometry determine it. Frames from several cameras
  /// with the same stamp share a pose.
  std::vector<std::optional<PoseIndex>> bases{};
  /// The frame of a corner term, and the index of its detection in the frame.
  struct Observation {
    std::size_t frame = 0;
    std::size_t detection = 0;
  };
  std::vector<Observation> observations{};

  /// All base poses, each of them once.
  [[nodiscard]] std::vector<PoseIndex> base_poses() const;
  /// The mounting pose of a camera, by its index into Bundle::cameras.
  [[nodiscard]] PoseIndex cam_at(std::size_t camera) const {
    return camera == 0 ? cam : more_cams[camera - 1];
  }
  /// Whether the tag is fixed regardless of its observations.
  [[nodiscard]] bool is_held(PoseIndex tag) const { return bundle.poses[tag].fixed || tag == anchor; }
};

/// A prior on the tilt of the floor, which is either exact or nearly free. The height of the floor is
/// estimated; its origin and heading are arbitrary.
[[nodiscard]] PosePriorFactor floor_prior(const SE3& map_T_floor, bool lean_known);

/// The unknowns are every tag in the start, every base pose, the height of the floor, and the odometry
/// scales. The first element of Bundle::odometry_scales is the default; the second, if any, applies to
/// LapInput::other_turns. The map is level with the floor. The anchor fixes the position and the heading; its
/// tilt is estimated. If the lap extends a map with an unknown floor, the anchor is fixed and the tilt of the
/// floor is estimated instead. Frames without tags are placed by odometry alone. Camera mountings are fixed.
/// Tag sizes are exact until free_sizes() is called.
[[nodiscard]] LapBundle lap_bundle(const LapInput& lap, const ChainResult& start,
                                   const LapModelOptions& options = {});

/// Makes the printed size of each tag an unknown with this relative standard deviation, and the error that
/// all sizes share another one; 0: there is no such deviation.
void free_sizes(double sigma, double common_sigma, LapBundle& lap);

/// Adds a tag that is missing from the start to a bundle with known base poses. Its pose becomes an unknown,
/// and its observations become terms; all of them must be in frames with a pose.
void add_tag(const LapInput& lap, const TagId& tag, const SE3& map_T_tag,
             const std::vector<LapBundle::Observation>& observations, const LapModelOptions& options,
             LapBundle& result);

}  // namespace waymark

namespace waymark::internal {

/// Index of a frame's camera into Bundle::cameras: 0 for the first camera, then those of
/// LapInput::more_cameras. `name`: of the camera.
[[nodiscard]] std::size_t camera_index(const LapInput& lap, const std::string& name);

/// Tag poses in the map according to a single observation from a known base pose, one for each possible pose
/// of the tag. Empty if the observation does not determine a pose. `camera`: name of the camera.
[[nodiscard]] Vote<SE3> vote_for_place(const TagDetection& detection, const std::string& camera,
                                       const LapInput& lap, const SE3& map_T_base);

/// Base poses according to a single observation of a tag with a known pose.
[[nodiscard]] Vote<SE3> vote_for_base(const TagDetection& detection, const std::string& camera,
                                      const LapInput& lap, const SE3& map_T_tag);

}  // namespace waymark::internal
