#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/robots/dds/ros_environment.hpp"
#include "waymark/robots/process/robot_wire.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

/// Shared by the verbs that drive or simulate a robot.
namespace waymark::cli {

/// The ROS 2 network to join: flags take precedence over the ROS 2 environment variables.
class Ros2Flags {
 public:
  explicit Ros2Flags(CLI::App& app);
  Ros2Flags(const Ros2Flags&) = delete;
  Ros2Flags& operator=(const Ros2Flags&) = delete;

  /// Options for a node with this name. Fails if an environment variable is invalid or the ROS 2 release is
  /// unknown.
  [[nodiscard]] Result<BusOptions> options(const std::string& node = "waymark",
                                           const std::string& usual_distro = "") const;
  /// Fails if any of the flags was set. For runs that do not join the network.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  RosPlace place_{};
};

/// The flags --robot, --world, --robot-file and --seed. Must not move while the command line is parsed.
class SetupFlags {
 public:
  /// `robot_file_default` is the robot used first if --robot-file is not specified, as described in the help.
  /// If `world` is empty, the flag --world is required. With `processes`, the robot may be a process: --robot
  /// process:CMD.
  explicit SetupFlags(CLI::App& app, const std::string& world = {}, bool processes = false,
                      const std::string& robot_file_default = {});
  SetupFlags(const SetupFlags&) = delete;
  SetupFlags& operator=(const SetupFlags&) = delete;

  /// `robot_file` is used if no flag specifies a robot file; if it is also empty, load_setup() uses its
  /// default.
  [[nodiscard]] Result<RobotSetup> make(const std::string& robot_file = {}) const {
    return requested_setup(request_, processes_, robot_file, given_on(app_));
  }
  /// Whether the robot is simulated and no world is specified.
  [[nodiscard]] bool lacks_world() const { return request_.robot == "sim" && request_.world.empty(); }
  /// Flags that make a simulated robot use this setup.
  [[nodiscard]] std::vector<std::string> as_words() const { return request_.as_words(); }

 private:
  const CLI::App& app_;
  bool processes_;
  RobotRequest request_{};
};

/// The simulated camera and its scene, set in the sections camera and scene. Must not move while the command
/// line is parsed.
class SceneFlags {
 public:
  /// `has_flag` is true if the verb has --images.
  SceneFlags(Settings& settings, Reach reach, bool has_flag = true);

  /// Sets the options if images are rendered. Otherwise, fails if any of these options is on the command
  /// line.
  [[nodiscard]] Status apply(bool images, std::optional<DetectingCameraOptions>& rendered) const;
  /// Flags that pass the options set by the user to a simulated robot: those of its setup, --images, and
  /// "--set SECTION.KEY=VALUE".
  [[nodiscard]] std::vector<std::string> as_words(const SetupFlags& setup, bool images) const;

 private:
  const Settings& settings_;
  bool has_flag_;
  OptionFlags<SceneCameraOptions> camera_;
  OptionFlags<SceneOptions> scene_;
};

/// Whether a simulated robot renders images.
enum class Images : std::uint8_t { OnDemand, Always, Never };

/// The flags --images, --threads and --faults, and the camera and scene options. Must not move while the
/// command line is parsed.
class ImageFlags {
 public:
  /// If `detects` is false, the verb has no --threads, because nothing is detected. With Images::Never it
  /// has no --images; camera and scene options in a --config file are then accepted, but only apply to other
  /// verbs.
  ImageFlags(Settings& settings, Reach reach, bool detects = true, Images images = Images::OnDemand);
  ImageFlags(const ImageFlags&) = delete;
  ImageFlags& operator=(const ImageFlags&) = delete;

  /// Adds the fault script and the flags to the setup, or returns its error. Fails if the robot is a process
  /// and flags for a simulated robot are set.
  [[nodiscard]] Result<RobotSetup> apply(Result<RobotSetup> setup) const;

 private:
  const CLI::App& app_;
  SimulationRequest request_{};
  SceneFlags scene_;
};

/// Creates the connection of a robot process to its host through standard input and output. Messages are
/// printed to the console, which must outlive it.
[[nodiscard]] RobotWire standard_wire(Console& console, bool listen_only = false);

}  // namespace waymark::cli
