#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

/// Message and hint for search_strips without search_every.
inline constexpr const char* kSearchedWholly = "has no effect without `search_every`";
inline constexpr const char* kSearchEvery = "Add `search_every=8`, for example.";

/// Tag detection in the images of a robot process.
struct PictureSettings {
  std::string detector = DetectorOptions{}.detector;
  int search_every = 1;    ///< one image in N is searched completely; in the others, tags are tracked
  bool in_strips = false;  ///< search a different strip of each image instead of one complete image in N

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.detector, JobField("detector NAME",
                                  "Detector for the images of a robot process: waymark (this project's "
                                  "detector), or apriltag3 (slower)")
                             .one_of("waymark,apriltag3")
                             .less());
    visit(self.search_every,
          JobField("search_every N",
                   "Search only one image in N completely and track tags in the others, to reduce CPU time. "
                   "A tag that enters the view is found up to N images later. Only for a robot process",
                   1, 1000)
              .less());
    visit(self.in_strips, JobField("search_strips",
                                   "With `search_every=N`: search a different strip of each image instead of "
                                   "one image in N, so that each image takes the same time")
                              .less());
  }
};

/// A robot in its world, with the files of both.
struct RobotSetup {
  SimulatedSetup simulated;
  std::string world_yaml;  ///< text of the world file; empty: the world is unknown
  std::string robot_yaml;
  RobotCommand process{};                          ///< the robot process; empty: the robot is simulated
  std::vector<CameraAddress> live_cameras{};       ///< cameras on this computer for a robot process
  PictureSettings pictures{};                      ///< detection in the images of a robot process
  std::vector<TagId> known_tags{};                 ///< tags of the map for the drive
  std::string robot_path{};                        ///< path of the robot file
  std::optional<CommissionRecord> commissioned{};  ///< from the robot file
  CommissionGround ground{};                       ///< robot and topics for which a commission is valid
  std::string usual_robot_file{};  ///< default file for this robot if the user gave another; else empty

  /// Whether it sends images, or might: a robot process reports this only in its hello.
  [[nodiscard]] bool may_have_pictures() const { return simulated.pictures || !process.empty(); }
  [[nodiscard]] RobotDescription robot() const {
    return {simulated.model, simulated.camera, simulated.robot, simulated.camera_name,
            simulated.more_cameras};
  }
};

/// Loads a world and a robot by name or path. An empty `world` gives a world without content. An empty
/// `robot_file` gives the robot named by the world, else limo.
[[nodiscard]] Result<RobotSetup> load_setup(const std::string& world, const std::string& robot_file,
                                            std::uint64_t seed);

/// Path of robot.yaml in a map folder; empty if the file does not exist.
[[nodiscard]] std::string robot_file_in(const std::filesystem::path& folder);

/// Options of a simulated robot as requested by the user.
struct SimulationRequest {
  bool images = false;   ///< render images and detect tags in them
  int threads = 1;       ///< number of threads for rendering and detection
  std::string faults{};  ///< fault script; empty: none
};
/// Adds the fault script and the number of threads to the setup. Fails on fields of a simulated robot if the
/// robot is a process.
[[nodiscard]] Status apply_simulation(const SimulationRequest& request, const GivenFields& given,
                                      RobotSetup& setup);

/// Refuses `seed` if `when` holds, because nothing is simulated or scripted.
void refuse_seed(bool when, FieldRefusals& refused);

/// The clock of a simulated robot in its own process.
struct SimulatedTime {
  bool lockstep = false;  ///< the robot waits for each command
  double pace = 0;        ///< in lockstep: limit of the real-time factor; 0: as fast as possible
};

/// The command that starts this program with these arguments, without a shell.
[[nodiscard]] Result<RobotCommand> own_program(std::vector<std::string> words);

/// Makes the setup's robot a process: `waymark robot-sim WORDS`, started without a shell.
[[nodiscard]] Status become_the_robot(RobotSetup& setup, std::vector<std::string> words,
                                      const SimulatedTime& time);

}  // namespace waymark
