#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/doctor/computer_checks.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/limo/serial_port.hpp"

/// Checks of robots (`waymark doctor` with `robot`). They only listen.
namespace waymark {

/// Data received from a robot.
struct NetworkTraffic {
  std::string odometry{};  ///< topic or channel
  std::string commands{};
  double listened_s = 0;
  int odometries = 0;
  int others_commands = 0;           ///< commands of other programs
  std::string driver{};              ///< name of that program; empty: unknown
  int silent_publishers = 0;         ///< publishers of commands that sent none
  std::string silent_names{};        ///< their names
  std::string there{};               ///< content of the network if no odometry arrived
  bool has_subscriber = true;        ///< a subscriber for commands exists, or this is unknown
  std::optional<double> behind_s{};  ///< this computer's clock minus odometry stamp, minimum; for wall clocks
  std::optional<double> sim_pace{};  ///< real-time factor of a simulation
  std::optional<double> battery_V{};
  std::optional<double> battery_share{};  ///< 0 to 1
};

/// The lines robot, clock, commands and battery, if their data arrived. `howto`: the document with help.
[[nodiscard]] std::vector<DoctorLine> network_lines(const NetworkTraffic& traffic, const std::string& howto);

/// Checks an MBot on LCM, or a robot of a profile on ROS 2 (with peers and qualities of service) or in
/// Gazebo. Each function listens for a few seconds and sends nothing.
[[nodiscard]] std::vector<DoctorLine> check_mbot(const std::string& address,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_ros2(const std::string& profile,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_gazebo(const std::string& profile,
                                                   const DoctorCancelled& cancelled);

/// Checks LIMO's port (existence, permissions, other programs), then battery, errors and drive as LIMO
/// reports them within 1.5 s. Sends nothing.
[[nodiscard]] std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled);

}  // namespace waymark
