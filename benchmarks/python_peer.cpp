// The work of tools/python_ratio.py in C++: waymark_python_peer IMAGE WORLD ROBOT FRAMES RECORDED prints
// processor seconds per frame: for finding the tags of an image, for the filter with its odometry and tags,
// and for the filter over a recording of so many frames.
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <variant>
#include <vector>

#include "waymark/codecs/image_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/pipeline/localizer.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace {

double processor_s() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

waymark::SensorTime at_ms(int ms) { return waymark::SensorTime(std::chrono::milliseconds(ms)); }

/// Seconds per frame of the filter over all samples of a recording.
double over_recording(const waymark::LocalizerSetup& setup,
                      const std::vector<waymark::TagDetection>& detections, int frames) {
  std::vector<waymark::Sample> samples;
  for (int i = 0; i < frames; ++i) {
    for (int k = 0; k < 3; ++k) samples.emplace_back(waymark::Odometry{at_ms(60 * i + 20 * k), {}, 0, 0});
    samples.emplace_back(waymark::TagFrame{at_ms(60 * i + 40), "cam", detections});
  }
  const double begin = processor_s();
  auto localizer = waymark::Localizer::make(setup);
  if (!localizer) return 0;
  std::vector<waymark::LocalizationEstimate> estimates;
  for (const waymark::Sample& sample : samples) {
    localizer->add(sample);
    if (!std::holds_alternative<waymark::TagFrame>(sample)) continue;
    const auto estimate = localizer->estimate();
    if (estimate && estimate->certain) estimates.push_back(*estimate);
  }
  return (processor_s() - begin) / frames;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6)
    return std::fprintf(stderr, "usage: waymark_python_peer IMAGE WORLD ROBOT FRAMES RECORDED\n"), 2;
  const auto image = waymark::read_image(argv[1]);
  const auto world = waymark::read_world(argv[2]);
  const auto robot = waymark::read_robot(argv[3]);
  auto detector = waymark::make_detector();
  if (!image || !world || !robot || !detector) return std::fprintf(stderr, "a file cannot be read\n"), 1;
  const auto finder = waymark::make_tag_finder(std::move(*detector));
  waymark::LocalizerSetup setup{.landmarks = waymark::Landmarks(world->tags), .tags = world->tags};
  setup.sensor = {.camera = robot->camera, .base_T_sensor = robot->model.base_T_cam};
  auto localizer = waymark::Localizer::make(setup);
  if (!finder || !localizer) return std::fprintf(stderr, "no detector or no localizer\n"), 1;

  const int frames = std::atoi(argv[4]);
  double detector_s = 0;
  double filter_s = 0;
  int known = 0;
  for (int i = 0; i < frames; ++i) {
    const double begin = processor_s();
    auto found = waymark::find_tags(*image, *finder, waymark::ImageLens::of(robot->camera));
    if (!found) return 1;
    const double seen = processor_s();
    for (int k = 0; k < 3; ++k) localizer->add(waymark::Odometry{at_ms(60 * i + 20 * k), {}, 0, 0});
    localizer->add(waymark::TagFrame{at_ms(60 * i + 40), "cam", std::move(found->detections)});
    known += localizer->estimate() ? 1 : 0;
    const double done = processor_s();
    if (i < 3) continue;  // caches and workspaces
    detector_s += seen - begin;
    filter_s += done - seen;
  }
  if (known == 0) return std::fprintf(stderr, "the filter found no pose\n"), 1;
  const auto last = waymark::find_tags(*image, *finder, waymark::ImageLens::of(robot->camera));
  if (!last) return 1;
  const double recorded_s = over_recording(setup, last->detections, std::atoi(argv[5]));
  std::printf("%.9f %.9f %.9f\n", detector_s / (frames - 3), filter_s / (frames - 3), recorded_s);
}
