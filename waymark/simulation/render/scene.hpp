#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

/// How a surface gives back light. 1 is white paper in nominal light.
struct Finish {
  double reflectance = 0.6;  ///< mean
  double contrast = 0;       ///< largest difference of the texture from the mean
  int texture = 0;           ///< index in kFloorTextures
  double cell_m = 0.3;       ///< side of a tile, size of the largest blobs
  double gloss = 0;          ///< how bright the lamp's mirror image is; 0: matt
  bool two_sided = false;    ///< seen from behind as well, blank
};

/// A flat rectangle. Frame as that of a tag: origin in its middle, x right, y down, z into it, as seen by one
/// who looks at its front.
struct SceneSurface {
  SE3 map_T_surface{};
  double width_m = 0;
  double height_m = 0;
  Finish finish{};
  std::optional<TagId> tag{};  ///< printed in the middle
  double tag_size_m = 0;       ///< side of the square where black border meets white border
};

/// Everything a camera can see.
struct Scene {
  std::vector<SceneSurface> surfaces{};  ///< of two in one plane the later one lies on the other
  Eigen::Vector3d map_t_lamp = {0, 0, 2.4};
  double sky_reflectance = 0.5;  ///< brightness where there is nothing
};

/// What the world does not say about how it looks.
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

/// What a world looks like: tags on white paper, boards, walls, furniture, floor, and a room around it all
/// with a lamp under the middle of its ceiling. Order of map, so that the same world gives the same scene.
[[nodiscard]] Scene scene_of(const World& world, const SceneOptions& options = {});

/// An upright or lying rectangle of one finish that stands in the way, e.g. a person's leg or a poster.
[[nodiscard]] SceneSurface plain_surface(const SE3& map_T_surface, double width_m, double height_m,
                                         const Finish& finish);

/// A tag on white paper that leaves `margin_cells` around the tag's own total width.
[[nodiscard]] SceneSurface tag_surface(const TagId& tag, const SE3& map_T_tag, double size_m,
                                       double margin_cells = 1);

/// Fails on the first surface that cannot be: sizes not above 0, poses not finite, tags that do not exist or
/// that are larger than their paper.
[[nodiscard]] Status check(const Scene& scene);

}  // namespace waymark
