#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/video/map_video.hpp"
#include "waymark/base/job_field.hpp"

namespace waymark {

/// What a user says of the camera and the place of a video: files, names of tags, degrees, milliseconds.
struct MapVideoDescription {
  CameraDescription camera{};
  double tag_size_sigma_m = 0.0005;
  std::string anchor{};                     ///< tags, "3,7"; empty: chosen
  std::string prior{};                      ///< file of a map; empty: none
  std::optional<double> prior_sigma_m{};    ///< of its places ...
  std::optional<double> prior_sigma_deg{};  ///< ... and directions
  std::vector<std::string> distances{};     ///< "3,7,2.41" or "3,7,2.41,0.002"
  std::vector<std::string> upright{};       ///< tags, "3" or "3,7"
  std::vector<std::string> floor{};
  std::vector<std::string> planes{};  ///< each: tags on one plane, "3,4,7"
  double level_sigma_deg = 1;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.camera.file,
          JobField("camera FILE",
                   "Calibration of the camera of a video, or of the recording of a camera (calibration.yaml, "
                   "ROS camera_info, kalibr YAML or JSON of PhotonVision); the standard deviations of a "
                   "calibration.yaml become part of the map's")
              .grouped("Videos"));
    CameraDescription::fields(self.camera, visit);
    visit(self.camera.readout_ms,
          JobField(
              "readout_ms NUMBER",
              "Time from the first row to the last of the camera's rolling shutter, in milliseconds; "
              "negative when rows are read from the bottom. Unless given: that of a calibration.yaml, else 0",
              -200.0, 200.0)
              .grouped("Videos"));
    visit(self.tag_size_sigma_m, JobField("tag_size_sigma_m NUMBER",
                                          "Standard deviation of --tag-size-m, the same error for all tags "
                                          "of a video [m]; it becomes part of the map's covariance",
                                          0.0, 1.0)
                                     .less());
    visit(self.distances, JobField("distance TAG,TAG,METRES",
                                   "A measured distance between the centres of two tags of a video, which "
                                   "gives the scale: ids, metres and, unless it is 0.005 m, its standard "
                                   "deviation, such as 3,7,2.41 or 3,7,2.41,0.002. May be repeated")
                              .grouped("Videos"));
    visit(self.upright,
          JobField("upright TAGS",
                   "Tags of a video that hang upright on vertical walls, such as 3,7: they level the map")
              .by_commas()
              .grouped("Videos"));
    visit(self.floor, JobField("floor TAGS",
                               "Tags of a video that lie on the floor: they level the map, and z is 0 there")
                          .by_commas()
                          .grouped("Videos"));
    visit(
        self.planes,
        JobField(
            "plane TAGS",
            "Tags of a video that are on one plane, such as one wall, wherever it is: 3,4,7. May be repeated")
            .grouped("Videos"));
    visit(
        self.level_sigma_deg,
        JobField(
            "level_sigma_deg NUMBER",
            "Standard deviation of the directions of the tags of --upright, --floor and --plane, in degrees",
            1e-3, 45.0)
            .less());
    visit(self.prior_sigma_m, JobField("prior_sigma_m NUMBER",
                                       "Standard deviation of the places of --prior, for a video: its tags "
                                       "then hold the map, each within it [m]",
                                       1e-6, 10.0)
                                  .less());
    visit(self.prior_sigma_deg, JobField("prior_sigma_deg NUMBER",
                                         "Standard deviation of the directions of the tags of --prior, for a "
                                         "video, in degrees. Unless given, with --prior-sigma-m: 2",
                                         1e-4, 180.0)
                                    .less());
  }
};

/// A job with the camera, anchors, distances and levels of the description; what else it needs is the
/// caller's. Errors name the flag of `waymark map` at fault, or the file.
[[nodiscard]] Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                                      std::optional<double> tag_size_m);
/// The same with what is common to it and the job of a lap.
[[nodiscard]] Result<MapVideoJob> described_map_video(const MapVideoDescription& description,
                                                      const MapJob& common);

/// Of flags that are about robots.
inline constexpr const char* kNotOfVideos = "this has no effect on videos";
inline constexpr const char* kNoRobot = "A video is mapped without a robot and its odometry: leave it out.";
/// Fails on flags that have no effect on videos: about robots, their odometry and their routes, and about
/// what was not given.
[[nodiscard]] Status check_effects(const MapVideoDescription& of, const GivenFlags& given);
/// Fails where a flag about videos was given: the lap is none.
[[nodiscard]] Status check_no_video(const GivenFlags& given);

}  // namespace waymark
