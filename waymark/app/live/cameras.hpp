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

/// A live camera and which of a robot's cameras it is.
struct CameraAddress {
  std::string name = "cam";
  std::string address{};
};

/// "v4l2:/dev/video0", or with the name of the robot's camera before it: "left=v4l2:/dev/video2".
/// InvalidArgument: no address. Without a name it is `name`.
[[nodiscard]] Result<CameraAddress> parse_camera_address(const std::string& word, const std::string& name);

/// Whether a word names a live camera: "v4l2:/dev/video0,size=1280x720", "gstreamer:libcamerasrc".
[[nodiscard]] bool is_camera_address(std::string_view word);

/// Whether the inputs are live cameras; fails where files are among them, and where one is named twice.
[[nodiscard]] Result<bool> are_cameras(const std::vector<std::string>& sources);

/// Whether the inputs are one live camera; fails where a camera is among others.
[[nodiscard]] Result<bool> is_only_camera(const std::vector<std::string>& sources);

/// Opens the camera of an address; `name` is that of its samples. Errors: InvalidArgument (the address), as
/// the camera's driver.
[[nodiscard]] Result<std::unique_ptr<LiveCamera>> open_live_camera(const std::string& address,
                                                                   const std::string& name = "cam");

/// What `waymark cameras` lists.
struct CamerasJob {
  std::string device{};   ///< this one alone; empty: all
  bool controls = false;  ///< all of them

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

/// The cameras of this computer as a table for people; ends with an end of line. With `controls` all of them,
/// with their ranges.
[[nodiscard]] std::string to_text(const CamerasReport& report, bool controls);
[[nodiscard]] ReportFields fields(const CameraMode& mode);
[[nodiscard]] ReportFields fields(const CameraControl& control);
[[nodiscard]] ReportFields fields(const CameraDevice& device);
[[nodiscard]] ReportFields fields(const CamerasReport& report);

/// The clocks of this computer; tests give their own.
struct SystemClocks {
  std::function<Duration()> steady;  ///< never goes back, counts from the start of the computer
  std::function<Duration()> system;  ///< since 1970, can be set
};
[[nodiscard]] SystemClocks system_clocks();

/// Stamps of the steady clock as times since 1970. The difference of the clocks is taken once, so that stamps
/// keep their distances when the system's clock is set; that it was set is said.
class SystemStamps {
 public:
  explicit SystemStamps(SystemClocks clocks = system_clocks());

  [[nodiscard]] SensorTime at(SensorTime steady) const { return steady + difference_; }
  /// Now, as at() has it.
  [[nodiscard]] SensorTime now() const { return SensorTime(clocks_.steady() + difference_); }
  /// Words where the system's clock was set since the last call.
  [[nodiscard]] std::optional<std::string> take_jump();

 private:
  [[nodiscard]] Duration measured() const;

  SystemClocks clocks_;
  Duration difference_{};  ///< system less steady
  Duration latest_{};
};

/// A picture of a live camera and the tags in it. Stamps are times since 1970.
struct CameraPicture {
  CameraFrame frame{};
  FoundTags found{};
  Duration age{};  ///< from the middle of the exposure until the tags were found
};

/// What becomes of the pictures of a live camera.
struct CameraWatch {
  double duration_s = std::numeric_limits<double>::infinity();  ///< from the first picture on
  const CameraModel* camera =
      nullptr;  ///< its lens bends the edges of tags; the pictures' size must be its own
  std::function<Status(CameraPicture&)> on_picture{};  ///< an error ends the watch
  std::function<void(const std::string&)> on_words = [](const std::string&) {};
  std::function<bool()> should_stop = [] { return false; };
};

struct CameraWatchEnd {
  std::size_t pictures = 0;
  std::size_t tags = 0;
  double seconds = 0;  ///< from the first picture to the last
  CameraCounts counts{};
  bool stopped = false;  ///< should_stop() said so
};

/// Finds the tags in a camera's newest picture, again and again. Fails when the camera does, when it has
/// delivered no picture for ten seconds, and when on_picture() does.
[[nodiscard]] Result<CameraWatchEnd> watch_camera(LiveCamera& camera, const TagFinder& finder,
                                                  const CameraWatch& watch);

}  // namespace waymark
