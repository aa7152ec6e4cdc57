#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

/// Robots named KIND:ADDRESS, each driven by its own process (docs/formats/robot-process.md).
namespace waymark {

/// The command that starts a robot, and the robot's files.
struct RobotStart {
  std::string robot_file{};  ///< robot file if the user gives none; empty: the default of load_setup()
  RobotCommand process{};
  std::string topics{};  ///< digest of the topic map; empty: the robot has none
};

/// A row in the table of robot kinds.
struct RobotKind {
  std::string_view name;     ///< before the colon
  std::string_view address;  ///< name of the part after the colon in the help
  std::string_view help;     ///< meaning of the address
  /// `robot_file`: the file given by the user; empty: none. Fails on an invalid address.
  Result<RobotStart> (*start)(const std::string& address, const std::string& robot_file);
};

/// All robot kinds.
[[nodiscard]] std::span<const RobotKind> robot_kinds();

/// "sim" and, with `processes`, each kind as KIND:ADDRESS.
[[nodiscard]] std::vector<std::string> robot_kind_names(bool processes);
/// The same names with the meaning of each address, for the help.
[[nodiscard]] std::string robot_kinds_help(bool processes);

/// Whether a word begins with a robot kind and a colon.
[[nodiscard]] bool is_robot_kind(std::string_view word);

/// The setup of a robot `KIND:ADDRESS`: load_setup() with its process. Nothing if `robot` does not begin with
/// a robot kind.
[[nodiscard]] std::optional<Result<RobotSetup>> load_kind(const std::string& robot, const std::string& world,
                                                          const std::string& robot_file, std::uint64_t seed);

/// The setup of the robot with this name: "sim", which drives in a world, or, with `processes`, KIND:ADDRESS.
[[nodiscard]] Result<RobotSetup> load_robot(const std::string& robot, const std::string& world,
                                            const std::string& robot_file, std::uint64_t seed,
                                            bool processes);

/// Adds the cameras of `camera_source`, [NAME=]ADDRESS each, to the setup of a robot process.
[[nodiscard]] Status add_live_cameras(const std::vector<std::string>& words, RobotSetup& setup);

/// Whether the robot sends tags instead of images, so that no detection runs on this computer.
[[nodiscard]] bool finds_tags_itself(const std::string& robot);

/// A robot and its world as requested by the user.
struct RobotRequest {
  std::string robot = "sim";
  std::string world{};
  std::string robot_file{};
  std::vector<std::string> camera_sources{};  ///< cameras on this computer for a robot process
  PictureSettings pictures{};
  std::uint64_t seed = 1;

  /// The flags that make this program simulate the robot.
  [[nodiscard]] std::vector<std::string> as_words() const;
};
/// Makes the setup for a request. With `processes`, the robot may be a process. `robot_file` is used if the
/// request contains none. Also fails on given fields that have no effect on this robot.
[[nodiscard]] Result<RobotSetup> requested_setup(const RobotRequest& request, bool processes,
                                                 const std::string& robot_file, const GivenFields& given);

}  // namespace waymark
