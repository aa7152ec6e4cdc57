// Latency from the end of an exposure to the command at the robot, with its parts: a process that simulates a
// robot sends rendered images through the watchdog, and stamps the orders that return. The same program plays
// both roles.
//
// usage: latency_benchmark [IMAGES]
#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/replay/route_builder.hpp"
#include "waymark/robots/process/process_robot.hpp"
#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/robots/simulated/simulated_robot.hpp"
#include "waymark/simulation/world/world.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

constexpr double kSpeed_m_s = 0.4;
constexpr Duration kFramePeriod = std::chrono::microseconds(66'667);
constexpr int kOdometryPerFrame = 3;
constexpr Duration kPause = std::chrono::milliseconds(60);

struct RobotSetup {
  World world;
  RobotDescription robot;
  std::vector<PathPoint> path;  ///< one point per millimetre
};

RobotSetup make_setup() {
  const std::string share = WAYMARK_SHARE;
  RobotSetup setup{.world = read_world(share + "/worlds/circuit24.yaml").value(),
                   .robot = read_robot(share + "/robots/limo.yaml").value(),
                   .path = {}};
  setup.path = sample_path(setup.world.path_m, setup.world.path_closed, 0.001);
  return setup;
}

SE2 place(const RobotSetup& setup, Duration time) {
  const auto at = static_cast<std::size_t>(to_seconds(time) * kSpeed_m_s / 0.001);
  return setup.path[at % setup.path.size()].map_T_path;
}

void write_line(const std::string& line) {
  (void)std::fwrite(line.data(), 1, line.size(), stdout);
  (void)std::fflush(stdout);
}

void send_odometry(const RobotSetup& setup, Duration time) {
  const Odometry odometry{SensorTime(time), place(setup, Duration{}).inverse() * place(setup, time),
                          kSpeed_m_s, 0};
  write_line(to_line(Sample(odometry)));
}

/// The robot: writes an image, waits for the resulting order, and reports the latency.
int run_robot(int images) {
  const RobotSetup setup = make_setup();
  const auto world = std::make_shared<const World>(setup.world);
  auto scene_camera =
      DetectingCamera::make(world,
                            {{.camera = setup.robot.camera, .base_T_cam = setup.robot.model.base_T_cam}}, {})
          .value();
  std::vector<std::vector<std::uint8_t>> jpegs;
  for (int i = 0; i < images; ++i) {
    const Duration time = kFramePeriod * i;
    const auto seen = scene_camera->detect({.stamp = SensorTime(time),
                                            .world = world,
                                            .map_T_base = lift(place(setup, time)),
                                            .twist = {kSpeed_m_s, 0, 0},
                                            .seed = static_cast<std::uint64_t>(i)});
    jpegs.push_back(encode_jpeg(seen->frame.image, 92).value());
  }
  write_line(to_line(RobotHello{.name = "latency"}));
  std::string order;
  std::int64_t answered = 0;
  for (int i = 0; i < images; ++i) {
    std::this_thread::sleep_for(kPause);
    const Duration time = kFramePeriod * i;
    for (int k = kOdometryPerFrame; k-- > 0;) {
      if (i > 0 || k == 0) send_odometry(setup, time - k * kFramePeriod / kOdometryPerFrame);
    }
    const Duration exposed = steady_now();
    write_line(to_line(Sample(CameraFrame{.stamp = SensorTime(time)}), jpegs[static_cast<std::size_t>(i)]));
    while (std::getline(std::cin, order)) {
      const RobotOrderLine read = parse_order_line(order);
      if (read.kind == RobotOrderLine::Kind::Bye) return 0;
      if (read.kind == RobotOrderLine::Kind::Velocity && !read.by_watchdog) break;
    }
    write_line(to_line(RobotLog{fmt::format("{}", (steady_now() - exposed).count())}));
    ++answered;
  }
  return answered == images ? 0 : 1;
}

struct Part {
  const char* name;
  std::vector<double> ms{};
};

double percentile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

class Meter {
 public:
  void measure(std::size_t part, Duration& since) {
    const Duration now = steady_now();
    parts_[part].ms.push_back(to_seconds(now - since) * 1e3);
    since = now;
  }
  void whole(double ms) {
    double ours = 0;
    for (std::size_t i = 0; i < 4; ++i) ours += parts_[i].ms.back();
    parts_[4].ms.push_back(ms - ours);
    parts_[5].ms.push_back(ms);
  }
  int print() const {
    fmt::print("exposure end to command at the robot, 640 x 480, {} images [ms]\n", parts_[5].ms.size());
    fmt::print("{:<34} {:>7} {:>7} {:>7}\n", "", "median", "p99", "worst");
    for (const Part& part : parts_)
      fmt::print("{:<34} {:7.2f} {:7.2f} {:7.2f}\n", part.name, percentile(part.ms, 0.5),
                 percentile(part.ms, 0.99), percentile(part.ms, 1));
    return 0;
  }

 private:
  std::array<Part, 6> parts_{{{"base64 and JPEG decoded"},
                              {"tags found, corners refined"},
                              {"localised"},
                              {"followed, limited, handed over"},
                              {"pipes and watchdog, both ways"},
                              {"whole"}}};
};

/// The loop of a replay, with time measurements between its parts.
int run_replay(const std::string& self, int images) {
  const RobotSetup setup = make_setup();
  Trajectory taught;
  for (std::size_t i = 0; i < setup.path.size(); i += 20)
    taught.push_back(
        {SensorTime(Duration(static_cast<std::int64_t>(i) * 2'500'000)), lift(setup.path[i].map_T_path)});
  const RobotModel& model = setup.robot.model;
  Replayer replayer(make_localization_method({.landmarks = Landmarks(setup.world.tags),
                                              .tags = setup.world.tags,
                                              .sensor = {setup.robot.camera, model.base_T_cam}})
                        .value(),
                    build_route(taught).value(), setup.world.tags, model, {});
  const auto detector = make_apriltag_detector({}).value();
  auto wire =
      WatchedProcess::start(fmt::format("exec '{}' --robot {}", self, images), WAYMARK_WATCHDOG).value();
  RobotMessageReader reader("latency");
  Meter meter;
  while (true) {
    const auto lines = wire->read(std::chrono::seconds(1));
    if (!lines) break;  // it has ended
    for (const Line& line : *lines) {
      Duration since = steady_now();
      const auto message = reader.read(line);
      if (!message) {
        fmt::print(stderr, "{}\n", to_string(message.error()));
        return 1;
      }
      if (!*message) continue;
      if (const auto* log = std::get_if<RobotLog>(&**message))
        meter.whole(std::atof(log->text.c_str()) * 1e-6);
      const auto* sample = std::get_if<Sample>(&**message);
      if (sample == nullptr) continue;
      if (const auto* odometry = std::get_if<Odometry>(sample)) replayer.add(*odometry);
      const auto* taken = std::get_if<CameraFrame>(sample);
      if (taken == nullptr) continue;
      meter.measure(0, since);
      TagFrame frame{taken->stamp, taken->camera, detector->detect(taken->image).value()};
      for (TagDetection& detection : frame.detections) {
        const RefinedCorners refined = refine_corners(taken->image, detection, {}, &setup.robot.camera);
        detection.corners_px = refined.corners_px;
        detection.corner_covariance_px2 = refined.covariance_px2;
      }
      meter.measure(1, since);
      replayer.add(frame);
      meter.measure(2, since);
      const ReplayStep step = replayer.step(taken->stamp);
      (void)wire->send(step.command.speed_m_s, step.command.yaw_rate_rad_s);
      meter.measure(3, since);
    }
  }
  return meter.print();
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv, argv + argc);
  constexpr int kImages = 300;
  if (words.size() == 3 && words[1] == "--robot") return waymark::run_robot(std::atoi(argv[2]));
  return waymark::run_replay(words[0], words.size() > 1 ? std::atoi(argv[1]) : kImages);
}
