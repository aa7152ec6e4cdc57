#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/base/fields.hpp"

/// `waymark detect`: detects tags in images, and optionally computes poses and writes annotated images.
namespace waymark {

struct DetectJob {
  std::vector<std::string> sources{};  ///< files, folders, patterns, recordings or videos
  bool recursive = false;              ///< whether to search folders recursively
  std::optional<PoseSetup> poses{};
  /// Where annotated images are written: a folder, or a video if the name has a video extension. If empty,
  /// none are written.
  std::string annotate_folder{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.sources,
          JobField("sources SOURCE",
                   "Images (JPEG, PNG, PNM), folders of images, videos, recordings with images, quoted "
                   "patterns such as 'lap/*.png', or live cameras such as v4l2:/dev/video0")
              .input()
              .required());
    visit(self.recursive, JobField("recursive", "Search folders for images recursively"));
  }
};

/// Called for each image, in order. `poses` either has one entry per detection or is empty. Returns whether
/// to continue. Until a tag is found, each call is delayed until the next image.
using EachDetected = std::function<bool(const ImageReport& report, const PoseList& poses)>;

/// Detects tags in the images. If an image fails, it is counted and noted, and its report contains the
/// error, but the other images are still processed. The whole job fails if annotated images would
/// overwrite inputs.
[[nodiscard]] Result<DetectSummary> detect_images(const DetectJob& job, const TagFinder& finder,
                                                  const JobControl& control, const EachDetected& each);

/// Poses of the tags in an image. Empty if the calibration is for a different image size; the report then
/// contains an error.
[[nodiscard]] PoseList poses_for(ImageReport& report, const PoseSetup& setup);

/// The detections in one image as a text table that ends with a newline. report.detected must be set.
[[nodiscard]] std::string to_text(const ImageReport& report);

/// Poses of the tags in one image as a text table that ends with a newline. It contains both solutions with
/// standard deviations. Empty if there are no poses.
[[nodiscard]] std::string to_text(std::span<const TagDetection> detections, const PoseList& poses);

}  // namespace waymark
