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

/// An upright wall on the floor: the box `thickness_m` wide about the line from one point to the other.
struct Wall {
  Eigen::Vector2d from_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_m = Eigen::Vector2d::Zero();
  double height_m = 2.5;
  double thickness_m = 0.1;
  double reflectance = 0.6;  ///< share of light it gives back, 0 to 1
};

/// Furniture, or anything else that stands in the way of light and of lidar rays.
struct Occluder {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double yaw_rad = 0;                                ///< its x axis from map x to map y
  Eigen::Vector3d size_m = Eigen::Vector3d::Ones();  ///< along its own x, y, z
  double reflectance = 0.35;
};

/// A flat white board that carries tags: the world's tags on it lie in its front face.
struct Panel {
  SE3 map_T_panel{};  ///< as a tag: middle of the front face, x right, y down, z into the board
  double width_m = 0;
  double height_m = 0;
  double thickness_m = 0.01;
  double reflectance = 0.9;
  std::vector<TagId> tags{};  ///< which tags are on it
};

/// A piece of floor where no robot may go: a polygon, its corners one way or the other round.
struct KeepOut {
  std::vector<Eigen::Vector2d> corners_m{};
};

/// What the floor looks like.
struct Floor {
  std::string texture = "speckle";  ///< one of kFloorTextures
  double reflectance = 0.45;        ///< mean
  double contrast = 0.15;           ///< largest difference from the mean
  double cell_m = 0.3;              ///< side of a tile or plank, size of the largest blobs
};

inline constexpr std::array<std::string_view, 4> kFloorTextures{"plain", "tiles", "checker", "speckle"};

/// A tag whose number is already in the world: a mistake that people make.
struct TagCopy {
  TagId tag{};
  MappedTag placed{};
};

/// A place with tags and a line to drive. Frame map: z up, floor at z = 0.
struct World {
  std::string name{};
  TagMap tags{};
  TagId anchor{};                         ///< the tag whose pose is known beforehand
  std::vector<Eigen::Vector2d> path_m{};  ///< points of a smooth line a driver follows
  bool path_closed = true;
  std::vector<TagCopy> copies{};
  double tag_margin_cells = 1;  ///< white paper around every tag, in cells of the tag
  double tag_board_m = 0;  ///< above 0: every tag is on a board so thick, and printed on its back as well
  /// The corner camera sees tags that the paper of another tag or a panel hides; pictures hide them.
  bool corners_through_paper = false;
  std::vector<Panel> panels{};
  std::vector<Wall> walls{};
  std::vector<Occluder> occluders{};
  std::vector<KeepOut> keep_outs{};
  Floor floor{};
};

/// The pose of an upright tag: centre at (x, y, z), `facing_rad` the direction from the tag to its reader,
/// from map x to map y.
[[nodiscard]] SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad);

/// The same, leaning back by `tilt_rad`: at pi / 2 it lies on its back and faces up.
[[nodiscard]] SE3 leaning_tag(const Eigen::Vector3d& map_t_tag, double facing_rad, double tilt_rad);

/// The tag on the back of a board of that thickness, upright as the one on its front.
[[nodiscard]] MappedTag back_of(const MappedTag& tag, double board_m);

/// Every tag that can be read, with both sides of those on boards, and copies: what a camera may see.
/// O(tags).
[[nodiscard]] std::vector<TagCopy> readable_tags(const World& world);

/// The box of a wall.
[[nodiscard]] Occluder as_box(const Wall& wall);

/// How far a ray goes before it meets the box, in lengths of `direction`: 0 from inside, infinity when it
/// passes by. Slab method (Kay and Kajiya, "Ray tracing complex scenes", SIGGRAPH 1986). O(1).
[[nodiscard]] double ray_length(const Occluder& box, const Eigen::Vector3d& origin,
                                const Eigen::Vector3d& direction);

/// Whether nothing stands between two points: no wall, no occluder. What begins in the last 1 % before `to`
/// does not count, so that a tag on a wall is seen. O(walls + occluders).
[[nodiscard]] bool line_of_sight(const World& world, const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// A point of a sampled path.
struct PathPoint {
  SE2 map_T_path{};  ///< x along the path
  double arc_length_m = 0;
  double curvature_1_m = 0;
};

/// Samples a smooth curve through points (centripetal Catmull-Rom: Barry and Goldman, "A recursive evaluation
/// algorithm for a class of Catmull-Rom splines", SIGGRAPH 1988; Yuksel et al. 2011) at even steps of arc
/// length of about `step_m`. Empty for fewer than three distinct points.
[[nodiscard]] std::vector<PathPoint> sample_path(const std::vector<Eigen::Vector2d>& points_m, bool closed,
                                                 double step_m);

/// From the hull to the nearest wall or piece of furniture that is as low as the hull is high, seen from
/// above [m]; 0 when they touch, infinite in an empty world. What hangs higher (tags on walls) is not met.
/// O(walls + occluders).
[[nodiscard]] double obstacle_distance_m(const World& world, const Hull& hull, const SE2& map_T_base);

}  // namespace waymark
