#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

/// The robots named KIND:ADDRESS, which are driven by a process of their own
/// (docs/formats/robot-process.md).
namespace waymark {

/// How a robot is started.
struct RobotStart {
  std::string robot_file{};  ///< what describes it where nobody names a file; empty: as load_setup() has it
  RobotCommand process{};
  std::string topics{};  ///< digest of what maps the robot's topics; empty: nothing does
};

/// A row of the table of kinds.
struct RobotKind {
  std::string_view name;     ///< before the colon
  std::string_view address;  ///< behind it, as help calls it
  std::string_view help;     ///< what the address is, in some words
  /// `robot_file`: what a user names; empty: none. Fails on an address that makes no sense.
  Result<RobotStart> (*start)(const std::string& address, const std::string& robot_file);
};

/// All of them.
[[nodiscard]] std::span<const RobotKind> robot_kinds();

/// "sim" and, with `processes`, each kind as KIND:ADDRESS.
[[nodiscard]] std::vector<std::string> robot_kind_names(bool processes);
/// The same with what each address is, for help.
[[nodiscard]] std::string robot_kinds_help(bool processes);

/// Whether a word begins as `KIND:ADDRESS` does.
[[nodiscard]] bool is_robot_kind(std::string_view word);

/// The setup of a robot `KIND:ADDRESS`: load_setup() with its process. Nothing where `robot` begins with no
/// kind.
[[nodiscard]] std::optional<Result<RobotSetup>> load_kind(const std::string& robot, const std::string& world,
                                                          const std::string& robot_file, std::uint64_t seed);

/// The setup of a robot by its name: "sim", which drives in a world, or, with `processes`, KIND:ADDRESS.
[[nodiscard]] Result<RobotSetup> load_robot(const std::string& robot, const std::string& world,
                                            const std::string& robot_file, std::uint64_t seed,
                                            bool processes);

/// Gives the setup of a robot that is a process the cameras of `camera_source`: [NAME=]ADDRESS each.
[[nodiscard]] Status add_live_cameras(const std::vector<std::string>& words, RobotSetup& setup);

/// Whether the robot sends tags instead of pictures, so that this computer looks for none.
[[nodiscard]] bool finds_tags_itself(const std::string& robot);

/// What a user says of a robot and its world.
struct RobotWords {
  std::string robot = "sim";
  std::string world{};
  std::string robot_file{};
  std::vector<std::string> camera_sources{};  ///< of this computer, on a robot that is a process
  PictureSettings pictures{};
  std::uint64_t seed = 1;

  /// What says the same of a simulated robot on a command line of the program.
  [[nodiscard]] std::vector<std::string> as_words() const;
};
/// With `processes` the robot may be one; `robot_file`: where it is described when the words do not say
/// so. Fails also on fields that were given and have no effect on it.
[[nodiscard]] Result<RobotSetup> described_setup(const RobotWords& words, bool processes,
                                                 const std::string& robot_file, const GivenFields& given);

}  // namespace waymark
