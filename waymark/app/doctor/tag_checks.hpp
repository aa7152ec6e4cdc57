#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "waymark/app/doctor/computer_checks.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/tags/tag_tracker.hpp"

namespace waymark {

/// How a tag of a map fared in the pictures in which it should be found.
struct ExpectedTagCount {
  int expected = 0;                    ///< pictures in which it should be found
  std::map<MissReason, int> missed{};  ///< of these, in which it was not, by the reason
  [[nodiscard]] int times_missed() const;
};

/// How the tags of a map are found in pictures of a camera that stands.
struct MapTagTrial {
  int pictures = 0;
  int with_tags = 0;  ///< of these, in which a tag of the map was found
  int placed = 0;     ///< of these, whose tags tell where the camera is
  std::map<TagId, ExpectedTagCount> tags{};

  /// Counts the tags of one picture: the camera's pose follows from those that were found, and the others
  /// should be where that pose has them. `min_white_black_diff`: of the detector that found them.
  void add(const ImageView& image, const std::vector<TagDetection>& found, const TagMap& map,
           const CameraModel& camera, int min_white_black_diff);
};

/// Fails where no tag of the map is in view; warns where the camera's pose stays ambiguous, and of each tag
/// that should be found and is missed in more than one picture of five, with the reason. `view_command` shows
/// the pictures.
[[nodiscard]] DoctorLine check_map_tags(const MapTagTrial& trial, const std::string& view_command);

/// The same of a live camera, whose pictures are looked at for two seconds; `map` is a map's file or its
/// folder.
[[nodiscard]] DoctorLine check_map_tags(const std::string& address, const std::filesystem::path& calibration,
                                        const std::filesystem::path& map, const DoctorCancelled& cancelled);

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
