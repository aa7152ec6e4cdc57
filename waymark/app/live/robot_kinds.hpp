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

/// The command that starts a robot, and the files it uses.
struct RobotStart {
  std::string robot_file{};  ///< robot file used if the user does not specify one; if empty, load_setup()
                             ///< uses its default
  RobotCommand process{};
  std::string topics{};  ///< digest of the topic map; empty if the robot has none
};

/// A row in the table of robot kinds.
struct RobotKind {
  std::string_view name;     ///< name, which precedes the colon
  std::string_view address;  ///< placeholder in the help for the address, which follows the colon
  std::string_view help;     ///< meaning of the address
  /// `robot_file` is the file specified by the user, empty if there is none. Fails if the address is invalid.
  Result<RobotStart> (*start)(const std::string& address, const std::string& robot_file);
};

/// All robot kinds.
[[nodiscard]] std::span<const RobotKind> robot_kinds();

/// Returns "sim" and, with `processes`, each kind as KIND:ADDRESS.
[[nodiscard]] std::vector<std::string> robot_kind_names(bool processes);
/// The same names with an explanation of each address, for the help.
[[nodiscard]] std::string robot_kinds_help(bool processes);

/// Whether a word starts with a robot kind and a colon.
[[nodiscard]] bool is_robot_kind(std::string_view word);

/// The setup for a robot `KIND:ADDRESS`: load_setup() plus its process. `nullopt` if `robot` does not start
/// with a robot kind.
[[nodiscard]] std::optional<Result<RobotSetup>> load_kind(const std::string& robot, const std::string& world,
                                                          const std::string& robot_file, std::uint64_t seed);

/// The setup for the robot with this name: "sim", which drives in a world, or, with `processes`,
/// KIND:ADDRESS.
[[nodiscard]] Result<RobotSetup> load_robot(const std::string& robot, const std::string& world,
                                            const std::string& robot_file, std::uint64_t seed,
                                            bool processes);

/// Adds the cameras in `camera_source`, each in the form [NAME=]ADDRESS, to the setup of a robot process.
[[nodiscard]] Status add_live_cameras(const std::vector<std::string>& words, RobotSetup& setup);

/// Whether the robot sends tags instead of images, so that no detection runs on this computer.
[[nodiscard]] bool finds_tags_itself(const std::string& robot);

/// A robot and its world as requested by the user.
struct RobotRequest {
  std::string robot = "sim";
  std::string world{};
  std::string robot_file{};
  std::vector<std::string> camera_sources{};  ///< cameras on this computer, used with a robot process
  ImageSettings image_settings{};
  std::uint64_t seed = 1;

  /// Flags that make this program simulate the requested robot.
  [[nodiscard]] std::vector<std::string> as_words() const;
};
/// Creates the setup for a request. With `processes`, the robot may be a process. `robot_file` is used if the
/// request does not specify one. Fails also if fields are set that have no effect on this robot.
[[nodiscard]] Result<RobotSetup> requested_setup(const RobotRequest& request, bool processes,
                                                 const std::string& robot_file, const GivenFields& given);

}  // namespace waymark
