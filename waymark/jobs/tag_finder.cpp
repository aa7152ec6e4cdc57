#include "waymark/jobs/tag_finder.hpp"

#include <utility>

namespace waymark {

Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder, const CameraModel* camera) {
  auto detections = finder.detector->detect(image);
  if (!detections) return tl::unexpected(detections.error());
  FoundTags found{std::move(*detections)};
  if (!finder.refinement) return found;
  for (TagDetection& detection : found.detections) {
    const RefinedCorners refined = refine_corners(image, detection, *finder.refinement, camera);
    detection.corners_px = refined.corners_px;
    detection.corner_covariance_px2 = refined.covariance_px2;
    found.refinements.push_back(refined.outcome);
  }
  return found;
}

}  // namespace waymark
