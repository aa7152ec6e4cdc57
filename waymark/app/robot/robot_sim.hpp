#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/robot/gazebo_robot_sim.hpp"
#include "waymark/app/robot/limo_robot_sim.hpp"
#include "waymark/app/robot/mbot_robot_sim.hpp"
#include "waymark/app/robot/process_robot_sim.hpp"
#include "waymark/app/robot/ros2_robot_sim.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

/// A simulated robot that uses the protocol of a real one (`waymark robot-sim`).
namespace waymark {

/// The protocol of a simulated robot: lines of a robot process on standard input and output, ROS 2, LIMO's
/// serial port, an MBot's LCM, or Gazebo topics.
using SimWire =
    std::variant<ProcessSimOptions, Ros2SimOptions, LimoSimOptions, MbotSimOptions, GazeboSimOptions>;

/// Adapts the simulated robot to the real one that uses this wire. Fails if the setup lacks data that the
/// wire requires.
[[nodiscard]] Status fit_to_wire(const SimWire& wire, SimulatedSetup& setup);

/// Returns the command in "process:CMD"; `nullopt` for any other text.
[[nodiscard]] std::optional<RobotCommand> plant_command(const std::string& word);

/// Creates the plant behind the wire: the program of the setup's process or, if there is no process, a
/// simulated robot at the start of the path in the world. The program must send the lines that the wire
/// requires; its texts are printed as notes.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_plant(const SimWire& wire, const RobotSetup& setup,
                                                        const JobControl& control);

/// Runs the plant until the control cancels or, for a robot process, standard input ends. `on_port` is called
/// with the path of the terminal at the end of LIMO's wire.
[[nodiscard]] Status run_robot_sim(const SimWire& wire, Plant& plant, const SimulatedSetup& setup,
                                   const std::function<void(const std::string&)>& on_port,
                                   const JobControl& control);

}  // namespace waymark
