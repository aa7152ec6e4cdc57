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

/// What verbs share that drive a robot, or are one.
namespace waymark::cli {

/// Where on the network of ROS 2: flags over what ROS's environment variables say.
class Ros2Flags {
 public:
  explicit Ros2Flags(CLI::App& app);
  Ros2Flags(const Ros2Flags&) = delete;
  Ros2Flags& operator=(const Ros2Flags&) = delete;

  /// As the node of this name. Fails on variables of the environment that make no sense, and on a release of
  /// ROS 2 that is none.
  [[nodiscard]] Result<BusOptions> options(const std::string& node = "waymark",
                                           const std::string& usual_distro = "") const;
  /// Fails when one of them was given, where nothing joins the network.
  [[nodiscard]] Status refuse_all(const std::string& why, const std::string& hint) const;

 private:
  const CLI::App& app_;
  RosPlace place_{};
};

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

/// The simulated camera and what it looks at: the sections camera and scene. Must stay where it is while the
/// command line is parsed.
class SceneFlags {
 public:
  /// `has_flag`: whether the verb has --images.
  SceneFlags(Settings& settings, Reach reach, bool has_flag = true);

  /// The options, where there are pictures; without them one on the command line is refused.
  [[nodiscard]] Status apply(bool images, std::optional<DetectingCameraOptions>& pictures) const;
  /// What was given again for the command line of a simulated robot, with the flags of its setup, --images,
  /// and "--set SECTION.KEY=VALUE".
  [[nodiscard]] std::vector<std::string> as_words(const SetupFlags& setup, bool images) const;

 private:
  const Settings& settings_;
  bool has_flag_;
  OptionFlags<SceneCameraOptions> camera_;
  OptionFlags<SceneOptions> scene_;
};

/// Whether a simulated robot has pictures.
enum class Pictures : std::uint8_t { OnDemand, Always, Never };

/// The flags --images, --threads, --faults, and the camera and the scene. Must stay where it is while the
/// command line is parsed.
class PictureFlags {
 public:
  /// Without `detects` nothing is detected, and there is no --threads. Where there are never pictures, there
  /// is no --images, and the options of camera and scene are those that a file may hold for other verbs.
  PictureFlags(Settings& settings, Reach reach, bool detects = true, Pictures pictures = Pictures::OnDemand);
  PictureFlags(const PictureFlags&) = delete;
  PictureFlags& operator=(const PictureFlags&) = delete;

  /// The setup, unless it failed, with the script of faults and what the flags say. Fails on flags of a
  /// simulated robot where the robot is a process.
  [[nodiscard]] Result<RobotSetup> apply(Result<RobotSetup> setup) const;

 private:
  const CLI::App& app_;
  SimulatedWords words_{};
  SceneFlags scene_;
};

/// Of a robot process that is this program: standard input and output; words go to the console, which must
/// outlive the wire.
[[nodiscard]] RobotWire standard_wire(Console& console, bool listen_only = false);

}  // namespace waymark::cli
