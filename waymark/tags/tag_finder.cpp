#include "waymark/tags/tag_finder.hpp"

#include <algorithm>
#include <utility>

#include "waymark/tags/make_detector.hpp"

namespace waymark {
namespace {

/// Drops tags that the camera model does not cover. Their bearings are undefined.
void drop_beyond_lens(const CameraModel* camera, FoundTags& found) {
  if (camera == nullptr) return;
  found.beyond_lens = std::erase_if(found.detections,
                                    [&](const TagDetection& tag) { return !camera->covers(tag.corners_px); });
}

void refine_all(const ImageView& image, const TagFinder& finder, const CameraModel* camera,
                FoundTags& found) {
  drop_beyond_lens(camera, found);
  if (!finder.refinement) return;
  for (TagDetection& detection : found.detections) {
    const RefinedCorners refined = refine_corners(image, detection, *finder.refinement, camera);
    detection.corners_px = refined.corners_px;
    detection.corner_covariance_px2 = refined.covariance_px2;
    found.refinements.push_back(refined.outcome);
  }
}

}  // namespace

Result<TagFinder> make_tag_finder(std::unique_ptr<Detector> detector, const RefinementOptions& refinement) {
  if (detector == nullptr) {
    return fail(ErrorCode::InvalidArgument, "the detector is missing", {}, "Create a detector first.");
  }
  if (const Status status = check_ranges(refinement); !status) return tl::unexpected<Error>(status.error());
  return TagFinder{std::move(detector), refinement};
}

Result<TagFinder> make_tag_finder(const DetectorOptions& detector, const RefinementOptions& refinement) {
  auto made = make_detector(detector);
  if (!made) return tl::unexpected(made.error());
  Result<TagFinder> finder = make_tag_finder(std::move(*made), refinement);
  if (finder) finder->tracking.detector = detector;
  return finder;
}

Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder, const CameraModel* camera) {
  auto detections = finder.detector->detect(image);
  if (!detections) return tl::unexpected(detections.error());
  FoundTags found{std::move(*detections)};
  refine_all(image, finder, camera, found);
  return found;
}

Result<FoundTags> TagSequence::find(const ImageView& image, const CameraModel* camera,
                                    std::span<const ExpectedTag> expected) {
  // Without tracking or expected tags, live and offline results are identical to the last bit.
  if (finder_->tracking.whole_every == 1 && expected.empty() && !tracker_)
    return find_tags(image, *finder_, camera);
  if (!tracker_) {
    auto made = TagTracker::make(*finder_->detector, finder_->tracking);
    if (!made) return tl::unexpected(made.error());
    tracker_.emplace(std::move(*made));
  }
  auto tracked = tracker_->next(image, expected);
  if (!tracked) return tl::unexpected(tracked.error());
  FoundTags found{.detections = std::move(tracked->detections), .missed = std::move(tracked->missed)};
  // Excludes tags that are predicted here only from the preceding images.
  std::erase_if(found.missed, [&](const MissedTag& missed) {
    return std::ranges::none_of(expected,
                                [&](const ExpectedTag& tag) { return tag.tag == missed.expected.tag; });
  });
  refine_all(image, *finder_, camera, found);
  return found;
}

}  // namespace waymark
