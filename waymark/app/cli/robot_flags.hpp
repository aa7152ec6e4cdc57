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

/// The place on the ROS 2 network: flags override the environment variables of ROS 2.
class Ros2Flags {
 public:
  explicit Ros2Flags(CLI::App& app);
  Ros2Flags(const Ros2Flags&) = delete;
  Ros2Flags& operator=(const Ros2Flags&) = delete;

  /// Options for a node with this name. Fails on invalid environment variables and on an unknown ROS 2
  /// release.
  [[nodiscard]] Result<BusOptions> options(const std::string& node = "waymark",
                                           const std::string& usual_distro = "") const;
  /// Fails if one of the flags was given. For runs that do not join the network.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  RosPlace place_{};
};

/// The flags --robot, --world, --robot-file and --seed. Must not move while the command line is parsed.
class SetupFlags {
 public:
  /// `robot_file_default`: the first choice without --robot-file, as named in the help. Without a `world` the
  /// flag --world is required. With `processes` the robot may be a process: --robot process:CMD.
  explicit SetupFlags(CLI::App& app, const std::string& world = {}, bool processes = false,
                      const std::string& robot_file_default = {});
  SetupFlags(const SetupFlags&) = delete;
  SetupFlags& operator=(const SetupFlags&) = delete;

  /// `robot_file`: the robot's file if no flag names one; empty: the default of load_setup().
  [[nodiscard]] Result<RobotSetup> make(const std::string& robot_file = {}) const {
    return requested_setup(request_, processes_, robot_file, given_on(app_));
  }
  /// Whether the robot is simulated and its world is not given.
  [[nodiscard]] bool lacks_world() const { return request_.robot == "sim" && request_.world.empty(); }
  /// Flags for the command line of a simulated robot with this setup.
  [[nodiscard]] std::vector<std::string> as_words() const { return request_.as_words(); }

 private:
  const CLI::App& app_;
  bool processes_;
  RobotRequest request_{};
};

/// The simulated camera and its scene: the sections camera and scene. Must not move while the command line is
/// parsed.
class SceneFlags {
 public:
  /// `has_flag`: whether the verb has --images.
  SceneFlags(Settings& settings, Reach reach, bool has_flag = true);

  /// Sets the options if there are images. Without images, fails on an option on the command line.
  [[nodiscard]] Status apply(bool images, std::optional<DetectingCameraOptions>& pictures) const;
  /// Flags for the command line of a simulated robot with the given options: those of its setup, --images,
  /// and
  /// "--set SECTION.KEY=VALUE".
  [[nodiscard]] std::vector<std::string> as_words(const SetupFlags& setup, bool images) const;

 private:
  const Settings& settings_;
  bool has_flag_;
  OptionFlags<SceneCameraOptions> camera_;
  OptionFlags<SceneOptions> scene_;
};

/// Whether a simulated robot has images.
enum class Pictures : std::uint8_t { OnDemand, Always, Never };

/// The flags --images, --threads, --faults, and the options of camera and scene. Must not move while the
/// command line is parsed.
class PictureFlags {
 public:
  /// Without `detects` the verb has no --threads, because nothing is detected. With Pictures::Never it has no
  /// --images, and a --config file may contain options of camera and scene only for other verbs.
  PictureFlags(Settings& settings, Reach reach, bool detects = true, Pictures pictures = Pictures::OnDemand);
  PictureFlags(const PictureFlags&) = delete;
  PictureFlags& operator=(const PictureFlags&) = delete;

  /// Adds the fault script and the flags to the setup; passes an error on. Fails on flags of a simulated
  /// robot if the robot is a process.
  [[nodiscard]] Result<RobotSetup> apply(Result<RobotSetup> setup) const;

 private:
  const CLI::App& app_;
  SimulationRequest request_{};
  SceneFlags scene_;
};

/// The wire of a robot process in this program: standard input and output. Messages go to the console, which
/// must outlive the wire.
[[nodiscard]] RobotWire standard_wire(Console& console, bool listen_only = false);

}  // namespace waymark::cli
