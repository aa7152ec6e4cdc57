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

/// Whether somebody wants the checks to end; asked ten times a second or more often.
using DoctorCancelled = std::function<bool()>;

enum class DoctorLevel : std::uint8_t { Ok, Warn, Fail };
/// "ok", "warn", "fail".
[[nodiscard]] const char* to_string(DoctorLevel level);

struct DoctorLine {
  std::string key{};  ///< a stable word: camera, calibration, map, disk, processor
  DoctorLevel level = DoctorLevel::Ok;
  std::string words{};
  std::string command{};  ///< that mends it; empty where all is well
};

/// One line a device; a warning where there is none.
[[nodiscard]] std::vector<DoctorLine> check_cameras(const std::vector<CameraDevice>& devices);

/// What is wrong with a picture in which no two grey levels differ as a tag's do, behind a semicolon; empty
/// where they do.
[[nodiscard]] std::string words_of_flat_picture(const ImageView& image);

/// Opens the camera of an address and takes pictures for a second: whether they come, at which rate, what the
/// driver says of them, and whether they have contrast.
[[nodiscard]] DoctorLine check_live_camera(const std::string& address, const DoctorCancelled& cancelled);

/// Whether the file calibrates a camera, what it could not determine, and how old it is; `now`: the clock of
/// files.
[[nodiscard]] DoctorLine check_calibration(const std::filesystem::path& path,
                                           std::filesystem::file_time_type now);

/// Serial ports and gamepads of this computer, and whether this user may open them.
[[nodiscard]] std::vector<DoctorLine> check_devices();

/// The room on the disk of a folder: a recording with pictures takes some 100 MB a minute.
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder);
[[nodiscard]] DoctorLine check_disk(const std::filesystem::path& folder, std::uint64_t free_bytes);

/// What the trial of the loop is made of.
struct LoopTrial {
  int width = 640;   ///< [px]
  int height = 480;  ///< [px]
  double rate_hz = 30;
  double seconds = 2;
};
struct LoopTrialResult {
  int pictures = 0;
  int dropped = 0;       ///< came while the one before was searched
  double share = 0;      ///< of one core
  double median_ms = 0;  ///< from picture to tags
};

/// Runs the loop of a robot (RobotLoop) on drawn pictures with four tags, in real time.
[[nodiscard]] Result<LoopTrialResult> try_loop(const TagFinder& finder, const LoopTrial& trial,
                                               const DoctorCancelled& cancelled);
[[nodiscard]] DoctorLine check_processor(const LoopTrial& trial, const LoopTrialResult& result);

}  // namespace waymark
