#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// Reflectance of a surface; 1 is white paper in nominal illumination.
struct Finish {
  double reflectance = 0.6;  ///< mean reflectance
  double contrast = 0;       ///< largest deviation of the texture from the mean
  int texture = 0;           ///< index in kFloorTextures
  double cell_m = 0.3;       ///< side length of a tile, or size of the largest blobs
  double gloss = 0;          ///< brightness of the lamp's specular reflection; 0 for matt surfaces
  bool two_sided = false;    ///< whether the surface is also visible from behind, as blank
};

/// A flat rectangle. Its frame is like that of a tag, as seen by a viewer of its front: origin in the middle,
/// x right, y down, z into the surface.
struct SceneSurface {
  SE3 map_T_surface{};
  double width_m = 0;
  double height_m = 0;
  Finish finish{};
  std::optional<TagId> tag{};  ///< printed in the middle of the surface
  double tag_size_m = 0;       ///< side length of the square where the black border meets the white one
};

/// All surfaces and lights that a camera can see.
struct Scene {
  std::vector<SceneSurface> surfaces{};  ///< if two are in the same plane, the later one is on top
  Eigen::Vector3d map_t_lamp = {0, 0, 2.4};
  double sky_reflectance = 0.5;  ///< brightness outside all surfaces
};

/// Parameters of the scene's appearance that a world does not define.
struct SceneOptions {
  double room_margin_m = 1.5;
  double room_height_m = 2.5;
  double wall_reflectance = 0.55;
  double wall_contrast = 0.08;
  double ink_gloss = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.room_margin_m,
          Field{"room_margin_m", "Distance from the objects of the world to the walls of the room.", 0.1,
                1000});
    visit(self.room_height_m, Field{"room_height_m", "Height of the room; 0: no walls, no ceiling.", 0, 100});
    visit(self.wall_reflectance, Field{"wall_reflectance", "Reflectance of walls and ceiling.", 0, 1});
    visit(self.wall_contrast, Field{"wall_contrast", "Contrast of the texture of walls and ceiling.", 0, 1});
    visit(self.ink_gloss,
          Field{"ink_gloss",
                "Specular reflectance of a tag for the lamp (glare); 1: as bright as white paper.", 0, 100});
  }
};

/// The appearance of a world: tags on white paper, boards, walls, furniture, the floor, and a surrounding
/// room with a lamp below the centre of its ceiling. Tags are in map order, so the same world always gives
/// the same scene.
[[nodiscard]] Scene scene_of(const World& world, const SceneOptions& options = {});

/// An upright or horizontal rectangle with a single finish, used as an obstacle such as a person's leg or a
/// poster.
[[nodiscard]] SceneSurface plain_surface(const SE3& map_T_surface, double width_m, double height_m,
                                         const Finish& finish);

/// A tag on white paper, with `margin_cells` around the total width of the tag.
[[nodiscard]] SceneSurface tag_surface(const TagId& tag, const SE3& map_T_tag, double size_m,
                                       double margin_cells = 1);

/// Fails on the first invalid surface: sizes that are not positive, non-finite poses, tags that do not exist
/// or that are larger than their paper.
[[nodiscard]] Status check(const Scene& scene);

}  // namespace waymark
