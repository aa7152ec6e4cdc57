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
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// The address of a live camera, and the name of the robot camera it provides.
struct CameraAddress {
  std::string name = "cam";
  std::string address{};
};

/// Parses "v4l2:/dev/video0" or, with the name of the robot camera, "left=v4l2:/dev/video2". The default name
/// is `name`. Fails with InvalidArgument if `word` is not an address.
[[nodiscard]] Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name);

/// Whether a word is the address of a live camera: "v4l2:/dev/video0,size=1280x720",
/// "gstreamer:libcamerasrc".
[[nodiscard]] bool is_camera_address(std::string_view word);

/// Whether the inputs are live cameras. Fails on a mixture of cameras and files, and on duplicate cameras.
[[nodiscard]] Result<bool> are_cameras(const std::vector<std::string>& sources);

/// Whether the only input is a live camera. Fails if there are several inputs and one of them is a camera.
[[nodiscard]] Result<bool> is_only_camera(const std::vector<std::string>& sources);

/// Opens the camera at an address; `name`: camera name in its samples. Errors: InvalidArgument for an invalid
/// address, and those of the camera driver.
[[nodiscard]] Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address,
                                                                   const std::string& name = "cam");

/// The list of `waymark cameras`.
struct CamerasJob {
  std::string device{};   ///< only this device; empty: all
  bool controls = false;  ///< list all controls

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

/// The cameras on this computer as a table; ends with a newline. With `controls`, all controls are listed
/// with their ranges.
[[nodiscard]] std::string to_text(const CamerasReport& report, bool controls);
[[nodiscard]] ReportFields fields(const CameraMode& mode);
[[nodiscard]] ReportFields fields(const CameraControl& control);
[[nodiscard]] ReportFields fields(const CameraDevice& device);
[[nodiscard]] ReportFields fields(const CamerasReport& report);

/// The clocks of this computer; tests pass their own.
struct SystemClocks {
  std::function<Duration()> steady;  ///< time since boot, monotonic
  std::function<Duration()> system;  ///< time since 1970; can be set
};
[[nodiscard]] SystemClocks system_clocks();

/// Converts stamps of the steady clock to times since 1970. The offset between the clocks is measured once,
/// so that time differences are unaffected if the system clock is changed; take_jump() reports such a change.
class SystemStamps {
 public:
  explicit SystemStamps(SystemClocks clocks = system_clocks());

  [[nodiscard]] SensorTime at(SensorTime steady) const { return steady + difference_; }
  /// The current time, consistent with at().
  [[nodiscard]] SensorTime now() const { return SensorTime(clocks_.steady() + difference_); }
  /// A message if the system clock was set since the last call.
  [[nodiscard]] std::optional<std::string> take_jump();

 private:
  [[nodiscard]] Duration measured() const;

  SystemClocks clocks_;
  Duration difference_{};  ///< system time minus steady time
  Duration latest_{};
};

/// An image of a live camera and the tags in it. Stamps are times since 1970.
struct CameraPicture {
  CameraFrame frame{};
  FoundTags found{};
  Duration age{};  ///< from the middle of the exposure to the end of detection
};

/// Options and callbacks of watch_camera().
struct CameraWatch {
  double duration_s = std::numeric_limits<double>::infinity();  ///< from the first image on
  /// Lens model for tag edges distorted by the lens; its image size must match. nullptr: none.
  const CameraModel* camera = nullptr;
  std::function<Status(CameraPicture&)> on_picture{};  ///< an error ends the watch
  std::function<void(const std::string&)> on_message = [](const std::string&) {};
  std::function<bool()> should_stop = [] { return false; };
};

struct CameraWatchEnd {
  std::size_t pictures = 0;
  std::size_t tags = 0;
  double seconds = 0;  ///< from the first image to the last
  CameraCounts counts{};
  bool stopped = false;  ///< by should_stop()
};

/// Repeatedly detects the tags in the newest image from a camera. Fails if the camera fails, if it delivers
/// no image for ten seconds, or if on_picture() fails.
[[nodiscard]] Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder,
                                                  const CameraWatch& watch);

}  // namespace waymark
