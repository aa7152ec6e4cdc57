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

/// Detections of a map tag in the images where it is expected.
struct ExpectedTagCount {
  int expected = 0;                    ///< number of images where it is expected
  std::map<MissReason, int> missed{};  ///< number of these images where it was missed, by reason
  [[nodiscard]] int times_missed() const;
};

/// Detection of map tags in images of a stationary camera.
struct MapTagTrial {
  int pictures = 0;
  int with_tags = 0;  ///< number of images with a detected map tag
  int placed = 0;     ///< number of images with a certain camera pose
  std::map<TagId, ExpectedTagCount> tags{};

  /// Counts the tags of one image. The camera pose from the detected tags predicts the other tags.
  /// `min_white_black_diff`: the option of the detector.
  void add(const ImageView& image, const std::vector<TagDetection>& found, const TagMap& map,
           const CameraModel& camera, int min_white_black_diff);
};

/// Fails if no map tag is in view. Warns if the camera pose is ambiguous, and about each expected tag that is
/// missed in more than one of five images, with the reason. `view_command` shows the images.
[[nodiscard]] DoctorLine check_map_tags(const MapTagTrial& trial, const std::string& view_command);

/// The same for two seconds of a live camera; `map`: a map file or its folder.
[[nodiscard]] DoctorLine check_map_tags(const std::string& address, const std::filesystem::path& calibration,
                                        const std::filesystem::path& map, const DoctorCancelled& cancelled);

/// A tag at a measured distance from the camera.
struct TagSizeTrial {
  std::vector<std::string> families = {"tag36h11"};  ///< possible families of the tag
  double size_m = 0;                                 ///< nominal side of the black square
  double distance_m = 0;                             ///< from the front of the lens to the tag centre
  double distance_sigma_m = 0.01;                    ///< of that measurement and of the optical centre
};

/// Measures the printed size of the tag in these detections, from the median of the distances estimated with
/// its nominal size. A printer that fits a page to its margins prints 3 to 6 % too small, which makes maps
/// too large by the same factor. Warns beyond two standard deviations and 1 %, and unless exactly one tag is
/// in view.
[[nodiscard]] DoctorLine check_tag_size(std::span<const TagDetection> detections, const CameraModel& camera,
                                        const TagSizeTrial& trial);

/// The same for one second of a live camera; `calibration`: its file.
[[nodiscard]] DoctorLine check_tag_size(const std::string& address, const std::filesystem::path& calibration,
                                        const TagSizeTrial& trial, const DoctorCancelled& cancelled);

}  // namespace waymark
