#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/jobs/detect_pictures.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/live/camera_watch.hpp"
#include "waymark/live/live_page.hpp"

/// `waymark detect v4l2:…`: what is found in the pictures of live cameras.
namespace waymark {

struct DetectCamerasJob {
  std::vector<std::string> addresses{};
  std::optional<PoseSetup> poses{};
  double duration_s = 0;              ///< 0: until the control cancels it
  std::optional<PageOptions> page{};  ///< of one camera
  std::function<void(const PictureReport&, const PoseList&, Duration age)> on_picture{};
};

/// What became of one camera; an error ended it alone.
struct DetectedCamera {
  std::string address{};
  Result<CameraWatchEnd> end{};
};

/// Pictures, tags and what was lost, in a sentence; the address of one of `several` goes before. Of a camera
/// that did not fail.
[[nodiscard]] std::string to_text(const DetectedCamera& camera, bool several);

/// Finds the tags of all cameras until each has ended. Several have a thread each; what they call (on_picture
/// and the control) is called by one after the other. Fails where one of them, or the page, cannot be opened.
[[nodiscard]] Result<std::vector<DetectedCamera>> detect_cameras(const DetectCamerasJob& job,
                                                                 const TagFinder& finder,
                                                                 const JobControl& control);

}  // namespace waymark
