// Rendering time of an image of the circuit, with and without motion: 640 x 480, the camera of a LIMO on its
// line.
#include <cstdint>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/simulation/world/world.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

struct RobotSetup {
  World world;
  RobotDescription robot;
  std::vector<PathPoint> path;

  RobotSetup()
      : world(read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value()),
        robot(read_robot(WAYMARK_SHARE "/robots/limo.yaml").value()),
        path(sample_path(world.path_m, world.path_closed, 0.25)) {}

  /// From position `i` of the line, driving along it at the given speed.
  [[nodiscard]] CameraMotion motion(std::size_t i, double speed_m_s) const {
    const PathPoint& point = path[i % path.size()];
    const SE3 base_T_cam = robot.model.base_T_cam;
    return [=](double t) {
      const SE2 step = SE2::exp({speed_m_s * t, 0, speed_m_s * t * point.curvature_1_m});
      return lift(point.map_T_path * step) * base_T_cam;
    };
  }
};

const RobotSetup& setup() {
  static const RobotSetup kSetup;
  return kSetup;
}

SceneCamera camera(double exposure_ms, double readout_ms, bool noise) {
  SceneCameraOptions options;
  options.exposure_ms = exposure_ms;
  options.readout_ms = readout_ms;
  if (!noise) options.full_well_electrons = 0;
  return SceneCamera::make(scene_of(setup().world), setup().robot.camera, options).value();
}

void render(benchmark::State& state, double exposure_ms, double readout_ms, bool noise, bool detect) {
  const SceneCamera takes = camera(exposure_ms, readout_ms, noise);
  DetectorOptions detector_options;
  const auto detector = make_apriltag_detector(detector_options).value();
  std::size_t i = 0;
  double tags = 0;
  double found = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto frame = takes.render(setup().motion(i, 0.3), SensorTime(), i).value();
    benchmark::DoNotOptimize(frame.image.row(0));
    if (detect) found += static_cast<double>(detector->detect(frame.image)->size());
    tags += static_cast<double>(frame.tags.size());
    ++i;
  }
  state.counters["tags"] = benchmark::Counter(tags, benchmark::Counter::kAvgIterations);
  if (detect) state.counters["found"] = benchmark::Counter(found, benchmark::Counter::kAvgIterations);
}

/// The exact photograph of the same tags, without motion.
void photograph_tags(benchmark::State& state) {
  const CameraModel& camera = setup().robot.camera;
  Random random(1);
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    PhotographScene scene;
    const SE3 cam_T_map = setup().motion(i++, 0)(0).inverse();
    for (const auto& [id, tag] : setup().world.tags.tags) {
      const SE3 cam_T_tag = cam_T_map * tag.map_T_tag;
      if (visible_corners(camera, cam_T_tag, tag.size_m)) scene.tags.push_back({id, cam_T_tag, tag.size_m});
    }
    benchmark::DoNotOptimize(photograph(camera, scene, {}, random));
  }
}

const bool kRegistered = [] {
  const auto add = [](const char* name, double exposure_ms, double readout_ms, bool noise, bool detect) {
    benchmark::RegisterBenchmark(name, render, exposure_ms, readout_ms, noise, detect)
        ->Unit(benchmark::kMillisecond);
  };
  add("image/ours/still, no noise", 0, 0, false, false);
  benchmark::RegisterBenchmark("image/peer:photograph/still", photograph_tags)->Unit(benchmark::kMillisecond);
  add("image/ours/still", 0, 0, true, false);
  add("image/ours/10 ms exposure", 10, 0, true, false);
  add("image/ours/10 ms exposure, 20 ms readout", 10, 20, true, false);
  add("image/ours/10 ms exposure, and detect", 10, 0, true, true);
  return true;
}();

}  // namespace
}  // namespace waymark
