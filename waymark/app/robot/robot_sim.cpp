#include "waymark/app/robot/robot_sim.hpp"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

Result<std::unique_ptr<Plant>> at_begin_of_line(const SimulatedSetup& setup) {
  constexpr double kStep_m = 0.02;
  const auto path = sample_path(setup.world.path_m, setup.world.path_closed, kStep_m);
  if (path.empty())
    return fail(ErrorCode::InvalidArgument, "the world has no path (path_m), where the robot would start",
                {.source = setup.world.name});
  return make_simulated_plant(setup, path.front().map_T_path);
}

/// The types of lines that the wire needs.
std::vector<std::string> lines_of(const SimWire& wire) {
  if (std::holds_alternative<GazeboSimOptions>(wire)) return {"image"};
  if (std::holds_alternative<MbotSimOptions>(wire)) return {"detections"};
  return {};
}

/// A plant that prints a note on its first command, which shows that a driver is connected.
class ReportingPlant final : public Plant {
 public:
  ReportingPlant(Plant& plant, const JobControl& control) : plant_(plant), control_(control) {}

  Result<Sample> next() override { return plant_.next(); }
  [[nodiscard]] SensorTime now() const override { return plant_.now(); }
  [[nodiscard]] Duration uptime() const override { return plant_.uptime(); }
  Status command(const VelocityCommand& command) override {
    if (!std::exchange(commanded_, true)) control_.note("the first command arrived: a driver is connected");
    return plant_.command(command);
  }
  void finish() override { plant_.finish(); }

 private:
  Plant& plant_;
  const JobControl& control_;
  bool commanded_ = false;
};

/// Runs a plant on each kind of wire.
struct Speaker {
  Plant& plant;
  const SimulatedSetup& setup;
  const std::function<void(const std::string&)>& on_port;
  const JobControl& control;

  Status operator()(const ProcessSimOptions& options) const {
    return run_process_robot_sim(plant, setup, options, control);
  }

  Status operator()(const Ros2SimOptions& options) const {
    const auto bus = open_bus(options.network);
    if (!bus) return tl::unexpected(bus.error());
    return run_ros2_robot_sim(**bus, plant, setup, control);
  }

  Status operator()(const LimoSimOptions& options) const {
    return run_limo_robot_sim(plant, setup, options, on_port, control);
  }

  Status operator()(const MbotSimOptions& options) const {
    if (setup.images)
      return fail(ErrorCode::InvalidArgument, "an MBot sends tag poses over LCM, not images",
                  {.key = "images"}, "Omit `images`.");
    if (Status alone = no_mbot_at(options.address); !alone) return alone;
    const auto link = open_lcm(options.address);
    if (!link) return tl::unexpected(link.error());
    control.note(
        fmt::format("publishing the channels of an MBot on LCM at {0} and obeying MBOT_VEL_CMD, until "
                    "Ctrl-C; waiting for "
                    "a driver (`robot=mbot:{0}`)",
                    options.address));
    return run_mbot_robot_sim(**link, plant, setup, mbot_generation(options.generation), control);
  }

  Status operator()(const GazeboSimOptions& options) const {
    const auto profile = find_gazebo_profile(options.profile);
    if (!profile) return tl::unexpected(profile.error());
    const auto link = open_gazebo();
    if (!link) return tl::unexpected(link.error());
    return run_gazebo_robot_sim(**link, *profile, plant, setup.camera, control);
  }
};

}  // namespace

Status fit_to_wire(const SimWire& wire, SimulatedSetup& setup) {
  if (!std::holds_alternative<GazeboSimOptions>(wire)) return {};
  constexpr double kNever_s = 1e6;  // Gazebo's diff drive keeps the last command forever
  setup.robot.watchdog_s = kNever_s;
  if (setup.images) return {};
  return fail(ErrorCode::InvalidArgument, "Gazebo's topics carry images, not tag corners", {.key = "gazebo"},
              "Add `images`.");
}

std::optional<RobotCommand> plant_command(const std::string& word) {
  constexpr std::string_view kProcess = "process:";
  if (!word.starts_with(kProcess) || word.size() == kProcess.size()) return std::nullopt;
  return RobotCommand(word.substr(kProcess.size()));
}

Result<std::unique_ptr<Plant>> make_plant(const SimWire& wire, const RobotSetup& setup,
                                          const JobControl& control) {
  if (setup.process.empty()) return at_begin_of_line(setup.simulated);
  return start_process_plant(setup.process, {.sends = lines_of(wire),
                                             .watchdog_s = setup.simulated.robot.watchdog_s,
                                             .should_stop = control.cancelled,
                                             .on_text = control.note});
}

Status run_robot_sim(const SimWire& wire, Plant& plant, const SimulatedSetup& setup,
                     const std::function<void(const std::string&)>& on_port, const JobControl& control) {
  if (std::holds_alternative<ProcessSimOptions>(wire))  // the notes are read by its parent process
    return std::visit(Speaker{plant, setup, on_port, control}, wire);
  ReportingPlant reporting(plant, control);
  return std::visit(Speaker{reporting, setup, on_port, control}, wire);
}

}  // namespace waymark
