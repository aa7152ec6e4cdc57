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

/// A detector and the refinement of its corners: the common implementation for live and offline use.
struct TagFinder {
  std::unique_ptr<Detector> detector;
  std::optional<RefinementOptions> refinement = {};  ///< if empty, corners stay as detected
  /// Search strategy for image sequences; by default every image is searched entirely.
  TrackingOptions tracking = {.whole_every = 1};
};

/// The detector with these settings, with corner refinement. Fails on options out of range.
[[nodiscard]] Result<TagFinder> make_tag_finder(const DetectorOptions& detector = {},
                                                const RefinementOptions& refinement = {});
/// The same for a given detector.
[[nodiscard]] Result<TagFinder> make_tag_finder(std::unique_ptr<Detector> detector,
                                                const RefinementOptions& refinement = {});

/// The tags of one image, in the detector's order.
struct FoundTags {
  std::vector<TagDetection> detections;
  std::vector<RefinementOutcome> refinements = {};  ///< one per detection; empty if nothing was refined
  std::vector<MissedTag> missed = {};  ///< sequences only: expected tags that were not found, with reasons
};

/// Finds the tags in an image and refines their corners, which then have a covariance. If a fit is not
/// usable, the detected corners are kept with the covariance of unrefined_sigma_px; no detection is dropped.
/// `camera` is the camera model of this image, of the same size: edges are curved as its distortion curves
/// straight lines. The argument has no default, because corners of a distorting camera that are refined
/// without its model are biased; pass null if the model is unknown. Thread-safe if the detector is.
[[nodiscard]] Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder,
                                          const CameraModel* camera);

/// The same for consecutive images of one camera: if tracking is enabled or tags are expected, tags are read
/// at their predicted positions (tag_tracker.hpp).
class TagSequence {
 public:
  /// `finder` must outlive it.
  explicit TagSequence(const TagFinder& finder) : finder_(&finder) {}

  /// The tags of the next image; `camera` as for find_tags(). `expected`: predicted positions of tags from a
  /// pose and a map.
  [[nodiscard]] Result<FoundTags> find(const ImageView& image, const CameraModel* camera,
                                       std::span<const ExpectedTag> expected = {});

 private:
  const TagFinder* finder_;
  std::optional<TagTracker> tracker_{};
};

}  // namespace waymark
