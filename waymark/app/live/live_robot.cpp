#include "waymark/app/live/live_robot.hpp"

#include <limits>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/live/commission_limit.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

Pacing pacing_of(const ProcessRobot& robot) {
  if (!robot.hello().lockstep) return real_time();
  return lockstep_time([&robot] {
    const auto now = robot.now();
    return now ? now->time_since_epoch() : Duration(0);
  });
}

/// A robot in lockstep has a time of its own, which no camera of this computer follows.
Result<std::vector<std::unique_ptr<LiveCamera>>> open_cameras(const RobotSetup& setup,
                                                              const ProcessRobot& robot) {
  std::vector<std::unique_ptr<LiveCamera>> cameras;
  for (const CameraAddress& live : setup.live_cameras) {
    if (robot.hello().lockstep)
      return fail(ErrorCode::InvalidArgument,
                  "this robot waits for its commands (lockstep), a camera does not", {.source = live.address},
                  "Run the robot in real time.");
    auto camera = open_live_camera(live.address, live.name);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(std::move(*camera));
  }
  return cameras;
}

/// A robot in lockstep waits for an answer that nobody gives.
Status check_listening(const RobotSetup& setup, const ProcessRobot& robot) {
  if (!setup.process.listen_only || !robot.hello().lockstep) return {};
  return fail(ErrorCode::InvalidArgument,
              "this robot waits for its commands (lockstep), and a listener sends none",
              {.source = "process:" + setup.process.text()}, "Run the robot in real time.");
}

/// Of its tags and its anchor, whichever are known.
std::vector<std::string> families_in(const World& world) {
  std::vector<std::string> families = families_of(world.tags);
  const std::string anchors(to_string(world.anchor.family));
  if (std::ranges::find(families, anchors) == families.end()) families.push_back(anchors);
  return families;
}

}  // namespace

LiveRobot::LiveRobot(std::unique_ptr<ProcessRobot> robot, std::unique_ptr<RobotWithCameras> source,
                     TagFinder finder, std::vector<MountedCamera> cameras, bool listen_only,
                     JobControl control)
    : robot_(std::move(robot)),
      source_(std::move(source)),
      finder_(std::move(finder)),
      loop_(source_ != nullptr ? static_cast<Source&>(*source_) : *robot_, *robot_, pacing_of(*robot_),
            {.finder = &finder_, .cameras = std::move(cameras)}, {.listen_only = listen_only}),
      control_(std::move(control)) {}

Result<std::unique_ptr<LiveRobot>> LiveRobot::open(const RobotSetup& setup, JobControl control) {
  auto robot = open_first(setup, std::move(control));
  if (robot && (*robot)->limited_) (*robot)->control_.note(*(*robot)->limited_);
  return robot;
}

Result<std::unique_ptr<LiveRobot>> LiveRobot::open_first(const RobotSetup& setup, JobControl control) {
  auto finder = make_tag_finder({.detector = setup.pictures.detector,
                                 .families = families_in(setup.simulated.world),
                                 .known_tags = setup.known_tags});
  if (!finder) return tl::unexpected(finder.error());
  finder->tracking.whole_every = setup.pictures.search_every;
  finder->tracking.in_strips = setup.pictures.in_strips;
  std::vector<MountedCamera> cameras = setup.simulated.cameras();
  ProcessRobotOptions options;
  for (const MountedCamera& camera : cameras) options.cameras.push_back(camera.name);
  options.should_stop = control.cancelled;
  options.on_waiting = control.note;
  auto robot = ProcessRobot::start(setup.process, options);
  if (!robot) return tl::unexpected(robot.error());
  if (Status status = check_listening(setup, **robot); !status) return tl::unexpected(status.error());
  auto live = open_cameras(setup, **robot);
  if (!live) return tl::unexpected(live.error());
  std::unique_ptr<RobotWithCameras> source;
  std::set<std::string> names;
  for (const CameraAddress& address : setup.live_cameras) names.insert(address.name);
  if (!live->empty())
    source = std::make_unique<RobotWithCameras>(**robot, std::move(*live), std::move(names));
  const RobotHello hello = (*robot)->hello();
  std::unique_ptr<LiveRobot> opened(new LiveRobot(std::move(*robot), std::move(source), std::move(*finder),
                                                  std::move(cameras), setup.process.listen_only,
                                                  std::move(control)));
  opened->limits_ = setup.simulated.model.limits;
  if (!setup.process.listen_only) opened->limited_ = lacks_commission(setup, hello);
  return opened;
}

double LiveRobot::speed_limit_m_s() const {
  return limited_ ? kUncommissionedSpeed_m_s : std::numeric_limits<double>::infinity();
}

Result<RobotLoopEnd> LiveRobot::drive(RobotListener listener) {
  listener.on_text = [this](const std::string& text) { control_.note("robot: " + printable(text)); };
  listener.decide = [this, decide = std::move(listener.decide), most_m_s = speed_limit_m_s()](
                        Duration uptime, SensorTime now) {
    Result<DriverDecision> decision = decide(uptime, now);
    if (decision) decision->command = slowed(decision->command, most_m_s, limits_);
    return decision;
  };
  auto end = loop_.drive(listener);
  if (loop_.dropped_pictures() > 0)
    control_.note(fmt::format("passed over, as they came faster than tags could be looked for in them: {}",
                              counted(loop_.dropped_pictures(), "picture")));
  const bool followed = finder_.tracking.whole_every != 1 || finder_.tracking.in_strips;
  if (followed && !loop_.searched())
    control_.note("that tags are followed from picture to picture had no effect: the robot sent no pictures");
  return end;
}

}  // namespace waymark
