#pragma once

#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {

struct TagLayoutOptions {
  int most_tags = 60;
  double tag_size_m = 0.16;
  double height_m = 0.3;
  double clearance_m = 0.45;
  double max_range_m = 3.5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.most_tags, Field{"most_tags", "Maximum number of tags.", 1, 500});
    visit(self.tag_size_m, Field{"tag_size_m", "Side of the black square.", 0.01, 10});
    visit(self.height_m, Field{"height_m", "Height of the tags' centres above the floor.", 0, 10});
    visit(self.clearance_m, Field{"clearance_m", "Minimum distance in space from the hull to a tag.", 0, 10});
    visit(self.max_range_m,
          Field{"max_range_m", "Maximum distance at which a tag counts as visible.", 0.1, 100});
  }
};

/// Places a small number of upright tags along a line, so that a robot sees two of them from every point. It
/// uses a greedy cover of the points on the line, applied twice (Chvatal, "A greedy heuristic for the
/// set-covering problem", Mathematics of Operations Research 4, 1979). Candidates are on both sides of the
/// line and face points ahead. Candidates are excluded if they are in a keep-out area of `world`, behind its
/// walls, nearer than the clearance, or would hide another tag. The existing tags of `world` are removed; its
/// anchor becomes the tag that is visible most often from the beginning. Fails if the world has no line or no
/// tag can be placed. O(places * points + tags * places * points).
[[nodiscard]] Result<World> lay_tags(World world, const RobotModel& robot, const CameraModel& camera,
                                     const TagLayoutOptions& options = {});

/// Whether a point is inside an area (crossing number).
[[nodiscard]] bool inside(const KeepOut& area, const Eigen::Vector2d& point_m);

}  // namespace waymark
