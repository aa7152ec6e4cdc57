// Simulated seconds per second of one core, without images: simulation/lap drives, senses and detects;
// simulation/taught also teaches (poses of all tags) and records.
#include <benchmark/benchmark.h>

#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/pipeline/teacher.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {
namespace {

SimulatedSetup setup() {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  return {.world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value(),
          .model = robot.model,
          .camera = robot.camera,
          .robot = robot.simulation};
}

/// A file that discards its data.
class NoFile final : public ByteSink {
 public:
  Status write(ByteSpan) override { return {}; }
  Status sync() override { return {}; }
};

void lap(benchmark::State& state) {
  const SimulatedSetup circuit = setup();
  double simulated_s = 0;
  for (auto _ : state) simulated_s += drive_scripted_lap(circuit, {}, {})->lap_s;
  state.counters["times_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}
BENCHMARK(lap)->Name("simulation/lap")->Unit(benchmark::kMillisecond);

void taught(benchmark::State& state) {
  const SimulatedSetup circuit = setup();
  const World& world = circuit.world;
  double simulated_s = 0;
  for (auto _ : state) {
    Teacher teacher({.camera = circuit.camera,
                     .base_T_cam = circuit.model.base_T_cam,
                     .sizes = {.default_size_m = 0.16},
                     .anchor = world.anchor,
                     .map_T_anchor = world.tags.find(world.anchor)->map_T_tag});
    SampleRecorder recorder = SampleRecorder::open(std::make_unique<NoFile>()).value();
    LapListener listener;
    listener.on_sample = [&](const Sample& sample) {
      if (const auto* frame = std::get_if<TagFrame>(&sample)) teacher.watch(*frame);
      if (const auto* odometry = std::get_if<Odometry>(&sample)) teacher.add(*odometry);
      return recorder.add(sample);
    };
    simulated_s += drive_scripted_lap(circuit, {}, listener)->lap_s;
    benchmark::DoNotOptimize(recorder.close());
  }
  state.counters["times_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
}
BENCHMARK(taught)->Name("simulation/taught")->Unit(benchmark::kMillisecond);

/// A lap with images: 640 x 480 at 15 Hz with distortion, 10 ms of exposure, blur and noise, rendered,
/// searched for tags and recorded.
void images(benchmark::State& state) {
  SimulatedSetup circuit = setup();
  circuit.images = DetectingCameraOptions{};
  circuit.threads = static_cast<int>(state.range(0));
  double simulated_s = 0;
  double frames = 0;
  for (auto _ : state) {
    SampleRecorder recorder = SampleRecorder::open(std::make_unique<NoFile>()).value();
    LapListener listener;
    listener.on_sample = [&](const Sample& sample) { return recorder.add(sample); };
    listener.on_image = [&](const SeenImage&) -> Status {
      frames += 1;
      return {};
    };
    simulated_s += drive_scripted_lap(circuit, {}, listener)->lap_s;
  }
  state.counters["times_real_time"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["frames"] = frames / static_cast<double>(state.iterations());
}
BENCHMARK(images)
    ->Name("simulation/images")
    ->Arg(1)
    ->Arg(2)
    ->Iterations(1)
    ->MeasureProcessCPUTime()
    ->UseRealTime()
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace waymark
