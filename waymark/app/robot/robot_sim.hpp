#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/app/robot/limo_robot_sim.hpp"
#include "waymark/app/robot/mbot_robot_sim.hpp"
#include "waymark/app/robot/process_robot_sim.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

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

/// What a user says of a simulated robot and of its wire.
struct RobotSimWords {
  RobotSimJob job{};  ///< but for wire, network and generation
  bool limo = false;
  bool ros2 = false;
  std::string mbot_generation = "jetson";  ///< or pi5
  std::string plant{};                     ///< as plant_command() has it; empty: a robot of the simulator

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.limo, JobField("limo",
                              "Be a LIMO on a serial port, in real time, until Ctrl-C: a pseudo-terminal, "
                              "whose path is printed"));
    visit(self.job.limo.beside, JobField("beside FIFO",
                                         "Named pipe for what is not on LIMO's wire: camera, lidar, truth, "
                                         "as lines for `waymark limo robot --beside`")
                                    .needs("limo"));
    visit(self.job.limo.faults.noise,
          JobField("wire_noise FLOAT", "Probability of each byte of LIMO's wire to become another one", 0.0,
                   1.0)
              .needs("limo")
              .usually("0")
              .less());
    visit(self.job.limo.faults.dropped,
          JobField("wire_dropped FLOAT", "Probability of each byte of LIMO's wire to be lost", 0.0, 1.0)
              .needs("limo")
              .usually("0")
              .less());
    visit(self.job.limo.faults.torn,
          JobField("wire_torn FLOAT", "Probability of each frame of LIMO's wire to lose its end", 0.0, 1.0)
              .needs("limo")
              .usually("0")
              .less());
    visit(
        self.job.mbot_address,
        JobField(
            "mbot ADDRESS",
            "Be an MBot on LCM at this address, in real time, until Ctrl-C: udpm://239.255.76.67:7667?ttl=0")
            .excludes("limo"));
    visit(self.mbot_generation,
          JobField(
              "mbot_generation NAME",
              "Publisher of tags of the MBot: jetson (quaternions x, y, z, w) or pi5 (w, x, y, z; no stamps)")
              .one_of("jetson,pi5")
              .needs("mbot")
              .less());
    visit(self.job.gazebo_profile,
          JobField("gazebo PROFILE",
                   "Publish the topics of Gazebo that this profile names, as Gazebo's robot does, and obey "
                   "its command topic, until Ctrl-C: limo, or the path of a .yaml file")
              .excludes("limo,mbot"));
    visit(
        self.plant,
        JobField("plant ROBOT",
                 "Simulation behind the wire instead of Waymark's: process:CMD, a program that speaks the "
                 "protocol of robot processes. World and robot file say which camera, wheels and tags it has")
            .less());
    visit(self.job.process.lockstep, JobField("lockstep",
                                              "Lockstep: simulated time advances with each answer, as fast "
                                              "as the machine allows and with the same samples every time")
                                         .excludes("limo,mbot,gazebo"));
    visit(self.ros2,
          JobField("ros2",
                   "Publish topics of ROS 2 as LIMO does, and obey /cmd_vel, in real time; until Ctrl-C")
              .excludes("lockstep,limo,mbot,gazebo"));
    visit(
        self.job.process.pace,
        JobField(
            "pace FLOAT",
            "Maximum real-time factor with --lockstep: simulated seconds per second; 0: as fast as possible",
            0.0, 100.0)
            .usually("0"));
  }
};
/// The wire that is asked for.
[[nodiscard]] SimWire wire_of(const RobotSimWords& request);

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
