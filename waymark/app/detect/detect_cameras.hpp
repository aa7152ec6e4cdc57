#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/detect/detect_pictures.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/base/fields.hpp"

/// `waymark detect v4l2:…`: tags in the images of live cameras.
namespace waymark {

struct DetectCamerasJob {
  std::vector<std::string> addresses{};
  std::optional<PoseSetup> poses{};
  double duration_s = 0;              ///< 0: until the control cancels it
  std::optional<PageOptions> page{};  ///< of one camera
  std::function<void(const PictureReport&, const PoseList&, Duration age)> on_picture{};
};

/// User options of detection, without detector and camera.
struct DetectRequest {
  DetectJob job{};
  bool view = false;  ///< of one live camera
  PageOptions page{};
  bool json = false;
  bool covariance = false;  ///< in the lines of json
  double duration_s = 0;    ///< DetectCamerasJob::duration_s

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.view, JobField("view", "Show one live camera in the browser, with its controls"));
    PageOptions::fields_of_view(self.page, visit);
    DetectJob::fields(self.job, visit);
    visit(self.json, JobField("json", "Print one JSON object per image instead of tables"));
    visit(self.covariance,
          JobField("covariance", "With `json`: the 8 x 8 covariance of the corners of each tag as well"));
    visit(self.job.annotate_folder,
          JobField(
              "annotate PATH",
              "Write each image with its tags drawn in: to this folder, as PNG, or to a video (a name that "
              "ends in .mp4, .mkv, .webm or .avi); x axis red, y axis green, dot on the first corner"));
    visit(self.duration_s,
          JobField("duration_s FLOAT", "Time after which a live camera is closed; 0: never", 0.0, 1e7));
  }
};

/// Whether the inputs are live cameras; fails on flags that do not go with what they are.
[[nodiscard]] Result<bool> is_camera_input(const std::vector<std::string>& sources, const GivenFields& given);

/// Result for one camera; an error ends only this camera.
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
