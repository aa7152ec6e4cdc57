#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/evaluation/truth.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// When a detection counts as lying on a true tag: its corner distance is at most the larger of the two
/// limits.
struct MatchOptions {
  double match_distance_px = 2.0;
  double match_distance_sides = 0.1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.match_distance_px,
          Field{"match_distance_px",
                "Largest distance (RMS over the corners) at which a detection is matched to a true tag.", 0,
                1e6});
    visit(self.match_distance_sides, Field{"match_distance_sides",
                                           "Largest distance at which a detection is matched to a true tag, "
                                           "in sides of the tag; the larger of the two limits applies.",
                                           0, 1});
  }
};

/// A detection and the true tag it is, as indices into the two lists.
struct MatchedPair {
  std::size_t detection = 0;
  std::size_t truth = 0;

  friend bool operator==(const MatchedPair&, const MatchedPair&) = default;
};

/// What became of every detection and every true tag of one image. Each index is in exactly one list of its
/// side.
struct Matching {
  std::vector<MatchedPair> correct;  ///< right place, family, id and corner order; nearest first
  std::vector<MatchedPair>
      wrong_id;  ///< lies on a true tag (in any rotation) that nothing else found, but is not it
  std::vector<std::size_t> false_positives;  ///< detections on no true tag, or on one that was found already
  std::vector<std::size_t> missed;           ///< true tags with no correct detection
};

/// Root mean square of the four corner distances [px], after turning `detected` by `quarter_turns`.
[[nodiscard]] double corner_distance_px(const std::array<Eigen::Vector2d, 4>& detected,
                                        const std::array<Eigen::Vector2d, 4>& truth,
                                        std::size_t quarter_turns = 0);

/// Matches the detections of one image to its true tags. The rule: of all pairs with the same family and id
/// whose corners, in printed order, are within the limit, the nearest pair is taken, then the nearest of what
/// is left, and so on; ties go to the earlier detection, then the earlier truth. So a tag whose id is seen
/// once is matched by its id, and tags that share an id by their place. What is left is matched the same way
/// with ids ignored and corners in any rotation: those are wrong ids. O(detections · truth · log).
[[nodiscard]] Matching match_detections(std::span<const TagDetection> detections,
                                        std::span<const TrueTag> truth, const MatchOptions& options = {});

}  // namespace waymark
