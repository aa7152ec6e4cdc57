#pragma once

#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/limo/limo_messages.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

struct LimoRobotOptions {
  std::string port{};
  LimoDrive drive = LimoDrive::Differential;
  std::string beside{};  ///< named pipe with additional lines for a robot process, with timestamps from this
                         ///< computer's steady clock
  bool simulated = false;  ///< whether LIMO is simulated, as the hello then declares
};

/// User settings for LIMO's process.
struct LimoRobotSettings {
  LimoRobotOptions options{};  ///< all options except the drive
  std::string robot_file = "limo";
  std::string drive{};  ///< a name for parse_limo_drive(); the drive in the robot file if empty
  bool listen_only = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.options.port,
          JobField("port port PORT", "Serial port of LIMO's mainboard, for example /dev/ttyTHS1")
              .input()
              .required());
    visit(
        self.robot_file,
        JobField(
            "robot_file NAME",
            "Body and camera of the robot: a name that `waymark robots` lists, or the path of a .yaml file"));
    visit(self.drive, JobField("drive NAME",
                               "Drive of LIMO: differential, ackermann, mecanum (set on LIMO) or tracked. "
                               "Default: the drive of the robot file"));
    visit(self.options.beside,
          JobField("beside FIFO",
                   "Named pipe with additional lines of a robot process, stamped by this computer's steady "
                   "clock: a lidar, a camera with its own detector"));
    visit(self.options.simulated,
          JobField("simulated", "The LIMO is simulated and needs no first drive (`waymark commission`)"));
    visit(self.listen_only, JobField("listen_only", kListenOnlyHelp));
  }
};

/// The drive according to a robot file: Ackermann or Differential.
[[nodiscard]] LimoDrive drive_of(const RobotDescription& robot);

/// Runs the process for a LIMO (docs/formats/robot-process.md): keeps its serial port open and sends commands
/// 25 times a second until the input ends. Sends zero if commands cease, and at the end. Writes the hello
/// once LIMO sends data and accepts commands. Fails if the port cannot be opened or is disconnected, or if
/// LIMO does not answer or accept commands. Also fails if its drive differs from the robot file.
[[nodiscard]] Status run_limo_robot(const RobotDescription& robot, const LimoRobotOptions& options,
                                    const RobotWire& wire);

}  // namespace waymark
