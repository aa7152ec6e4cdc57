#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/geometry/se2.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

/// An upright wall on the floor: a box `thickness_m` wide, centred on the line between two points.
struct Wall {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  double height_m = 2.5;
  double thickness_m = 0.1;
  double reflectance = 0.6;  ///< fraction of light that is reflected, 0 to 1
};

/// Furniture or any other object that blocks light and lidar rays.
struct Occluder {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0;                                ///< angle of its x axis, measured from map x to map y
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();  ///< along its own x, y and z
  double reflectance = 0.35;
};

/// A flat white board; the world's tags on it lie in its front face.
struct Panel {
  SE3 map_T_panel{};  ///< axes like those of a tag: origin in the middle of the front face, x right, y down,
                      ///< z into the board
  double width_m = 0;
  double height_m = 0;
  double thickness_m = 0.01;
  double reflectance = 0.9;
  std::vector<TagId> tags{};  ///< the tags on it
};

/// An area of the floor where robots must not drive: a polygon with corners in either order.
struct KeepOut {
  std::vector<Eigen::Vector2d> corners_m{};
};

/// Appearance of the floor.
struct Floor {
  std::string texture = "speckle";  ///< one of kFloorTextures
  double reflectance = 0.45;        ///< mean reflectance
  double contrast = 0.15;           ///< largest difference from the mean
  double cell_m = 0.3;              ///< side length of a tile or plank, or size of the largest blobs
};

inline constexpr std::array<std::string_view, 4> kFloorTextures{"plain", "tiles", "checker", "speckle"};

/// A tag with a number that already exists in the world, which is a common mistake.
struct TagCopy {
  TagId tag{};
  MappedTag placed{};
};

/// A place with tags and a line to drive along. The frame is map: z points up, and the floor is at z = 0.
struct World {
  std::string name{};
  TagMap tags{};
  TagId anchor{};                         ///< the tag with a known pose
  std::vector<Eigen::Vector2d> path_m{};  ///< points on a smooth line that a driver follows
  bool path_closed = true;
  std::vector<TagCopy> copies{};
  double tag_margin_cells = 1;  ///< white paper around every tag, in tag cells
  /// if positive, every tag is on a board of this thickness and is also printed on its back
  double tag_board_m = 0;
  /// Whether the corner camera also detects tags hidden by the paper of another tag or by a panel; in images
  /// they are always hidden.
  bool corners_through_paper = false;
  std::vector<Panel> panels{};
  std::vector<Wall> walls{};
  std::vector<Occluder> occluders{};
  std::vector<KeepOut> keep_outs{};
  Floor floor{};
};

/// The pose of an upright tag with its centre at (x, y, z). `facing_rad` is the direction from the tag to its
/// viewer, measured from map x to map y.
[[nodiscard]] SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad);

/// The same, tilted backwards by `tilt_rad`; at pi / 2 the tag lies on its back and faces up.
[[nodiscard]] SE3 leaning_tag(const Eigen::Vector3d& map_t_tag, double facing_rad, double tilt_rad);

/// The tag on the back of a board of this thickness, upright like the one on the front.
[[nodiscard]] MappedTag back_of(const MappedTag& tag, double board_m);

/// Every visible side of every tag: both sides for tags on boards, and copies. O(tags).
[[nodiscard]] std::vector<TagCopy> readable_tags(const World& world);

/// The box of a wall.
[[nodiscard]] Occluder as_box(const Wall& wall);

/// Distance along a ray to the box, as a multiple of `direction`: 0 if the origin is inside, infinity if the
/// ray misses. Uses the slab method (Kay and Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986). O(1).
[[nodiscard]] double ray_length(const Occluder& box, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction);

/// Whether no wall or occluder blocks the line between two points. Objects in the last 1 % before `to` are
/// ignored, so that a tag on a wall is visible. O(walls + occluders).
[[nodiscard]] bool line_of_sight(const World& world, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// A point on a sampled path.
struct PathPoint {
  SE2 map_T_path{};  ///< x points along the path
  double arc_length_m = 0;
  double curvature_1_m = 0;
};

/// Samples a smooth curve through points at equal steps of arc length, about `step_m` long. The curve is a
/// centripetal Catmull-Rom spline (Barry and Goldman, "A recursive evaluation algorithm for a class of
/// Catmull-Rom splines", SIGGRAPH 1988; Yuksel et al. 2011). Empty if there are fewer than three distinct
/// points.
[[nodiscard]] std::vector<PathPoint> sample_path(const std::vector<Eigen::Vector2d>& points_m, bool closed,
                                                 double step_m);

/// Distance [m], seen from above, from the hull to the nearest wall or piece of furniture that is below the
/// hull's height. 0 if they touch, infinite in an empty world. Higher objects (tags on walls) are ignored.
/// O(walls + occluders).
[[nodiscard]] double obstacle_distance_m(const World& world, const Hull& hull, const SE2& map_T_base);

}  // namespace waymark
