#pragma once

#include <array>
#include <optional>
#include <span>

#include <Eigen/Core>

namespace waymark::search {

/// The levels of a tag's cells, row by row, with `margin` cells around its border.
struct CellLevels {
  std::span<const float> levels;
  int width = 0;   ///< [cell] of the border square
  int margin = 1;  ///< [cell]

  [[nodiscard]] float at(int x, int y) const {
    const int index = (y + margin) * (width + 2 * margin) + x + margin;
    return levels[static_cast<std::size_t>(index)];
  }
};

/// Light that changes at a straight line across a tag, as at the edge of a shadow.
struct ShadowEdge {
  Eigen::Vector2f normal{0, 0};   ///< towards the light
  float offset = 0;               ///< [cell] normal . place = offset on the line
  std::array<float, 2> border{};  ///< level of black in the shadow, and in the light
  std::array<float, 2> around{};  ///< level of white

  /// The share of a cell that is in the light.
  [[nodiscard]] float lit(int x, int y) const;
  /// The level that a cell would have in the light.
  [[nodiscard]] float in_the_light(float level, int x, int y) const;
};

/// The edge between the two arcs into which the cells around the border fall best, if they explain most of
/// how these differ, and black differs from white on both sides. O(width^2).
[[nodiscard]] std::optional<ShadowEdge> find_shadow_edge(const CellLevels& cells, float min_contrast);

}  // namespace waymark::search
