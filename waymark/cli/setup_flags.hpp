#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/cli/options_flags.hpp"
#include "waymark/live/robot_setup.hpp"

namespace waymark::cli {

/// What a world may be called on the command line.
inline constexpr const char* kWorldNames =
    "circuit24, limo-walls, academy-house, mbot-square, or the path of a .yaml file";

/// What a robot's file may be called on the command line.
inline constexpr const char* kRobotNames = "a name that `waymark robots` lists, or the path of a .yaml file";

/// Of --search-strips without --search-every.
inline constexpr const char* kSearchedWholly = "every picture is searched wholly";
inline constexpr const char* kSearchEvery = "Give --search-every 8, say, too.";

/// The flags --robot, --world, --robot-file and --seed. Must stay where it is while the command line is
/// parsed.
class SetupFlags {
 public:
  /// `robot_file_default` is what the help says comes first without --robot-file. Without a `world` the flag
  /// --world is required.
  /// With `processes` the robot may be a program of the user's: --robot process:CMD.
  explicit SetupFlags(CLI::App& app, const std::string& world = {}, bool processes = false,
                      const std::string& robot_file_default = {});
  SetupFlags(const SetupFlags&) = delete;
  SetupFlags& operator=(const SetupFlags&) = delete;

  /// `robot_file`: where the robot is described when no flag says so; empty: as load_setup() has it.
  [[nodiscard]] Result<RobotSetup> make(const std::string& robot_file = {}) const;
  /// Whether the robot is simulated and no flag names its world.
  [[nodiscard]] bool lacks_world() const { return robot_ == "sim" && world_.empty(); }
  /// Refuses --seed, `when` nothing is simulated or scripted.
  static void refuse_seed(bool when, Refusals& refused);
  /// The flags of the simulated robot again, for a command line.
  [[nodiscard]] std::vector<std::string> as_words() const;

 private:
  const CLI::App& app_;
  bool processes_;
  std::string robot_ = "sim";
  std::string world_;
  std::string robot_file_;
  std::vector<std::string> live_cameras_{};
  PictureSettings pictures_{};
  std::uint64_t seed_ = 1;
};

}  // namespace waymark::cli
