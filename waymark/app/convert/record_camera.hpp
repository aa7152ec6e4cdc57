#pragma once

#include <string>

#include "waymark/app/common/camera_tags.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/app/live/cameras.hpp"

namespace waymark {

struct RecordCameraReport {
  std::string input{};  ///< address of the camera
  std::string output{};
  std::string description{};  ///< description of the camera
  CameraWatchEnd end{};
};

/// `waymark convert v4l2:… lap.mcap`: writes the tags detected by a live camera to the job's output, and its
/// images if requested. Ends after `duration_s` (0 means no limit), or if cancelled. Errors are those of
/// convert_video().
[[nodiscard]] Result<RecordCameraReport> record_camera(const ConvertVideoJob& job, double duration_s,
                                                       const TagFinder& finder, const JobControl& control);
[[nodiscard]] std::string to_text(const RecordCameraReport& report);
[[nodiscard]] ReportFields fields(const RecordCameraReport& report);

}  // namespace waymark
