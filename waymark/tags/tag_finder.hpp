#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/image_lens.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/tag_tracker.hpp"

namespace waymark {

/// A detector with corner refinement, shared by live and offline use.
struct TagFinder {
  std::unique_ptr<Detector> detector;
  std::optional<RefinementOptions> refinement = {};  ///< if empty, the detected corners are kept
  /// Search strategy for image sequences. By default, every image is searched entirely.
  TrackingOptions tracking = {.whole_every = 1};
};

/// A detector with these settings and corner refinement. Fails if an option is out of range.
[[nodiscard]] Result<TagFinder> make_tag_finder(const DetectorOptions& detector = {},
                                                const RefinementOptions& refinement = {});
/// The same for a given detector.
[[nodiscard]] Result<TagFinder> make_tag_finder(std::unique_ptr<Detector> detector,
                                                const RefinementOptions& refinement = {});

/// The tags in one image, in the detector's order.
struct FoundTags {
  std::vector<TagDetection> detections;
  std::vector<RefinementOutcome> refinements = {};  ///< one per detection; empty if no corners were refined
  std::vector<MissedTag> missed = {};  ///< for sequences: expected tags that were not found, with reasons
  /// Number of tags that were dropped because a corner is outside the domain of the camera model.
  std::size_t beyond_lens = 0;
};

/// Finds the tags in an image and refines their corners, which then have a covariance. If a fit is not
/// usable, the detected corners are kept or moved to the steps between cells, with a covariance for that. The
/// distortion of the lens determines how the edges of tags are curved. Only tags with a corner outside its
/// domain are dropped, and they are counted. Thread-safe if the detector is.
[[nodiscard]] Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder, ImageLens lens);

/// The same for consecutive images from one camera. If tracking is enabled or tags are expected, tags are
/// read at their predicted positions (tag_tracker.hpp).
class TagSequence {
 public:
  /// `finder` must outlive the sequence.
  explicit TagSequence(const TagFinder& finder) : finder_(&finder) {}

  /// The tags in the next image; `lens` as for find_tags(). `expected` contains the positions of tags as
  /// predicted from a pose and a map.
  [[nodiscard]] Result<FoundTags> find(const ImageView& image, ImageLens lens,
                                       std::span<const ExpectedTag> expected = {});

 private:
  const TagFinder* finder_;
  std::optional<TagTracker> tracker_{};
};

}  // namespace waymark
