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

/// A simulated robot with the protocol of a real one (`waymark robot-sim`).
namespace waymark {

/// The protocol of a simulated robot: lines of a robot process on standard input and output, ROS 2, LIMO's
/// serial port, an MBot's LCM, or the topics of Gazebo.
using SimWire =
    std::variant<ProcessSimOptions, Ros2SimOptions, LimoSimOptions, MbotSimOptions, GazeboSimOptions>;

/// Adapts the simulated robot to the real one on this wire. Fails if the setup lacks data that the wire
/// needs.
[[nodiscard]] Status fit_to_wire(const SimWire& wire, SimulatedSetup& setup);

/// The command in "process:CMD"; nothing for another text.
[[nodiscard]] std::optional<RobotCommand> plant_command(const std::string& word);

/// The plant behind the wire: the program of the setup's process or, without a process, a simulated robot at
/// the start of the world's path. The program must send the lines that the wire needs; its texts become
/// notes.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_plant(const SimWire& wire, const RobotSetup& setup,
                                                        const JobControl& control);

/// Runs the plant until the control cancels, or the standard input of a robot process ends. `on_port` gets
/// the path of the terminal at the end of LIMO's wire.
[[nodiscard]] Status run_robot_sim(const SimWire& wire, Plant& plant, const SimulatedSetup& setup,
                                   const std::function<void(const std::string&)>& on_port,
                                   const JobControl& control);

}  // namespace waymark
