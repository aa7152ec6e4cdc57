#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "waymark/cameras/v4l2/device_list.hpp"
#include "waymark/tags/tag_finder.hpp"

/// Checks of a computer before a drive (`waymark doctor`).
namespace waymark {

/// Returns true to cancel the checks; called at least ten times per second.
using DoctorCancelled = std::function<bool()>;

enum class DoctorLevel : std::uint8_t { Ok, Warn, Fail };
/// "ok", "warn", "fail".
[[nodiscard]] const char* to_string(DoctorLevel level);

struct DoctorLine {
  std::string key{};  ///< stable name of the check: camera, calibration, map, disk, processor
  DoctorLevel level = DoctorLevel::Ok;
  std::string message{};
  std::string command{};  ///< command that fixes it, with fields instead of flags; empty: nothing to fix
};

/// One line per device; a warning if there is none.
[[nodiscard]] std::vector<DoctorLine> check_cameras(const std::vector<CameraDevice>& devices);

/// A warning, after a semicolon, about an image with too little contrast for a tag; empty if the contrast is
/// sufficient.
[[nodiscard]] std::string flat_picture_warning(const ImageView& image);

/// Opens the camera at an address for one second and reports the frame rate, messages of the driver, and too
/// little contrast.
[[nodiscard]] DoctorLine check_live_camera(const std::string& address, const DoctorCancelled& cancelled);

/// Whether the file contains a camera calibration, its unobservable parameters and its age. `now`: the file
/// clock.
[[nodiscard]] DoctorLine check_calibration(const std::filesystem::path& path,
                                           std::filesystem::file_time_type now);

/// Serial ports and gamepads of this computer, and whether this user has permission to open them.
[[nodiscard]] std::vector<DoctorLine> check_devices();

/// Free disk space at a folder. A recording with images needs about 100 MB per minute.
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder);
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder, std::uint64_t free_bytes);

/// Parameters of the loop trial.
struct LoopTrial {
  int width = 640;   ///< [px]
  int height = 480;  ///< [px]
  double rate_hz = 30;
  double seconds = 2;
};
struct LoopTrialResult {
  int pictures = 0;
  int dropped = 0;       ///< images that arrived during the detection in an earlier one
  double share = 0;      ///< processor time as share of one core
  double median_ms = 0;  ///< time from image to tags
};

/// Runs RobotLoop in real time on synthetic images with four tags.
[[nodiscard]] Result<LoopTrialResult> try_loop(const TagFinder& finder, const LoopTrial& trial,
                                               const DoctorCancelled& cancelled);
[[nodiscard]] DoctorLine check_processor(const LoopTrial& trial, const LoopTrialResult& result);

}  // namespace waymark
