#include "waymark/app/live/live_robot.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <variant>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/shell_word.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

std::optional<std::string> lacks_commission(const RobotSetup& setup, const RobotHello& hello) {
  if (!hello.is_real()) return std::nullopt;
  std::string why = "contains no record of a first drive";
  if (setup.commissioned) {
    const auto changes = changes_since(*setup.commissioned, setup.simulated.model, setup.ground);
    if (setup.commissioned->passed && changes.empty()) return std::nullopt;
    why = !setup.commissioned->passed
              ? fmt::format("records a first drive that failed ({})",
                            fmt::join(setup.commissioned->failed, ", "))
              : fmt::format("records a first drive that is no longer valid: {}", fmt::join(changes, "; "));
  }
  return fmt::format(
      "the robot file {} {}. The speed is limited to {:g} m/s until the robot has passed a first drive: "
      "`waymark commission robot={} robot_file={}`",
      setup.robot_path, printable(why), kUncommissionedSpeed_m_s, shell_word(setup.ground.robot),
      shell_word(setup.robot_path));
}

VelocityCommand slowed(const VelocityCommand& command, double max_speed_m_s, const MotionLimits& limits) {
  double scale = 1;
  const auto bound = [&scale](double value, double limit) {
    if (std::abs(value) > limit) scale = std::min(scale, limit / std::abs(value));
  };
  bound(command.speed_m_s, std::min(max_speed_m_s, limits.speed_m_s));
  bound(command.yaw_rate_rad_s, limits.yaw_rate_rad_s);
  return {scale * command.speed_m_s, scale * command.yaw_rate_rad_s};
}

namespace {

constexpr Duration kRobotSlice = std::chrono::milliseconds(2);  // longest delay of an image caused by waiting
                                                                // for the robot
constexpr Duration kMaxImageAge = std::chrono::seconds(1);      // the limit that also applies to messages
                                                                // (StampGate)

}  // namespace

bool RobotWithCameras::more() const {
  return robot_.more() || std::ranges::any_of(cameras_, [](const auto& camera) { return camera->more(); });
}

/// Keeps the timestamps of each camera increasing, even if the estimated offset of the robot's clock
/// decreases.
bool RobotWithCameras::move_to_robots_clock(CameraFrame& frame) {
  const auto now = robot_.now();
  const Duration age = steady_now() - frame.stamp.time_since_epoch();
  if (!now || age > kMaxImageAge) return false;
  SensorTime& newest = newest_[frame.camera];
  newest = frame.stamp = std::max(*now - age, newest + Duration(1));
  return true;
}

bool RobotWithCameras::replaced(const RobotEvent& event) const {
  const auto* sample = std::get_if<Sample>(&event);
  const auto* corners = sample != nullptr ? std::get_if<TagFrame>(sample) : nullptr;
  const auto* poses = sample != nullptr ? std::get_if<TagPoseFrame>(sample) : nullptr;
  return (corners != nullptr && names_.contains(corners->camera)) ||
         (poses != nullptr && names_.contains(poses->camera));
}

Result<std::optional<RobotEvent>> RobotWithCameras::next_of_cameras() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    turn_ = (turn_ + 1) % cameras_.size();
    if (!cameras_[turn_]->more()) continue;
    auto event = cameras_[turn_]->next(Duration(0));
    if (!event || !*event) {
      if (!event) return event;
      continue;
    }
    auto* sample = std::get_if<Sample>(&**event);
    auto* frame = sample != nullptr ? std::get_if<CameraFrame>(sample) : nullptr;
    if (frame == nullptr || move_to_robots_clock(*frame)) return event;
  }
  return std::optional<RobotEvent>();
}

Result<std::optional<RobotEvent>> RobotWithCameras::receive_from_robot(Duration most) {
  auto event = robot_.next(most);
  if (event && *event && replaced(**event)) event = std::optional<RobotEvent>();
  return event;
}

Result<std::optional<RobotEvent>> RobotWithCameras::next(Duration most) {
  const Duration deadline = steady_now() + most;
  // Poll the robot first. If detection takes longer than the frame period, a camera always has an image ready
  // and would starve the robot.
  auto event = receive_from_robot(Duration(0));
  while (event && !*event) {
    if (!robot_.more()) event = next_of_cameras();
    if (!event || *event || steady_now() >= deadline) break;
    event = receive_from_robot(std::min(kRobotSlice, std::max(Duration(0), deadline - steady_now())));
  }
  return event;
}

namespace {

Pacing pacing_of(const ProcessRobot& robot) {
  if (!robot.hello().lockstep) return real_time();
  return lockstep_time([&robot] {
    const auto now = robot.now();
    return now ? now->time_since_epoch() : Duration(0);
  });
}

/// Fails if the robot runs in lockstep, because cameras on this computer cannot follow its simulated time.
Result<std::vector<std::unique_ptr<LiveCamera>>> open_cameras(const RobotSetup& setup,
                                                              const ProcessRobot& robot) {
  std::vector<std::unique_ptr<LiveCamera>> cameras;
  for (const CameraAddress& live : setup.live_cameras) {
    if (robot.hello().lockstep)
      return fail(ErrorCode::InvalidArgument, "a live camera cannot be used with a robot in lockstep",
                  {.source = live.address}, "Run the robot in real time.");
    auto camera = open_live_camera(live.address, live.name);
    if (!camera) return tl::unexpected(camera.error());
    cameras.push_back(std::move(*camera));
  }
  return cameras;
}

/// Fails if the robot runs in lockstep, because it would wait forever for a command.
Status check_listening(const RobotSetup& setup, const ProcessRobot& robot) {
  if (!setup.process.listen_only || !robot.hello().lockstep) return {};
  return fail(ErrorCode::InvalidArgument,
              "cannot listen to a robot in lockstep, because it waits for commands and none are sent",
              {.source = "process:" + setup.process.text()}, "Run the robot in real time.");
}

/// The families of the tags in the world and of the anchor.
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
  auto finder = make_tag_finder({.detector = setup.image_settings.detector,
                                 .families = families_in(setup.simulated.world),
                                 .known_tags = setup.known_tags});
  if (!finder) return tl::unexpected(finder.error());
  finder->tracking.whole_every = setup.image_settings.search_every;
  finder->tracking.in_strips = setup.image_settings.in_strips;
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
  if (loop_.dropped_images() > 0)
    control_.note(fmt::format("{} skipped: they arrived faster than tags could be detected",
                              counted(loop_.dropped_images(), "image")));
  const bool followed = finder_.tracking.whole_every != 1 || finder_.tracking.in_strips;
  if (followed && !loop_.searched())
    control_.note("`search_every` and `search_strips` had no effect: the robot sent no images");
  return end;
}

}  // namespace waymark
