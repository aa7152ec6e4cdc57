#include "waymark/app/robot/plant.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/process/process_robot.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"

namespace waymark {
namespace {

constexpr Duration kMaxDelay = std::chrono::milliseconds(100);
constexpr Duration kNotePeriod = std::chrono::seconds(10);

}  // namespace

PlantPace::PlantPace(std::function<Duration()> clock, Duration uptime,
                     std::function<void(const std::string&)> note)
    : clock_(std::move(clock)), note_(std::move(note)), began_(clock_() - uptime), next_note_(clock_()) {}

Duration PlantPace::ahead(Duration uptime) const { return std::max(Duration(0), began_ + uptime - clock_()); }

void PlantPace::leave_out(Duration uptime) {
  const Duration now = clock_();
  const Duration lost = now - uptime - began_ - kMaxDelay;
  if (lost > Duration(0)) {
    began_ += lost;
    left_out_ += lost;
  }
  constexpr Duration kMinNoted = std::chrono::milliseconds(50);
  if (left_out_ - noted_ < kMinNoted || now < next_note_) return;
  note_(fmt::format("this computer is too slow or was suspended: simulated time was paused for {:.2f} s",
                    to_seconds(left_out_ - std::exchange(noted_, left_out_))));
  next_note_ = now + kNotePeriod;
}

namespace {

class SimulatedPlant final : public Plant {
 public:
  SimulatedPlant(const SimulatedSetup& setup, const SE2& map_T_base,
                 std::unique_ptr<DetectingCamera> scene_camera)
      : robot_(setup.world, setup.model, setup.cameras(), map_T_base, setup.robot,
               scene_camera != nullptr ? CameraOutput::Shots : CameraOutput::Corners),
        scene_camera_(std::move(scene_camera)) {}

  Result<Sample> next() override {
    Sample sample = robot_.next();
    if (auto* frame = std::get_if<CameraFrame>(&sample)) {
      auto taken = scene_camera_->take(robot_.shot());
      if (!taken) return tl::unexpected(taken.error());
      frame->image = std::move(taken->image);
    }
    return sample;
  }
  Status command(const VelocityCommand& command) override { return robot_.command(command); }
  [[nodiscard]] SensorTime now() const override { return robot_.now(); }
  [[nodiscard]] Duration uptime() const override { return robot_.uptime(); }

 private:
  SimulatedRobot robot_;
  std::unique_ptr<DetectingCamera> scene_camera_;
};

}  // namespace

Result<std::unique_ptr<Plant>> make_simulated_plant(const SimulatedSetup& setup, const SE2& map_T_base) {
  std::unique_ptr<DetectingCamera> scene_camera;
  if (setup.images) {
    auto made =
        DetectingCamera::make(std::make_shared<const World>(setup.world), setup.cameras(), *setup.images);
    if (!made) return tl::unexpected(made.error());
    scene_camera = std::move(*made);
  }
  return std::make_unique<SimulatedPlant>(setup, map_T_base, std::move(scene_camera));
}

namespace {

class ProcessPlant final : public Plant {
 public:
  ProcessPlant(std::unique_ptr<ProcessRobot> process, const ProcessPlantOptions& options)
      : process_(std::move(process)), options_(options) {}

  Result<Sample> next() override {
    constexpr Duration kSlice = std::chrono::milliseconds(100);
    while (!options_.should_stop()) {
      auto event = process_->next(kSlice);
      if (!event) return tl::unexpected(event.error());
      if (!*event) continue;
      if (auto* sample = std::get_if<Sample>(&**event)) {
        begin_with(stamp_of(*sample));
        std::visit([this](auto& value) { value.stamp -= *switched_on_; }, *sample);
        newest_ = std::max(newest_, stamp_of(*sample));
        if (!process_->hello().lockstep) (void)process_->command(obeyed());
        return std::move(*sample);
      }
      if (const auto* text = std::get_if<RobotText>(&**event)) options_.on_text(text->text);
      if (const auto* request = std::get_if<CommandRequest>(&**event)) {
        begin_with(request->stamp);
        newest_ = std::max(newest_, SensorTime(request->stamp - *switched_on_));
        if (Status status = process_->command(obeyed()); !status) return tl::unexpected(status.error());
      }
    }
    return fail(ErrorCode::Unreadable, "stopped while waiting for the robot's process");
  }

  Status command(const VelocityCommand& command) override {
    command_ = command;
    commanded_at_ = uptime();
    return {};
  }
  [[nodiscard]] SensorTime now() const override { return newest_; }
  [[nodiscard]] Duration uptime() const override { return newest_.time_since_epoch(); }

 private:
  void begin_with(SensorTime stamp) {
    if (!switched_on_) switched_on_ = stamp.time_since_epoch();
  }
  [[nodiscard]] VelocityCommand obeyed() const {
    return to_seconds(uptime() - commanded_at_) > options_.watchdog_s ? VelocityCommand{} : command_;
  }

  std::unique_ptr<ProcessRobot> process_;
  ProcessPlantOptions options_;
  std::optional<Duration> switched_on_{};  ///< time on the clock of the process
  SensorTime newest_{};                    ///< newest timestamp, relative to switched_on_
  VelocityCommand command_{};
  Duration commanded_at_{};  ///< uptime of the newest command
};

}  // namespace

Result<std::unique_ptr<Plant>> start_process_plant(const RobotCommand& command,
                                                   const ProcessPlantOptions& options) {
  auto process =
      ProcessRobot::start(command, {.should_stop = options.should_stop, .on_waiting = options.on_text});
  if (!process) return tl::unexpected(process.error());
  const std::vector<std::string>& sends = (*process)->hello().sends;
  for (const std::string& type : options.sends)
    if (!sends.empty() && std::ranges::find(sends, type) == sends.end())
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("its hello does not list '{}', which this wire needs, in `sends` ({})", type,
                              fmt::join(sends, ", ")),
                  {.source = "process:" + command.text(), .key = "sends"});
  return std::make_unique<ProcessPlant>(std::move(*process), options);
}

}  // namespace waymark
