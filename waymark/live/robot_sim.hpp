#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/drivers/dds/bus.hpp"
#include "waymark/drivers/watchdog/robot_command.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/live/limo_robot_sim.hpp"
#include "waymark/live/mbot_robot_sim.hpp"
#include "waymark/live/robot_setup.hpp"
#include "waymark/live/simulated_process.hpp"

/// A simulated robot that speaks as a real one does (`waymark robot-sim`).
namespace waymark {

enum class SimWire : std::uint8_t {
  Process,  ///< JSON lines on standard input and output
  Ros2,
  Limo,    ///< a serial port
  Mbot,    ///< LCM
  Gazebo,  ///< topics of Gazebo
};

struct RobotSimJob {
  SimWire wire = SimWire::Process;
  SimulatedProcessOptions process{};
  BusOptions ros2{};
  LimoSimOptions limo{};
  std::string mbot_address{};
  MbotGeneration mbot_generation = MbotGeneration::Jetson;
  std::string gazebo_profile{};  ///< a name, or the path of a .yaml file
};

/// Gives the robot of the simulator what the real one on this wire has. Fails where the setup does not have
/// what the wire carries.
[[nodiscard]] Status fit_to_wire(SimWire wire, SimulatedSetup& setup);

/// The program behind the wire, named as "process:CMD"; nothing where it is not.
[[nodiscard]] std::optional<RobotCommand> plant_command(const std::string& word);

/// The sensors and motors behind the wire: the program of the setup's process, which must send what the wire
/// carries and whose words are notes; without one a robot of the simulator, where the world's line begins.
[[nodiscard]] Result<std::unique_ptr<Plant>> make_plant(SimWire wire, const RobotSetup& setup,
                                                        const JobControl& control);

/// Speaks for the plant until the control cancels it, or standard input ends (Process). `on_port` is given
/// the path of the terminal that LIMO's wire ends at.
[[nodiscard]] Status run_robot_sim(const RobotSimJob& job, Plant& plant, const SimulatedSetup& setup,
                                   const std::function<void(const std::string&)>& on_port,
                                   const JobControl& control);

}  // namespace waymark
