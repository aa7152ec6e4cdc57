#pragma once

#include <cstddef>

#include "waymark/config/yaml_cursor.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark::internal {

inline constexpr YamlLimits kWorldLimits{.bytes = std::size_t{1} << 22U, .nodes = 200'000, .depth = 16};

/// A point [x, y] of a list.
[[nodiscard]] Result<Eigen::Vector2d> read_point(const YamlCursor& point);

/// What stands in a world beside single tags, each key only where it is there: panels (whose tags join those
/// of the world), walls, occluders, keep_outs, floor, tag_margin_cells, corners_through_paper. `size_m` of
/// tags that name none.
[[nodiscard]] Status read_scenery(const YamlCursor& root, FamilyId family, double size_m, World& world);

/// Puts a tag into a world; fails on a number that is not in the family or given twice.
[[nodiscard]] Result<TagId> place_tag(const YamlCursor& entry, FamilyId family, const SE3& map_T_tag,
                                      double size_m, World& world);

}  // namespace waymark::internal
