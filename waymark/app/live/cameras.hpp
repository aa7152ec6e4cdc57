#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"
#include "waymark/samples/live_camera.hpp"
#include "waymark/tags/no_tags.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// The address of a live camera, and the name of the robot camera it provides.
struct CameraAddress {
  std::string name = "cam";
  std::string address{};
};

/// Parses "v4l2:/dev/video0" or, with the name of the robot camera, "left=v4l2:/dev/video2". Without a name,
/// `name` is used. Fails with InvalidArgument if `word` is not an address.
[[nodiscard]] Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name);

/// Whether a word is the address of a live camera, such as "v4l2:/dev/video0,size=1280x720" or
/// "gstreamer:libcamerasrc".
[[nodiscard]] bool is_camera_address(std::string_view word);

/// Whether the inputs are live cameras. Fails if cameras and files are mixed, or if a camera is listed twice.
[[nodiscard]] Result<bool> are_cameras(const std::vector<std::string>& sources);

/// Whether the only input is a live camera. Fails if there are several inputs and one of them is a camera.
[[nodiscard]] Result<bool> is_only_camera(const std::vector<std::string>& sources);

/// Opens the camera at an address; `name` is the name of the camera in its samples. Fails with
/// InvalidArgument if the address is invalid, and with the errors of the camera driver.
[[nodiscard]] Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address,
                                                                   const std::string& name = "cam");

/// Lists cameras for `waymark cameras`.
struct CamerasJob {
  std::string device{};   ///< lists only this device; all devices if empty
  bool controls = false;  ///< whether to list all controls

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.device, JobField("device DEVICE", "Only this device, for example /dev/video0").input());
    visit(self.controls,
          JobField("controls", "List all controls, not only exposure, gain, focus and white balance"));
  }
};
struct CamerasReport {
  std::vector<CameraDevice> cameras{};
};
[[nodiscard]] Result<CamerasReport> find_cameras(const CamerasJob& job);

/// Formats the cameras connected to this computer as a table that ends with a newline. With `controls`, all
/// controls are listed with their ranges.
[[nodiscard]] std::string to_text(const CamerasReport& report, bool controls);
[[nodiscard]] ReportFields fields(const CameraMode& mode);
[[nodiscard]] ReportFields fields(const CameraControl& control);
[[nodiscard]] ReportFields fields(const CameraDevice& device);
[[nodiscard]] ReportFields fields(const CamerasReport& report);

/// The clocks of this computer, which tests can replace.
struct SystemClocks {
  std::function<Duration()> steady;  ///< time since boot, monotonic
  std::function<Duration()> system;  ///< time since 1970; jumps when the clock is set
};
[[nodiscard]] SystemClocks system_clocks();

/// Converts timestamps from the steady clock to times since 1970. The offset between the clocks is measured
/// once, so that time differences are not affected when the system clock is set; take_jump() reports such a
/// change.
class SystemStamps {
 public:
  explicit SystemStamps(SystemClocks clocks = system_clocks());

  [[nodiscard]] SensorTime at(SensorTime steady) const { return steady + difference_; }
  /// The current time on the same scale as at().
  [[nodiscard]] SensorTime now() const { return SensorTime(clocks_.steady() + difference_); }
  /// Returns a message if the system clock has been set since the last call.
  [[nodiscard]] std::optional<std::string> take_jump();

 private:
  [[nodiscard]] Duration measured() const;

  SystemClocks clocks_;
  Duration difference_{};  ///< system time minus steady time
  Duration latest_{};
};

/// An image from a live camera and the tags detected in it. Timestamps are times since 1970.
struct CameraImage {
  CameraFrame frame{};
  FoundTags found{};
  Duration age{};  ///< time from the middle of the exposure to the end of detection
};

/// Options and callbacks of watch_camera().
struct CameraWatch {
  ImageLens lens;                                               ///< for images of this camera's size
  double duration_s = std::numeric_limits<double>::infinity();  ///< counted from the first image
  std::function<Status(CameraImage&)> on_image{};  ///< called with each image; an error ends the watch
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
  std::function<bool()> should_stop = [] { return false; };
};

struct CameraWatchEnd {
  std::size_t images = 0;
  std::size_t tags = 0;
  std::size_t unreliable = 0;  ///< number of these tags with unreliable corners
  double seconds = 0;          ///< time from the first to the last image
  CameraCounts counts{};
  bool stopped = false;      ///< whether should_stop() ended the watch
  NoTagDiagnosis no_tags{};  ///< used to determine why no image contains a tag
};

/// A note that states why no image contains a tag; empty if a tag was found or the cause is unknown.
[[nodiscard]] std::string no_tags_note(const CameraWatchEnd& end, const TagFinder& finder);

/// Detects the tags in the newest image from a camera, over and over. Fails if the camera fails, if it
/// delivers no image for ten seconds, or if on_image() fails.
[[nodiscard]] Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder,
                                                  const CameraWatch& watch);

}  // namespace waymark
