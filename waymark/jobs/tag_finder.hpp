#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector.hpp"
#include "waymark/tags/refinement.hpp"

namespace waymark {

/// A detector and what is done with the corners it finds.
struct TagFinder {
  std::unique_ptr<Detector> detector;
  std::optional<RefinementOptions> refinement = {};  ///< nothing: corners stay as the detector found them
};

/// The tags of one picture.
struct FoundTags {
  std::vector<TagDetection> detections;
  std::vector<RefinementOutcome> refinements = {};  ///< one a detection; empty when nothing was refined
};

/// Finds the tags in a picture and refines their corners, which then have a covariance. With `camera`, along
/// the curves into which its distortion bends their edges.
[[nodiscard]] Result<FoundTags> find_tags(const ImageView& image, const TagFinder& finder,
                                          const CameraModel* camera = nullptr);

}  // namespace waymark
