// A custom robot repeats the route of a map: waymark_own_robot MAP_FOLDER. Here the robot is one line of
// kinematics that observes the map tags; a real one sends the command to its motors and reads its sensors.
#include <cstdio>

#include "waymark/app/common/replay_setup.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/runtime/replay_session.hpp"
#include "waymark/runtime/step_robot.hpp"
#include "waymark/samples/visibility.hpp"

using namespace waymark;

int fail(const Error& error) { return std::fprintf(stderr, "%s\n", to_string(error).c_str()), 1; }

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: waymark_own_robot MAP_FOLDER\n"), 2;
  // [quoted by docs/howto/cpp.md]
  const auto folder = read_map_folder(argv[1]);
  if (!folder) return fail(folder.error());
  SE2 map_T_base = folder->route.points.front().map_T_base;
  StepRobot robot([&](const VelocityCommand& command, SensorTime now) -> Result<std::vector<Sample>> {
    map_T_base = map_T_base * SE2::exp({0.05 * command.speed_m_s, 0, 0.05 * command.yaw_rate_rad_s});
    TagFrame frame{.stamp = now};
    const SE3 cam_T_map = (lift(map_T_base) * folder->robot->model.base_T_cam).inverse();
    for (const auto& [id, tag] : folder->map.tags.tags)
      if (const auto px = visible_corners(folder->robot->camera, cam_T_map * tag.map_T_tag, tag.size_m))
        frame.detections.push_back({.tag = id, .corners_px = *px});
    return std::vector<Sample>{Odometry{now, map_T_base, command.speed_m_s, command.yaw_rate_rad_s}, frame};
  });
  const auto replayer = make_replayer(*folder);
  if (!replayer) return fail(replayer.error());
  ReplaySession session(**replayer, {});
  const auto driven = RobotLoop(robot, robot, robot.pacing()).drive(session.listener());
  if (!driven) return fail(driven.error());
  const ReplayEnd end = session.end(*driven);
  std::printf("%s, %.2f m of the route\n", end.finished ? "done" : end.reason.c_str(), end.driven_m);
  return end.finished ? 0 : 1;
  // [end]
}
