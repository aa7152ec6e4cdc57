#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/base/fields.hpp"

/// `waymark detect`: the tags in images, with optional poses and annotated images.
namespace waymark {

struct DetectJob {
  std::vector<std::string> sources{};  ///< files, folders, patterns, recordings, videos
  bool recursive = false;              ///< also pictures of the folders in a folder
  std::optional<PoseSetup> poses{};
  /// For pictures with their tags drawn in: a folder, or a video that is written (by its name); empty: none.
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

/// Called with each picture, in order; `poses` has one entry a detection, or is empty. Returns whether to go
/// on.
using EachDetected = std::function<bool(const PictureReport& report, const PoseList& poses)>;

/// Pictures that fail are notes, are counted and have an error in their report; the others are processed.
/// Fails as a whole when the annotated pictures would be written over their originals.
[[nodiscard]] Result<DetectSummary> detect_pictures(const DetectJob& job, const TagFinder& finder,
                                                    const JobControl& control, const EachDetected& each);

/// The poses of a picture's tags. A calibration of another picture size gives none, and an error in the
/// report.
[[nodiscard]] PoseList poses_for(PictureReport& report, const PoseSetup& setup);

/// The detections in one image as a text table; ends with an end of line. Requires report.detected.
[[nodiscard]] std::string to_text(const PictureReport& report);

/// The poses of one picture's tags: position and distance with standard deviations, both solutions; ends with
/// an end of line. Empty when there are none.
[[nodiscard]] std::string to_text(std::span<const TagDetection> detections, const PoseList& poses);

}  // namespace waymark
