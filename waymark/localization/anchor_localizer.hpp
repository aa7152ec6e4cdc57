#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/pose/agreement.hpp"
#include "waymark/pose/floor_fit.hpp"
#include "waymark/pose/tag_pose.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct AnchorOptions {
  double max_tag_distance_m = 4.0;
  double near_distance_m = 1.0;
  double max_jump_m = 0.15;
  double max_jump_rad = 0.25;
  int jumps_to_restart = 8;
  int frames_to_start = 5;
  double max_ambiguity = 0.8;
  double unsure_sigma_m = 0.05;
  double map_sigma_m = 0.02;
  double map_sigma_rad = 0.02;
  double tilt_sigma_rad = 0.005;
  double drift_share = 0.03;
  double drift_rad_per_m = 0.03;
  bool plain = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_tag_distance_m,
          Field{"max_tag_distance_m", "Maximum distance of a tag that is used.", 0.1});
    visit(self.near_distance_m,
          Field{"near_distance_m",
                "Distance of a tag below which its fix is accepted regardless of the jump.", 0});
    visit(self.max_jump_m,
          Field{"max_jump_m", "Largest change of position that the fix of a far tag may cause.", 0});
    visit(self.max_jump_rad,
          Field{"max_jump_rad", "Largest change of heading that the fix of a far tag may cause.", 0});
    visit(
        self.jumps_to_restart,
        Field{
            "jumps_to_restart",
            "Number of consecutive frames that contradict the estimate after which the estimate is replaced.",
            1, 1000});
    visit(
        self.frames_to_start,
        Field{"frames_to_start", "Number of frames that must agree before the pose is initialised.", 1, 100});
    visit(self.max_ambiguity, Field{"max_ambiguity",
                                    "Largest ambiguity (ratio of the errors of its two poses) of a single "
                                    "tag that may initialise the pose.",
                                    0, 1});
    visit(self.unsure_sigma_m,
          Field{"unsure_sigma_m",
                "Standard deviation of the position above which all tags of a frame are used together.", 0,
                10});
    visit(self.map_sigma_m,
          Field{"map_sigma_m",
                "Standard deviation of the position of a mapped tag relative to its neighbours.", 0, 10});
    visit(self.map_sigma_rad,
          Field{"map_sigma_rad",
                "Standard deviation of the orientation of a mapped tag relative to its neighbours.", 0, 3});
    visit(self.tilt_sigma_rad,
          Field{"tilt_sigma_rad", "Standard deviation of the tilt of the robot on its floor.", 1e-6, 3});
    visit(self.drift_share,
          Field{"drift_share", "Standard deviation that odometry adds, as a share of the distance.", 0, 1});
    visit(self.drift_rad_per_m,
          Field{"drift_rad_per_m", "Standard deviation of the heading that odometry adds per metre.", 0, 10});
    visit(self.plain, Field{"plain",
                            "Use the published algorithm alone: the better pose of the nearest tag, without "
                            "floor constraint, other tags or uncertainty."});
  }
};

/// Localization from the nearest tag in the map, and from odometry between fixes. Follows "Marker-Based
/// Visual Localization with AprilTags and Odometry Fusion", sections "Choosing the Best Tag" and "Odometry
/// Fusion and Outlier Rejection". A fix becomes the new anchor if it does not jump or its tag is near. It
/// must also be at least as certain as the odometry since the last fix. Fixes are never averaged. The robot
/// is assumed to be on a level floor, which constrains each tag pose (fit_to_floor). Of the two poses of a
/// tag, the one nearer to the prediction is used. This method is the baseline for the filters. The floor
/// constraint, the votes at the start and the covariances are not in the paper; `plain` disables them. For
/// the equations, see docs/concepts/teach_and_replay.md.
class AnchorLocalizer final : public LocalizationMethod {
 public:
  /// `more_cameras` contains all cameras except the first. A frame that does not name one of them is from the
  /// first camera.
  AnchorLocalizer(TagMap map, CameraModel camera, const SE3& base_T_cam, const AnchorOptions& options = {},
                  std::vector<MountedCamera> more_cameras = {});

  using LocalizationMethod::add;
  void add(const TagFrame& frame) override;
  void add(const Odometry& odometry) override;
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const override;

  [[nodiscard]] int fixes() const { return fixes_; }
  [[nodiscard]] int rejected() const { return rejected_; }

 private:
  /// A mapped tag in a frame, with a pose of the base for each of the tag's two poses.
  struct Observation {
    std::vector<FloorFit> map_X_base{};
    double distance_m = 0;
    double ambiguity_ratio = 0;
  };
  struct Fix {
    Uncertain<SE2> map_X_base;
    double distance_m;  ///< distance to the nearest tag used
  };
  using Votes = std::vector<internal::Vote<SE2>>;
  [[nodiscard]] std::vector<Observation> observations(const TagFrame& frame) const;
  [[nodiscard]] static std::optional<Fix> fix_from_nearest(const std::vector<Observation>& seen,
                                                           const Uncertain<SE2>& predicted);
  [[nodiscard]] static std::optional<Fix> fix_from_all(const std::vector<Observation>& seen);
  [[nodiscard]] static Votes votes_of(const std::vector<Observation>& seen, const SE2& base_X_to);
  void initialise(const std::vector<Observation>& seen, const SE2& odom_T_base);
  void anchor(const Uncertain<SE2>& map_X_base, const SE2& odom_T_base);
  void add_published(const TagFrame& frame, const SE2& odom_T_base);
  [[nodiscard]] Uncertain<SE2> predicted_pose(const SE2& odom_T_base) const;
  [[nodiscard]] std::optional<SE2> odometry_at(SensorTime stamp) const;
  [[nodiscard]] bool accepted(const Fix& fix, const SE2& map_X_predicted) const;

  TagMap map_;
  /// The cameras in the form expected by camera_of().
  struct Cameras {
    CameraModel camera;
    SE3 base_T_cam;
    std::vector<MountedCamera> more_cameras;
  };
  Cameras cameras_;
  AnchorOptions options_;
  std::deque<Odometry> odometry_;  ///< odometry from the last second, for frames that arrive late
  std::optional<SE2> map_T_odom_;
  Eigen::Matrix3d fix_covariance_ = Eigen::Matrix3d::Zero();
  double driven_since_fix_m_ = 0;
  int contradictions_ = 0;          ///< number of consecutive contradictions
  std::deque<Votes> recent_votes_;  ///< map_X_odom from the latest frames, while there is no anchor
  int fixes_ = 0;
  int rejected_ = 0;
};

}  // namespace waymark
