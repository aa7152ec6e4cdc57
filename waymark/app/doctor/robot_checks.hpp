#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/doctor/computer_checks.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/limo/serial_port.hpp"

/// Checks of robots on a network (`waymark doctor` with `robot`): they only listen.
namespace waymark {

/// What was heard of a robot.
struct NetworkHeard {
  std::string odometry{};  ///< topic or channel
  std::string commands{};
  double listened_s = 0;
  int odometries = 0;
  int others_commands = 0;           ///< of somebody who drives it
  std::string driver{};              ///< who that is; empty: the network does not tell
  int silent_publishers = 0;         ///< of commands, none of which came
  std::string silent_names{};        ///< likewise
  std::string there{};               ///< what is on the network, where no odometry came
  bool hears_commands = true;        ///< somebody subscribes to the commands, or the network does not tell
  std::optional<double> behind_s{};  ///< this computer's clock less the least stamp, where it is a wall clock
  std::optional<double> sim_pace{};  ///< simulated seconds a second
  std::optional<double> battery_V{};
  std::optional<double> battery_share{};  ///< 0 to 1
};

/// The lines robot, clock, commands and battery, as far as something is known of them. `howto`: the document
/// that helps.
[[nodiscard]] std::vector<DoctorLine> network_lines(const NetworkHeard& heard, const std::string& howto);

/// An MBot on LCM; a robot of a profile on ROS 2 (with peers and qualities of service), or in Gazebo. Each
/// listens for some seconds and sends nothing.
[[nodiscard]] std::vector<DoctorLine> check_mbot(const std::string& address,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_ros2(const std::string& profile,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_gazebo(const std::string& profile,
                                                   const DoctorCancelled& cancelled);

/// Whether LIMO's port is there and may be opened (group, other programs), and what LIMO says there of its
/// battery, its errors and its drive in a second and a half. Nothing is sent.
[[nodiscard]] std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled);

}  // namespace waymark
