// The detector compared with libapriltag itself, on rendered images of twenty tags in front of a cluttered
// background.
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

using Size = std::pair<int, int>;

/// Tags of 15 cm at 0.7 to 4 m, tilted up to 50 degrees, in an image with a field of view of about 60
/// degrees.
const Image& image_of_size(const Size& size) {
  static std::map<Size, Image> images;
  if (const auto found = images.find(size); found != images.end()) return found->second;
  const auto [width, height] = size;
  const double focal = 0.87 * width;
  const PinholeRadtan lens{.fx = focal, .fy = focal, .cx = width / 2.0, .cy = height / 2.0};
  const CameraModel camera = CameraModel::make(lens, width, height).value();
  Random random(1);
  PhotographScene scene;
  for (int number = 0; number < 20; ++number) {
    const double depth = random.uniform(0.7, 4);
    const Eigen::Vector3d place(random.uniform(-0.5, 0.5) * depth, random.uniform(-0.3, 0.3) * depth, depth);
    const double tilt = random.uniform(0, 0.87);
    const double about = random.uniform(0, 6.28);
    const Eigen::Vector3d turn(tilt * std::cos(about), tilt * std::sin(about), 0);
    scene.tags.push_back({{FamilyId::Tag36h11, number}, SE3(SO3::exp(turn), place), 0.15});
  }
  return images.emplace(size, photograph(camera, scene, {}, random).value().image).first->second;
}

void detect_with_ours(benchmark::State& state, const Size& size) {
  const Image& image = image_of_size(size);
  const auto detector = make_apriltag_detector().value();
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(detector->detect(image));
  }
  state.counters["tags"] = static_cast<double>(detector->detect(image)->size());
}

struct RawSettings {
  int max_hamming = 2;
  double decode_sharpening = 0.25;
  int min_white_black_diff = 5;
};

void detect_with_libapriltag(benchmark::State& state, const Size& size, const RawSettings& settings) {
  const Image& image = image_of_size(size);
  const std::unique_ptr<apriltag_family_t, void (*)(apriltag_family_t*)> family(tag36h11_create(),
                                                                                tag36h11_destroy);
  const std::unique_ptr<apriltag_detector_t, void (*)(apriltag_detector_t*)> detector(
      apriltag_detector_create(), apriltag_detector_destroy);
  apriltag_detector_add_family_bits(detector.get(), family.get(), settings.max_hamming);
  detector->quad_decimate = 1;
  detector->decode_sharpening = settings.decode_sharpening;
  detector->qtp.min_white_black_diff = settings.min_white_black_diff;
  image_u8_t view{image.width(), image.height(), image.width(), const_cast<std::uint8_t*>(image.row(0))};
  int tags = 0;
  for ([[maybe_unused]] auto _ : state) {
    zarray_t* detections = apriltag_detector_detect(detector.get(), &view);
    tags = zarray_size(detections);
    apriltag_detections_destroy(detections);
  }
  state.counters["tags"] = tags;
}

const bool kRegistered = [] {
  const DetectorOptions ours;
  const RawSettings same{ours.max_hamming, ours.decode_sharpening, ours.min_white_black_diff};
  for (const Size& size : {Size(640, 480), Size(1280, 720), Size(1920, 1080)}) {
    const std::string name = fmt::format("{}x{}", size.first, size.second);
    // Cost of the wrapper.
    benchmark::RegisterBenchmark(("detect/peer:libapriltag, our settings/" + name).c_str(),
                                 detect_with_libapriltag, size, same)
        ->Unit(benchmark::kMillisecond);
    // Effect of the defaults.
    benchmark::RegisterBenchmark(("detect/peer:libapriltag, its settings/" + name).c_str(),
                                 detect_with_libapriltag, size, RawSettings())
        ->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark(("detect/ours/" + name).c_str(), detect_with_ours, size)
        ->Unit(benchmark::kMillisecond);
  }
  return true;
}();

}  // namespace
}  // namespace waymark
