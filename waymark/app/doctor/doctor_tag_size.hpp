#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "waymark/app/doctor/doctor.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {

/// A tag that somebody holds before the camera, at a distance that was measured.
struct TagSizeTrial {
  std::vector<std::string> families = {"tag36h11"};  ///< that the tag may be of
  double size_m = 0;                                 ///< that the tag should have, without its white margin
  double distance_m = 0;                             ///< from the front of the lens to the centre of the tag
  double distance_sigma_m = 0.01;  ///< of that measurement, and of where in the lens the camera's centre is
};

/// How large the tag of these detections is printed, from the median of the distances that it would have with
/// its size: a printer that fits a page to its margins prints 3 to 6 % too small, and everything that is
/// mapped with such tags is as much too large. Warns beyond two standard deviations and 1 %, where several
/// tags are in view, and where there is none.
[[nodiscard]] DoctorLine check_tag_size(std::span<const TagDetection> detections, const CameraModel& camera,
                                        const TagSizeTrial& trial);

/// The same of a live camera, whose pictures are looked at for a second; `calibration` is its file.
[[nodiscard]] DoctorLine check_tag_size(const std::string& address, const std::filesystem::path& calibration,
                                        const TagSizeTrial& trial, const DoctorCancelled& cancelled);

}  // namespace waymark
