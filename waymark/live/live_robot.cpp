#include "waymark/live/live_robot.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/base/printable.hpp"
#include "waymark/tags/apriltag_detector.hpp"
#include "waymark/tags/refining_detector.hpp"

namespace waymark {
namespace {

Pacing pacing_of(const ProcessRobot& robot) {
  if (!robot.hello().lockstep) return real_time();
  return lockstep_time([&robot] {
    const auto now = robot.now();
    return now ? now->time_since_epoch() : Duration(0);
  });
}

Result<std::unique_ptr<Detector>> finder_for(const CameraModel& camera) {
  auto detector = make_apriltag_detector({});
  if (!detector) return detector;
  return make_refining_detector(std::move(*detector), {}, camera);
}

}  // namespace

LiveRobot::LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<Detector> finder, LiveWords words)
    : robot_(std::move(robot)),
      finder_(std::move(finder)),
      loop_(*robot_, *robot_, pacing_of(*robot_), finder_.get()),
      words_(std::move(words)) {}

Result<std::unique_ptr<LiveRobot>> LiveRobot::open(const RobotCommand& command, const CameraModel& camera,
                                                   LiveWords words) {
  auto finder = finder_for(camera);
  if (!finder) return tl::unexpected(finder.error());
  auto robot = ProcessRobot::start(command);
  if (!robot) return tl::unexpected(robot.error());
  return std::unique_ptr<LiveRobot>(new LiveRobot(std::move(*robot), std::move(*finder), std::move(words)));
}

Result<RobotLoopEnd> LiveRobot::drive(RobotListener listener) {
  listener.on_text = [this](const std::string& text) { words_.say("robot: " + printable(text)); };
  auto end = loop_.drive(listener);
  if (loop_.dropped_pictures() > 0)
    words_.say(
        fmt::format("{} pictures came faster than tags could be looked for in them, and were passed over",
                    loop_.dropped_pictures()));
  return end;
}

}  // namespace waymark
