#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/scene/map_scene.hpp"
#include "waymark/base/fields.hpp"

namespace waymark {

/// What a map stands on, as people say it.
struct AnchorWords {
  std::string anchor{};                ///< "tag36h11:0", or its id; empty: as the recording says
  std::vector<double> anchor_pose{};   ///< x, y, z [m], roll, pitch, yaw [deg] of the tag's frame; empty: so
  std::optional<double> tag_size_m{};  ///< the same
};

/// Fails on numbers that are not finite, an anchor more than 10 km away, and a size that is none.
[[nodiscard]] Result<SetupOverrides> overrides_of(const AnchorWords& words);

/// What a user says of a map to be made of a lap: names, files, names of tags, degrees.
struct MapDescription {
  std::string method = "bundle";
  std::string anchor{};                  ///< of its tags; empty: as the recording says
  std::vector<double> anchor_pose{};     ///< AnchorWords::anchor_pose
  std::vector<std::string> tag_sizes{};  ///< as parse_tag_sizes() has them; empty: as the recording says
  std::string world{};                   ///< name or file of the truth; empty: what the recording holds
  std::string prior{};                   ///< file of an older map to compare with; empty: none
  std::string extend{};                  ///< map, or its folder, that the lap is to improve; empty: none
  std::string route_name{};
  std::vector<std::string> freeze{};  ///< tags of that map
  std::vector<std::string> remove{};
};

/// Gives the job method, anchor, sizes and truth of the description. Errors name the flag of `waymark map` at
/// fault, or the file of the world.
[[nodiscard]] Status describe_map(const MapDescription& description, MapJob& job);
/// Afterwards: the maps that are named, and what is said of their tags.
[[nodiscard]] Status read_described_maps(const MapDescription& description, MapJob& job);

/// All that a user says to `waymark map`, but options.
struct MapWords {
  MapJob job{};
  MapDescription of{};            ///< of a lap, or of a video
  MapSceneJob scene{};            ///< with TagSLAM's files
  std::string model = "waymark";  ///< as describe_scene() has it
  bool free_intrinsics = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.job.lap,
          JobField("lap LAP", "Recording of a taught lap, with --tagslam of tags and odometry; or a video")
              .input());
    visit(self.job.more,
          JobField("more MORE",
                   "Further files of the same lap: tables of odometry or of an IMU, parts of a bag")
              .input());
    visit(self.job.robot,
          JobField("robot FILE",
                   "Camera and its mounting: a robot's file, or a name. Unless given: the recording's"));
    CameraChoice::fields(self.job.frames, visit);
    visit(self.job.folder, JobField("output FOLDER", "Folder for the map, the route and the figures"));
    visit(self.of.method, JobField("method NAME",
                                   "Mapping method: bundle (bundle adjustment of all observations and "
                                   "odometry) or chain (tag to tag, without optimisation)"));
    visit(self.of.anchor,
          JobField("anchor TAG",
                   "Anchor tag, which sets the origin of the map, for example tag36h11:0; of a video with "
                   "--prior several (3,7,9). Unless given: that of the recording"));
    visit(self.of.anchor_pose,
          JobField("anchor_pose X Y Z ROLL PITCH YAW",
                   "Where the anchor stands in the map: x y z [m] and roll pitch yaw [deg] of the tag's "
                   "frame (x right, y down, z into the tag). Unless given: that of the recording; for "
                   "another anchor the map's origin is its centre, map z is up, map x goes into the tag")
              .parts(6));
    visit(self.of.tag_sizes, JobField("tag_size_m SIZE",
                                      "Side of the black square of the tags [m]; ID=SIZE for a tag of "
                                      "another size (repeatable). Unless given: those of the recording")
                                 .repeated());
    visit(self.of.world,
          JobField("world NAME", "Ground truth of the tags, where the recording does not hold it"));
    visit(self.of.prior,
          JobField("prior FILE",
                   "Older map of the place (map.yaml, or any that `waymark localize --map` takes) with which "
                   "the new one is compared: tags swapped, moved or resized since are listed"));
    visit(self.of.extend,
          JobField("extend MAP",
                   "A map (map.yaml, or its folder) that this lap is to improve: the lap is moved onto it, "
                   "and both are adjusted together; what the lap did not see stays. The older one is kept"));
    visit(self.of.route_name, JobField("route_name NAME",
                                       "With --extend: the lap becomes the route of this name "
                                       "(route-NAME.yaml) beside those of the map, which stay"));
    visit(self.of.freeze,
          JobField("freeze TAGS",
                   "With --extend: tags that stay exactly where the map has them, such as 3,7 or tag36h11:3")
              .by_commas()
              .less());
    visit(self.of.remove,
          JobField("remove TAGS",
                   "Tags that were removed, with --extend: deleted from the map and from the lap")
              .by_commas()
              .less());
    visit(self.job.map_sigma_m, JobField("map_sigma NUMBER",
                                         "Standard deviation of the tags' positions, with --extend, of a map "
                                         "without covariances, such as one measured by hand [m]",
                                         1e-6, 10.0)
                                    .less());
    visit(self.scene.tagslam,
          JobField("tagslam FOLDER",
                   "A folder with TagSLAM's tagslam.yaml, cameras.yaml and camera_poses.yaml (or a "
                   "config.json): cameras and bodies are as they say, no floor is needed"));
    visit(self.model, JobField("model NAME",
                               "Cost model with --tagslam: waymark, or tagslam (TagSLAM's noise of every "
                               "observation and of the cameras' poses)")
                          .less());
    visit(self.free_intrinsics,
          JobField("free_intrinsics",
                   "With --tagslam, cameras are adjusted too: focal lengths and principal point within 1 % "
                   "(standard deviation) of what is given, distortion k within 0.05 and p within 0.005")
              .less());
    visit(self.scene.against,
          JobField("against FOLDER",
                   "With --tagslam, another solution (ref_static.csv, ref_trajectory.csv): both are about "
                   "its frames and tags, and its cost is printed")
              .less());
  }
};

/// The job of a scene, with options of the search.
[[nodiscard]] Result<MapSceneJob> described_scene(const MapWords& words, const SearchOptions& search);
/// Fails where the lap or the folder is missing, and on flags that have no effect on laps.
[[nodiscard]] Status check_effects(const MapWords& words, const GivenFlags& given);
/// Of flags that are about scenes.
inline constexpr const char* kNotOfScenes = "this has no effect on scenes that TagSLAM's files describe";
inline constexpr const char* kNoTagslam = "Leave it out, or leave out --tagslam.";

}  // namespace waymark
