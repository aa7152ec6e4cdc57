#pragma once

#include <deque>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/localization/method.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct AnchorOptions {
  double max_tag_distance_m = 4.0;
  double near_distance_m = 1.0;
  double max_jump_m = 0.15;
  double max_jump_rad = 0.25;
  int jumps_until_believed = 8;
  double max_ambiguity = 0.8;
  double drift_share = 0.03;
  double drift_rad_per_m = 0.03;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.max_tag_distance_m, Field{"max_tag_distance_m", "Farther tags are not used.", 0.1});
    visit(self.near_distance_m,
          Field{"near_distance_m", "A fix from a nearer tag is believed whatever it says.", 0});
    visit(self.max_jump_m,
          Field{"max_jump_m", "A fix from a far tag may not move the estimate by more …", 0});
    visit(self.max_jump_rad, Field{"max_jump_rad", "… nor turn it by more.", 0});
    visit(self.jumps_until_believed,
          Field{"jumps_until_believed",
                "So many rejected fixes in a row mean that the estimate is wrong, not they.", 1, 1000});
    visit(self.max_ambiguity,
          Field{"max_ambiguity",
                "A tag whose two poses fit almost equally (ratio of their errors) is not used.", 0, 1});
    visit(self.drift_share,
          Field{"drift_share", "Standard deviation that odometry adds, as a share of the way.", 0, 1});
    visit(self.drift_rad_per_m,
          Field{"drift_rad_per_m", "Heading error that odometry adds per metre.", 0, 10});
  }
};

/// The nearest tag of the map says where the robot is; between fixes odometry carries on from there. Fixes
/// that jump while the tag is far are rejected ("Marker-Based Visual Localization with AprilTags and Odometry
/// Fusion", sections "Choosing the Best Tag" and "Odometry Fusion and Outlier Rejection"). The baseline that
/// the filters must beat.
class AnchorLocalizer final : public LocalizationMethod {
 public:
  AnchorLocalizer(TagMap map, CameraModel camera, const SE3& base_T_cam, const AnchorOptions& options = {});

  void add(const TagFrame& frame) override;
  void add(const Odometry& odometry) override;
  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const override;

  [[nodiscard]] int fixes() const { return fixes_; }
  [[nodiscard]] int rejected() const { return rejected_; }

 private:
  struct Fix {
    SE2 map_T_base;
    Eigen::Matrix3d covariance;
    double distance_m;
  };
  [[nodiscard]] std::optional<Fix> fix_from_nearest(const TagFrame& frame) const;
  [[nodiscard]] std::optional<SE2> odometry_at(SensorTime stamp) const;
  [[nodiscard]] bool believed(const Fix& fix, const SE2& map_T_predicted) const;

  TagMap map_;
  CameraModel camera_;
  SE3 base_T_cam_;
  AnchorOptions options_;
  std::deque<Odometry> odometry_;  ///< the last second, for frames that arrive late
  std::optional<SE2> map_T_odom_;
  Eigen::Matrix3d fix_covariance_ = Eigen::Matrix3d::Zero();
  double driven_since_fix_m_ = 0;
  int rejected_in_a_row_ = 0;
  int fixes_ = 0;
  int rejected_ = 0;
};

}  // namespace waymark
