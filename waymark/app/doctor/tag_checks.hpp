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

/// How often a map tag was detected in the images in which it is expected.
struct ExpectedTagCount {
  int expected = 0;                    ///< number of images in which the tag is expected
  std::map<MissReason, int> missed{};  ///< number of those images in which it was missed, for each reason
  [[nodiscard]] int times_missed() const;
};

/// Detection of map tags in images from a stationary camera.
struct MapTagTrial {
  int images = 0;
  int with_tags = 0;  ///< number of images in which a map tag was detected
  int placed = 0;     ///< number of images for which the camera pose is certain
  std::map<TagId, ExpectedTagCount> tags{};

  /// Counts the tags in one image. The camera pose computed from the detected tags predicts where the others
  /// should be. `min_white_black_diff` is the detector option.
  void add(const ImageView& image, const std::vector<TagDetection>& found, const TagMap& map,
           const CameraModel& camera, int min_white_black_diff);
};

/// Fails if no map tag is visible. Warns if the camera pose is ambiguous, and about each expected tag that is
/// missed in more than one out of five images, with the reason. `view_command` is the command that shows the
/// images.
[[nodiscard]] DoctorLine check_map_tags(const MapTagTrial& trial, const std::string& view_command);

/// The same with images from a live camera over two seconds; `map` is a map file or its folder.
[[nodiscard]] DoctorLine check_map_tags(const std::string& address, const std::filesystem::path& calibration,
                                        const std::filesystem::path& map, const DoctorCancelled& cancelled);

/// A tag at a measured distance from the camera.
struct TagSizeTrial {
  std::vector<std::string> families = {"tag36h11"};  ///< families that the tag may belong to
  double size_m = 0;                                 ///< nominal side length of the black square
  double distance_m = 0;                             ///< measured from the front of the lens to the tag
                                                     ///< centre
  double distance_sigma_m = 0.01;                    ///< standard deviation of that measurement, including
                                                     ///< the position of the optical centre
};

/// Determines the printed size of the tag from the median of the distances that are estimated with its
/// nominal size. A printer that fits a page to its margins prints tags 3 to 6 % too small, which makes maps
/// too large by the same factor. Warns if the difference exceeds two standard deviations and 1 %, and unless
/// exactly one tag is visible.
[[nodiscard]] DoctorLine check_tag_size(std::span<const TagDetection> detections, const CameraModel& camera,
                                        const TagSizeTrial& trial);

/// The same with images from a live camera over one second; `calibration` is the path of its calibration
/// file.
[[nodiscard]] DoctorLine check_tag_size(const std::string& address, const std::filesystem::path& calibration,
                                        const TagSizeTrial& trial, const DoctorCancelled& cancelled);

}  // namespace waymark
