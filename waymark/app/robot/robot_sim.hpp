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

/// A simulated robot that speaks as a real one does (`waymark robot-sim`).
namespace waymark {

/// What a simulated robot speaks: lines of a robot process on standard input and output, ROS 2, LIMO's serial
/// port, an MBot's LCM, or the topics of Gazebo.
using SimWire =
    std::variant<ProcessSimOptions, Ros2SimOptions, LimoSimOptions, MbotSimOptions, GazeboSimOptions>;

/// Gives the robot of the simulator what the real one on this wire has. Fails where the setup does not have
/// what the wire carries.
[[nodiscard]] Status fit_to_wire(const SimWire& wire, SimulatedSetup& setup);

/// The program behind the wire, named as "process:CMD"; nothing where it is not.
[[nodiscard]] std::optional<RobotCommand> plant_command(const std::string& word);

/// The sensors and motors behind the wire: the program of the setup's process, which must send what the wire
/// carries and whose words are notes; without one a robot of the simulator, where the world's line begins.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_plant(const SimWire& wire, const RobotSetup& setup,
                                                        const JobControl& control);

/// Speaks for the plant until the control cancels it, or the standard input of a robot process ends.
/// `on_port` is given the path of the terminal that LIMO's wire ends at.
[[nodiscard]] Status run_robot_sim(const SimWire& wire, Plant& plant, const SimulatedSetup& setup,
                                   const std::function<void(const std::string&)>& on_port,
                                   const JobControl& control);

}  // namespace waymark
