#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "waymark/cameras/v4l2/device_list.hpp"
#include "waymark/tags/tag_finder.hpp"

/// Checks a computer before a drive (`waymark doctor`).
namespace waymark {

/// Returns true to cancel the checks; called at least ten times per second.
using DoctorCancelled = std::function<bool()>;

enum class DoctorLevel : std::uint8_t { Ok, Warn, Fail };
/// Returns "ok", "warn" or "fail".
[[nodiscard]] const char* to_string(DoctorLevel level);

struct DoctorLine {
  std::string key{};  ///< stable name of the check: camera, calibration, map, disk, processor
  DoctorLevel level = DoctorLevel::Ok;
  std::string message{};
  std::string command{};  ///< command that fixes the problem, with fields instead of flags; empty if there is
                          ///< nothing to fix
};

/// Returns one line per camera, or a warning if there is none.
[[nodiscard]] std::vector<DoctorLine> check_cameras(const std::vector<CameraDevice>& devices);

/// A warning, starting with a semicolon, that the contrast of an image is too low for tags; empty if the
/// contrast is sufficient.
[[nodiscard]] std::string flat_image_warning(const ImageView& image);

/// Opens the camera at an address for one second. Reports the frame rate, messages from the driver, and
/// insufficient contrast.
[[nodiscard]] DoctorLine check_live_camera(const std::string& address, const DoctorCancelled& cancelled);

/// Reports whether the file contains a camera calibration, which of its parameters are unobservable, and how
/// old it is. `now` is a time on the clock used for files.
[[nodiscard]] DoctorLine check_calibration(const std::filesystem::path& path,
                                           std::filesystem::file_time_type now);

/// Lists the serial ports and gamepads of this computer, and whether the user has permission to open them.
[[nodiscard]] std::vector<DoctorLine> check_devices();

/// Reports the free disk space in a folder. A recording with images needs about 100 MB per minute.
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder);
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder, std::uint64_t free_bytes);

/// Parameters for a trial run of the loop.
struct LoopTrial {
  int width = 640;   ///< width of the images [px]
  int height = 480;  ///< height of the images [px]
  double rate_hz = 30;
  double seconds = 2;
};
struct LoopTrialResult {
  int images = 0;
  int dropped = 0;       ///< number of images that arrived while an earlier one was being searched
  double share = 0;      ///< processor time as a fraction of one core
  double median_ms = 0;  ///< median time from the arrival of an image to its tags
};

/// Runs RobotLoop in real time with synthetic images that show four tags.
[[nodiscard]] Result<LoopTrialResult> try_loop(const TagFinder& finder, const LoopTrial& trial,
                                               const DoctorCancelled& cancelled);
[[nodiscard]] DoctorLine check_processor(const LoopTrial& trial, const LoopTrialResult& result);

}  // namespace waymark
