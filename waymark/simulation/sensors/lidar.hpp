#pragma once

#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// A lidar that rotates in a plane parallel to the floor.
struct LidarOptions {
  double rate_hz = 0;
  int rays = 360;
  double first_ray_deg = -180;
  double range_min_m = 0.12;
  double range_max_m = 8;
  double noise_m = 0.01;
  double dropout = 0.01;
  double x_m = 0;
  double y_m = 0;
  double z_m = 0.15;
  double yaw_deg = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.rate_hz, Field{"rate_hz", "Scans per second; 0: no lidar.", 0, 100});
    visit(self.rays, Field{"rays", "Number of rays per scan.", 1, 100000});
    visit(self.first_ray_deg,
          Field{"first_ray_deg", "Direction of the first ray; the others follow counter-clockwise.", -360,
                360});
    visit(self.range_min_m, Field{"range_min_m", "Minimum measured range.", 0, 1000});
    visit(self.range_max_m, Field{"range_max_m", "Maximum measured range.", 0, 1000});
    visit(self.noise_m, Field{"noise_m", "Standard deviation of a range.", 0, 10});
    visit(self.dropout, Field{"dropout", "Probability that a ray returns no range.", 0, 1});
    visit(self.x_m, Field{"x_m", "Position of the lidar on the robot, forward.", -10, 10});
    visit(self.y_m, Field{"y_m", "Position of the lidar on the robot, to the left.", -10, 10});
    visit(self.z_m, Field{"z_m", "Height of the lidar above the floor.", 0, 10});
    visit(self.yaw_deg,
          Field{"yaw_deg", "Direction of the lidar's zero on the robot, counter-clockwise.", -360, 360});
  }
};

/// The objects at the height of the lidar: walls, furniture, and boards with tags.
class Lidar {
 public:
  Lidar(const World& world, const LidarOptions& options);

  /// One revolution that ends at `stamp` with the robot at map_T_base; during the revolution the robot moved
  /// with `twist` (base x, y [m/s], yaw [rad/s]). The range is infinite for lost rays and for rays without an
  /// object in range. O(rays * objects).
  [[nodiscard]] LaserScan scan(const SE2& map_T_base, const Eigen::Vector3d& twist, SensorTime stamp,
                               Random& random) const;
  /// Distance along the ray from `map_p` in direction `angle_rad`; infinite if the ray hits nothing.
  [[nodiscard]] double range_m(const Eigen::Vector2d& map_p, double angle_rad) const;

 private:
  /// A rectangle in the plane of the rays.
  struct Footprint {
    Eigen::Vector2d centre_m = Eigen::Vector2d::Zero();
    Eigen::Vector2d x_axis = Eigen::Vector2d::UnitX();
    Eigen::Vector2d half_m = Eigen::Vector2d::Zero();
  };
  LidarOptions options_;
  std::vector<Footprint> things_;
};

}  // namespace waymark
