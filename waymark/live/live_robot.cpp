#include "waymark/live/live_robot.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/base/printable.hpp"

namespace waymark {
namespace {

Pacing pacing_of(const ProcessRobot& robot) {
  if (!robot.hello().lockstep) return real_time();
  return lockstep_time([&robot] {
    const auto now = robot.now();
    return now ? now->time_since_epoch() : Duration(0);
  });
}

}  // namespace

LiveRobot::LiveRobot(std::unique_ptr<ProcessRobot> robot, TagFinder finder,
                     std::vector<MountedCamera> cameras, JobControl control)
    : robot_(std::move(robot)),
      finder_(std::move(finder)),
      loop_(*robot_, *robot_, pacing_of(*robot_), {.finder = &finder_, .cameras = std::move(cameras)}),
      control_(std::move(control)) {}

Result<std::unique_ptr<LiveRobot>> LiveRobot::open(const RobotCommand& command,
                                                   std::vector<MountedCamera> cameras, JobControl control) {
  auto finder = make_tag_finder();
  if (!finder) return tl::unexpected(finder.error());
  ProcessRobotOptions options;
  for (const MountedCamera& camera : cameras) options.cameras.push_back(camera.name);
  options.should_stop = control.cancelled;
  options.on_waiting = control.note;
  auto robot = ProcessRobot::start(command, options);
  if (!robot) return tl::unexpected(robot.error());
  return std::unique_ptr<LiveRobot>(
      new LiveRobot(std::move(*robot), std::move(*finder), std::move(cameras), std::move(control)));
}

Result<RobotLoopEnd> LiveRobot::drive(RobotListener listener) {
  listener.on_text = [this](const std::string& text) { control_.note("robot: " + printable(text)); };
  auto end = loop_.drive(listener);
  if (loop_.dropped_pictures() > 0)
    control_.note(
        fmt::format("{} pictures came faster than tags could be looked for in them, and were passed over",
                    loop_.dropped_pictures()));
  return end;
}

}  // namespace waymark
