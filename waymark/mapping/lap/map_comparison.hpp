#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/samples/tag_map.hpp"

namespace waymark {

struct MapComparisonOptions {
  double same_m = 0.05;
  double same_rad = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.same_m,
          Field{"same_m", "Largest difference in position at which a tag counts as unmoved.", 1e-6, 10});
    visit(self.same_rad,
          Field{"same_rad", "Largest difference in orientation at which a tag counts as unmoved.", 1e-6, 3});
  }
};

enum class TagChange : std::uint8_t { Same, Moved, Swapped, Resized, New, Missing };

struct ComparedTag {
  TagId tag{};
  TagChange change = TagChange::Same;
  double distance_m = 0;  ///< distance between the two poses after alignment; 0 for new and missing tags
  double turned_rad = 0;
  std::optional<TagId> with{};  ///< if swapped, the tag whose place it took
};

/// Comparison of two maps of the same place.
struct MapComparison {
  SE3 map_T_prior{};  ///< the alignment that most tags agree on; the maps may have different frames
  int agreeing = 0;   ///< number of tags that agree on the alignment
  double rms_m = 0;   ///< RMS distance of these tags after alignment
  std::vector<ComparedTag> tags{};  ///< all tags in either map, in order
};

/// Whether so few of the tags that two maps have in common agree that they do so by chance: fewer than a
/// quarter of six or more.
[[nodiscard]] bool agree_by_chance(std::ptrdiff_t agreeing, std::ptrdiff_t common);

/// Aligns the prior map using the alignment that most common tags agree on, then determines how each tag has
/// changed. Each tag proposes an alignment, which is refined by least squares of positions and rotations of
/// the tags near it and scored with all tags. Fails if fewer than two tags agree on any alignment, or if so
/// few of many common tags agree that the maps are of different places. O(tags^2).
[[nodiscard]] Result<MapComparison> compare_maps(const TagMap& map, const TagMap& prior,
                                                 const MapComparisonOptions& options = {});

/// A tag in an older map, given as a point in the plane and identified only by its number.
struct PriorPoint {
  int number = 0;
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

/// Does the same for points. Heights and directions are ignored, and a number can refer to a tag of any
/// family. Fails if fewer than three agree on any alignment. O(points^3).
[[nodiscard]] Result<MapComparison> compare_points(const TagMap& map, const std::vector<PriorPoint>& prior,
                                                   const MapComparisonOptions& options = {});

/// One sentence for each tag that has changed.
[[nodiscard]] std::vector<std::string> describe(const MapComparison& comparison);

namespace internal {
/// Determines how each tag in either map has changed, given the alignment of the maps.
void compare_tags(const TagMap& map, const TagMap& prior, const MapComparisonOptions& options,
                  MapComparison& comparison);
}  // namespace internal

}  // namespace waymark
