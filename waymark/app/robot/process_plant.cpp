#include "waymark/app/robot/process_plant.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/robots/process/process_robot.hpp"

namespace waymark {
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
    return fail(ErrorCode::Unreadable, "stopped while the robot's process was waited for");
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
  std::optional<Duration> switched_on_{};  ///< by the process's clock
  SensorTime newest_{};                    ///< since then
  VelocityCommand command_{};
  Duration commanded_at_{};  ///< by uptime
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
                  fmt::format("its hello names no '{}' among what it sends ({}), which this wire carries",
                              type, fmt::join(sends, ", ")),
                  {.source = "process:" + command.text(), .key = "sends"});
  return std::make_unique<ProcessPlant>(std::move(*process), options);
}

}  // namespace waymark
