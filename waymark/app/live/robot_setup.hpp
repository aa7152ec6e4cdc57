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

/// Message and hint if search_strips is set without search_every.
inline constexpr const char* kSearchedWholly = "has no effect without `search_every`";
inline constexpr const char* kSearchEvery = "Add `search_every=8`, for example.";

/// Settings for tag detection in the images of a robot process.
struct ImageSettings {
  std::string detector = DetectorOptions{}.detector;
  int search_every = 1;    ///< one in N images is searched completely; in the others, known tags are tracked
  bool in_strips = false;  ///< whether to search a different strip of each image instead of one complete
                           ///< image in N

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
  std::string world_yaml;  ///< text of the world file; empty if the world is unknown
  std::string robot_yaml;
  RobotCommand process{};                          ///< the command for the robot process; empty if the robot
                                                   ///< is simulated
  std::vector<CameraAddress> live_cameras{};       ///< cameras on this computer, used with a robot process
  ImageSettings image_settings{};                  ///< settings for detection in the images of a robot
                                                   ///< process
  std::vector<TagId> known_tags{};                 ///< tags in the map used for the drive
  std::string robot_path{};                        ///< path of the robot file
  std::optional<CommissionRecord> commissioned{};  ///< commission recorded in the robot file
  CommissionGround ground{};                       ///< robot and topics for which the commission is valid
  std::string usual_robot_file{};  ///< the default file for this robot if the user specified a different one;
                                   ///< otherwise empty

  /// Whether the robot sends images or might do so. A robot process only reports this in its hello message.
  [[nodiscard]] bool may_have_images() const { return simulated.images || !process.empty(); }
  [[nodiscard]] RobotDescription robot() const {
    return {simulated.model, simulated.camera, simulated.robot, simulated.camera_name,
            simulated.more_cameras};
  }
};

/// Loads a world and a robot by name or path. If `world` is empty, the world has no content. If `robot_file`
/// is empty, the robot named in the world is used, or else limo.
[[nodiscard]] Result<RobotSetup> load_setup(const std::string& world, const std::string& robot_file,
                                            std::uint64_t seed);

/// Path of robot.yaml in a map folder; empty if there is no such file.
[[nodiscard]] std::string robot_file_in(const std::filesystem::path& folder);

/// Options of a simulated robot as requested by the user.
struct SimulationRequest {
  bool images = false;   ///< whether to render images and detect tags in them
  int threads = 1;       ///< number of threads for rendering and detection
  std::string faults{};  ///< fault script; empty if there is none
};
/// Adds the fault script and the number of threads to the setup. Fails if the robot is a process and fields
/// for a simulated robot are set.
[[nodiscard]] Status apply_simulation(const SimulationRequest& request, const GivenFields& given,
                                      RobotSetup& setup);

/// Refuses `seed` if `when` is true, because nothing is simulated or scripted.
void refuse_seed(bool when, FieldRefusals& refused);

/// The clock of a simulated robot that runs in its own process.
struct SimulatedTime {
  bool lockstep = false;  ///< whether the robot waits for each command
  double pace = 0;        ///< maximum real-time factor in lockstep; as fast as possible if 0
};

/// The command that starts this program with these arguments, bypassing the shell.
[[nodiscard]] Result<RobotCommand> own_program(std::vector<std::string> words);

/// Turns the robot of the setup into a process, `waymark robot-sim WORDS`, started without a shell.
[[nodiscard]] Status become_the_robot(RobotSetup& setup, std::vector<std::string> words,
                                      const SimulatedTime& time);

}  // namespace waymark
