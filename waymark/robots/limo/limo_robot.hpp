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
  std::string
      beside{};  ///< a named pipe with further lines of a robot process, on this machine's steady clock
  bool simulated = false;  ///< no LIMO is at the other end: the hello says so
};

/// What a user says of LIMO's process.
struct LimoRobotWords {
  LimoRobotOptions options{};  ///< but the drive
  std::string robot_file = "limo";
  std::string drive{};  ///< as parse_limo_drive() has it; empty: as the robot's file says
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
                               "Unless given: as the robot's file says"));
    visit(self.options.beside,
          JobField("beside FIFO",
                   "Named pipe with further lines of a robot process, stamped by this machine's steady "
                   "clock: a lidar, a camera with a detector of its own"));
    visit(self.options.simulated,
          JobField("simulated",
                   "A simulated LIMO is at the other end: it needs no first drive (`waymark commission`)"));
    visit(self.listen_only, JobField("listen_only", kListenOnlyHelp));
  }
};

/// The drive that a robot's file describes: Ackermann or Differential.
[[nodiscard]] LimoDrive drive_of(const RobotDescription& robot);

/// Is the process of a LIMO (docs/formats/robot-process.md): holds its serial port, sends its commands 25
/// times a second, zero when they cease and at the end, until the input ends. The hello comes when LIMO is
/// heard and obeys. Fails when the port cannot be opened or is cut, when LIMO does not answer or obey, and
/// when its wheels are not latched as its file says.
[[nodiscard]] Status run_limo_robot(const RobotDescription& robot, const LimoRobotOptions& options,
                                    const RobotWire& wire);

}  // namespace waymark
