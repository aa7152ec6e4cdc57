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

/// Of search_strips without search_every.
inline constexpr const char* kSearchedWholly = "every picture is searched wholly";
inline constexpr const char* kSearchEvery = "Give `search_every=8`, say, too.";

/// How tags are found in the pictures of a robot.
struct PictureSettings {
  std::string detector = DetectorOptions{}.detector;
  int search_every = 1;    ///< one picture in so many is searched wholly, tags are followed in the others
  bool in_strips = false;  ///< each picture has a strip of it searched instead

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.detector, JobField("detector NAME",
                                  "Detector for the pictures of a robot that is a process: waymark (this "
                                  "project's own), or apriltag3 (slower)")
                             .one_of("waymark,apriltag3")
                             .less());
    visit(self.search_every,
          JobField(
              "search_every N",
              "Search only one picture in N wholly, and follow tags in the others, for less processor time; "
              "a tag that comes into view is found up to N pictures later; of a robot that is a process",
              1, 1000)
              .less());
    visit(self.in_strips, JobField("search_strips",
                                   "With `search_every=N`: search another strip of each picture instead of "
                                   "one picture in N, so that each costs the same")
                              .less());
  }
};

/// A robot in its world, and the files that describe them.
struct RobotSetup {
  SimulatedSetup simulated;
  std::string world_yaml;  ///< text of the world's file; empty when nobody knows the world
  std::string robot_yaml;
  RobotCommand process{};                          ///< what is the robot; empty: it is simulated
  std::vector<CameraAddress> live_cameras{};       ///< of this computer, on a robot that is a process
  PictureSettings pictures{};                      ///< how tags are found in those of such a robot
  std::vector<TagId> known_tags{};                 ///< of the map that it is driven by
  std::string robot_path{};                        ///< of the robot's file
  std::optional<CommissionRecord> commissioned{};  ///< of the robot's file
  CommissionGround ground{};                       ///< what a commission of this robot rests on
  std::string usual_robot_file{};  ///< of the robot's name, where another was named instead; empty: none

  /// Whether it has pictures, or may have some: a robot that is a process says so itself.
  [[nodiscard]] bool may_have_pictures() const { return simulated.pictures || !process.empty(); }
  [[nodiscard]] RobotDescription robot() const {
    return {simulated.model, simulated.camera, simulated.robot, simulated.camera_name,
            simulated.more_cameras};
  }
};

/// A world and a robot, by name or path. Without the name of a world: one with nothing in it. Without that of
/// a robot: the one that the world names, else limo.
[[nodiscard]] Result<RobotSetup> load_setup(const std::string& world, const std::string& robot_file,
                                            std::uint64_t seed);

/// robot.yaml of a map's folder, where it is there; else empty.
[[nodiscard]] std::string robot_file_in(const std::filesystem::path& folder);

/// What a user says of a simulated robot.
struct SimulatedWords {
  bool images = false;   ///< pictures are rendered, and tags found in them
  int threads = 1;       ///< that do so
  std::string faults{};  ///< file of a script; empty: none
};
/// Gives the setup the script of faults and the threads. Fails on fields of a simulated robot where it is a
/// process.
[[nodiscard]] Status describe_simulated(const SimulatedWords& words, const GivenFields& given,
                                        RobotSetup& setup);

/// Refuses `seed`, `when` nothing is simulated or scripted.
void refuse_seed(bool when, FieldRefusals& refused);

/// How a simulated robot that is a process of its own tells the time.
struct SimulatedTime {
  bool lockstep = false;  ///< it waits for its commands
  double pace = 0;        ///< in lockstep: no faster than so many seconds a second; 0: as fast as it goes
};

/// This program again, with these arguments. No shell reads them.
[[nodiscard]] Result<RobotCommand> own_program(std::vector<std::string> words);

/// Makes the setup's robot a process: this program again, as `waymark robot-sim WORDS`.
/// No shell reads the words.
[[nodiscard]] Status become_the_robot(RobotSetup& setup, std::vector<std::string> words,
                                      const SimulatedTime& time);

}  // namespace waymark
