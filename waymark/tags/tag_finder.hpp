#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/tag_tracker.hpp"

namespace waymark {

/// A detector and what is done with the corners it finds: the one way from a picture to its tags, live and
/// offline.
struct TagFinder {
  std::unique_ptr<Detector> detector;
  std::optional<RefinementOptions> refinement = {};  ///< nothing: corners stay as the detector found them
  /// How the pictures of a sequence are searched: each of them wholly, unless said otherwise.
  TrackingOptions tracking = {.whole_every = 1};
};

/// The detector with these settings, corners refined. Fails on options out of range.
[[nodiscard]] Result<TagFinder> make_tag_finder(const DetectorOptions& detector = {},
                                                const RefinementOptions& refinement = {});
/// The same of a detector of one's own.
[[nodiscard]] Result<TagFinder> make_tag_finder(std::unique_ptr<Detector> detector,
                                                const RefinementOptions& refinement = {});

/// The tags of one picture, in the detector's order.
struct FoundTags {
  std::vector<TagDetection> detections;
  std::vector<RefinementOutcome> refinements = {};  ///< one a detection; empty when nothing was refined
  std::vector<MissedTag> missed = {};  ///< of a sequence: expected tags that were not found, and why
};

/// Finds the tags in a picture and refines their corners, which then have a covariance; where the fit is not
/// usable they stay as they were, with the covariance of unrefined_sigma_px. None is dropped: what is a tag
/// is the detector's business. `camera` is the lens of this image, of its size: edges are bent as its
/// distortion bends straight lines. It has no default, because corners of a known lens that are refined
/// without it are biased; null where the lens is unknown. Safe to call from several threads where the
/// detector is.
[[nodiscard]] Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder,
                                          const CameraModel* camera);

/// The same for the pictures of one camera, one after the other: where the finder says so, or tags are
/// expected, they are read where they should be (tag_tracker.hpp).
class TagSequence {
 public:
  /// `finder` outlives it.
  explicit TagSequence(const TagFinder& finder) : finder_(&finder) {}

  /// The tags of the next picture; `camera` as of find_tags(). `expected`: where tags should be, from a pose
  /// and a map.
  [[nodiscard]] Result<FoundTags> find(const ImageView& image, const CameraModel* camera,
                                       std::span<const ExpectedTag> expected = {});

 private:
  const TagFinder* finder_;
  std::optional<TagTracker> tracker_{};
};

}  // namespace waymark
