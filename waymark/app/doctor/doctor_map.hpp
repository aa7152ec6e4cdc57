#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "waymark/app/doctor/doctor.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/tags/expected_tag.hpp"

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

}  // namespace waymark
