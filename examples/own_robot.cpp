// A robot of one's own replays a route: waymark_own_robot MAP_FOLDER. Here the robot is five lines of
// kinematics that sees the tags of the map; a real one reads its encoders and its camera instead (with
// pictures, pass a Detector to RobotLoop).
#include <cstdio>
#include <deque>
#include <string>

#include "waymark/config/map_file.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/robot_loop.hpp"
#include "waymark/samples/visibility.hpp"

using namespace waymark;

// [quoted by docs/howto/own-robot.md]
struct MyRobot final : Source, Robot {
  const TagMap& map;
  CameraModel camera;
  SE3 base_T_cam;
  SE2 map_T_base, start = map_T_base;
  VelocityCommand command_{};
  Duration clock{};
  std::deque<RobotEvent> events{};

  MyRobot(const TagMap& tags, CameraModel lens, const SE3& mounting, const SE2& at)
      : map(tags), camera(std::move(lens)), base_T_cam(mounting), map_T_base(at) {}

  Status command(const VelocityCommand& command) override {  // to the motors
    command_ = command;
    return {};
  }
  Result<std::optional<RobotEvent>> next(Duration) override {  // from the sensors
    if (events.empty()) move();
    RobotEvent event = std::move(events.front());
    events.pop_front();
    return event;
  }
  bool more() const override { return true; }
  std::optional<SensorTime> now() const override { return SensorTime(clock); }

  void move() {
    constexpr double dt_s = 0.05;
    clock += std::chrono::milliseconds(50);
    map_T_base = map_T_base * SE2::exp({dt_s * command_.speed_m_s, 0, dt_s * command_.yaw_rate_rad_s});
    TagFrame frame{.stamp = SensorTime(clock)};
    const SE3 map_T_cam = lift(map_T_base) * base_T_cam;
    for (const auto& [id, tag] : map.tags)
      if (const auto corners = visible_corners(camera, map_T_cam.inverse() * tag.map_T_tag, tag.size_m))
        frame.detections.push_back(TagDetection{.tag = id, .corners_px = *corners});
    events = {Sample(Odometry{SensorTime(clock), start.inverse() * map_T_base, command_.speed_m_s,
                              command_.yaw_rate_rad_s}),
              Sample(frame), CommandRequest{SensorTime(clock)}};
  }
};
// [end]

int fail(const Error& error) {
  std::fprintf(stderr, "%s\n", to_string(error).c_str());
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: waymark_own_robot MAP_FOLDER\n"), 2;
  const std::string folder = argv[1];
  const auto map = read_map(folder + "/map.yaml");
  if (!map) return fail(map.error());
  const auto route = read_route(folder + "/route.yaml");
  if (!route) return fail(route.error());
  const auto robot = read_robot(folder + "/robot.yaml");
  if (!robot) return fail(robot.error());
  // [quoted by docs/howto/own-robot.md, drive]
  MyRobot mine(map->tags, robot->camera, robot->model.base_T_cam, route->points.front().map_T_base);
  auto method = make_localization_method(
      {.landmarks = Landmarks(map->tags), .tags = map->tags, .eye = {mine.camera, mine.base_T_cam}});
  if (!method) return fail(method.error());
  Replayer replayer(std::move(*method), *route, map->tags, robot->model, {});
  ReplaySession session(replayer, {});
  RobotLoop loop(mine, mine, lockstep_time([&] { return mine.clock; }));
  const auto driven = loop.drive(session.listener());
  if (!driven) return fail(driven.error());
  const ReplayEnd end = session.end(*driven);
  std::printf("%s, %.2f m of the route\n", end.finished ? "done" : end.reason.c_str(), end.driven_m);
  return end.finished ? 0 : 1;
  // [end]
}
