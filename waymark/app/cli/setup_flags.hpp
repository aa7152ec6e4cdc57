#pragma once

#include <string>
#include <vector>

#include "waymark/app/cli/options_flags.hpp"
#include "waymark/app/live/described_setup.hpp"

namespace waymark::cli {

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
  [[nodiscard]] Result<RobotSetup> make(const std::string& robot_file = {}) const {
    return described_setup(words_, processes_, robot_file, given_on(app_));
  }
  /// Whether the robot is simulated and no flag names its world.
  [[nodiscard]] bool lacks_world() const { return words_.robot == "sim" && words_.world.empty(); }
  /// The flags of the simulated robot again, for a command line.
  [[nodiscard]] std::vector<std::string> as_words() const { return words_.as_words(); }

 private:
  const CLI::App& app_;
  bool processes_;
  RobotWords words_{};
};

}  // namespace waymark::cli
