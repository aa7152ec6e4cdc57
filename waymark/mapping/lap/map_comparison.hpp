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
  double distance_m = 0;  ///< between the two places, after alignment; 0 for new and missing ones
  double turned_rad = 0;
  std::optional<TagId> with{};  ///< Swapped: the tag whose place it has taken
};

/// Two maps of one place, held against each other.
struct MapComparison {
  SE3 map_T_prior{};                ///< what most tags agree on: the two maps may stand in different frames
  int agreeing = 0;                 ///< tags that agree on it
  double rms_m = 0;                 ///< how far these are apart after alignment
  std::vector<ComparedTag> tags{};  ///< of either map, in order
};

/// Aligns the prior map with what most common tags agree on (one tag proposes, those near its proposal mend
/// it by least squares of places and rotations, all judge), then says of each tag what became of it. Fails
/// when fewer than two tags agree on any alignment. O(tags^2).
[[nodiscard]] Result<MapComparison> compare_maps(const TagMap& map, const TagMap& prior,
                                                 const MapComparisonOptions& options = {});

/// A place of an older map that is a point in the plane, known by its number only.
struct PriorPoint {
  int number = 0;
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
};

/// The same against points: heights and directions do not count, and the numbers name tags of any family.
/// Fails when fewer than three agree on any alignment. O(points^3).
[[nodiscard]] Result<MapComparison> compare_points(const TagMap& map, const std::vector<PriorPoint>& prior,
                                                   const MapComparisonOptions& options = {});

/// One sentence for each tag that is not where it was.
[[nodiscard]] std::vector<std::string> describe(const MapComparison& comparison);

namespace internal {
/// What became of each tag of either map, once it is known how they lie to each other.
void compare_tags(const TagMap& map, const TagMap& prior, const MapComparisonOptions& options,
                  MapComparison& comparison);
}  // namespace internal

}  // namespace waymark
