#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/detect/detect_images.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/base/fields.hpp"

/// `waymark detect v4l2:…`: detects tags in the images of live cameras.
namespace waymark {

struct DetectCamerasJob {
  std::vector<std::string> addresses{};
  std::optional<PoseSetup> poses{};
  double duration_s = 0;              ///< 0 means until cancelled
  std::optional<PageOptions> page{};  ///< page that shows the camera; can only be set for a single camera
  std::function<void(const ImageReport&, const PoseList&, Duration age)> on_image{};
};

/// User options for detection, except those for the detector and the camera.
struct DetectRequest {
  DetectJob job{};
  bool view = false;  ///< whether to show a page with the live camera; requires a single camera
  PageOptions page{};
  bool json = false;
  bool covariance = false;  ///< whether JSON lines include covariances
  double duration_s = 0;    ///< see DetectCamerasJob::duration_s

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.view, JobField("view", "Show one live camera in the browser, with its controls"));
    PageOptions::fields_of_view(self.page, visit);
    DetectJob::fields(self.job, visit);
    visit(self.json, JobField("json", "Print one JSON object per image instead of tables"));
    visit(self.covariance,
          JobField("covariance", "With `json`: also print the 8 x 8 covariance of the corners of each tag"));
    visit(self.job.annotate_folder,
          JobField("annotate PATH",
                   "Folder for annotated PNG images, or a video to write (.mp4, .mkv, .webm, .avi). The x "
                   "axis is red, the y axis is green, and a dot marks the first corner"));
    visit(self.duration_s,
          JobField("duration_s FLOAT", "Time after which live cameras are closed [s]; 0: never", 0.0, 1e7));
  }
};

/// Whether the inputs are live cameras. Fails if fields are given that have no effect on these inputs.
[[nodiscard]] Result<bool> is_camera_input(const std::vector<std::string>& sources, const GivenFields& given);

/// Result for one camera. An error in one camera does not end the others.
struct DetectedCamera {
  std::string address{};
  Result<CameraWatchEnd> end{};
};

/// One line with the numbers of images, tags and lost images. It begins with the address if there are several
/// cameras. The camera must not have failed.
[[nodiscard]] std::string to_text(const DetectedCamera& camera, bool several);

/// Detects tags in the images of all cameras until each has ended. If there are several cameras, each has its
/// own thread, and calls to on_image and to the job control are serialised. Fails if a camera or the page
/// cannot be opened.
[[nodiscard]] Result<std::vector<DetectedCamera>> detect_cameras(const DetectCamerasJob& job,
                                                                 const TagFinder& finder,
                                                                 const JobControl& control);

}  // namespace waymark
