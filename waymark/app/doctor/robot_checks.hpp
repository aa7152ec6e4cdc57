#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/doctor/computer_checks.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/limo/serial_port.hpp"

/// Checks robots (`waymark doctor` with `robot`). The checks only listen.
namespace waymark {

/// Data received from a robot.
struct NetworkTraffic {
  std::string odometry{};  ///< topic or channel of the odometry
  std::string commands{};
  double listened_s = 0;
  int odometries = 0;
  int others_commands = 0;           ///< number of commands sent by other programs
  std::string driver{};              ///< name of that program; empty if unknown
  int silent_publishers = 0;         ///< number of command publishers that have sent nothing
  std::string silent_names{};        ///< names of those publishers
  std::string there{};               ///< what is on the network, if no odometry arrived
  bool has_subscriber = true;        ///< whether there is a subscriber for commands; true if unknown
  std::optional<double> behind_s{};  ///< minimum difference between this computer's clock and the odometry
                                     ///< timestamps; for wall clocks only
  std::optional<double> sim_pace{};  ///< real-time factor of a simulated robot
  std::optional<double> battery_V{};
  std::optional<double> battery_share{};  ///< charge from 0 to 1
};

/// Lines about the robot, its clock, commands and battery, for those whose data arrived. `howto` is the
/// document that provides help.
[[nodiscard]] std::vector<DoctorLine> network_lines(const NetworkTraffic& traffic, const std::string& howto);

/// Checks an MBot on LCM, or a robot with a profile for ROS 2 (including peers and quality-of-service
/// settings) or Gazebo. Each function listens for a few seconds and sends nothing.
[[nodiscard]] std::vector<DoctorLine> check_mbot(const std::string& address,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_ros2(const std::string& profile,
                                                 const DoctorCancelled& cancelled);
[[nodiscard]] std::vector<DoctorLine> check_gazebo(const std::string& profile,
                                                   const DoctorCancelled& cancelled);

/// Checks LIMO's port (existence, permissions, other programs), then the battery, errors and drive state that
/// LIMO reports within 1.5 s. Sends nothing.
[[nodiscard]] std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled);

}  // namespace waymark
