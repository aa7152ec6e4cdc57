// Corner refinement of one tag compared with OpenCV's cornerSubPix on the same four corners, by size of the
// tag.
#include <array>
#include <map>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

struct Case {
  Image image;
  std::vector<TagDetection> detections;
};

/// A dozen tags of one size, rotated and tilted, in one image; corners 0.15 px off.
const Case& make_case(int size_px) {
  static std::map<int, Case> cases;
  if (const auto found = cases.find(size_px); found != cases.end()) return found->second;
  const PinholeRadtan lens{.fx = 900, .fy = 900, .cx = 640, .cy = 360};
  const CameraModel camera = CameraModel::make(lens, 1280, 720).value();
  Random random(1);
  PhotographScene scene;
  for (int i = 0; i < 12; ++i) {
    const double depth = 900 * 0.15 / size_px;
    const Eigen::Vector2d px(160 + 320 * (i % 4), 120 + 240 * (i / 4));
    const Eigen::Vector3d place((px.x() - 640) / 900 * depth, (px.y() - 360) / 900 * depth, depth);
    const SO3 turn = SO3::exp({random.uniform(-0.7, 0.7), random.uniform(-0.7, 0.7), 0}) *
                     SO3::exp({0, 0, random.uniform(-3, 3)});
    scene.tags.push_back({{FamilyId::Tag36h11, i}, SE3(turn, place), 0.15});
  }
  const Photograph photo = photograph(camera, scene, {}, random).value();
  Case made{photo.image, {}};
  for (const TagTruth& tag : photo.tags) {
    TagDetection detection;
    detection.tag = tag.tag;
    detection.corners_px = tag.corners_px;
    for (auto& corner : detection.corners_px)
      corner += 0.15 * Eigen::Vector2d(random.normal(), random.normal());
    made.detections.push_back(detection);
  }
  return cases.emplace(size_px, std::move(made)).first->second;
}

void refine_with_ours(benchmark::State& state, int size_px) {
  const Case& what = make_case(size_px);
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(refine_corners(what.image, what.detections[next++ % what.detections.size()]));
  }
}

void refine_with_opencv(benchmark::State& state, int size_px) {
  const Case& what = make_case(size_px);
  const cv::Mat image(what.image.height(), what.image.width(), CV_8U,
                      const_cast<std::uint8_t*>(what.image.row(0)));
  const cv::TermCriteria until(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.01);
  std::vector<cv::Point2f> corners(4);
  std::size_t next = 0;
  for ([[maybe_unused]] auto _ : state) {
    const TagDetection& detection = what.detections[next++ % what.detections.size()];
    for (std::size_t k = 0; k < 4; ++k) {
      corners[k] = {static_cast<float>(detection.corners_px[k].x() - 0.5),
                    static_cast<float>(detection.corners_px[k].y() - 0.5)};
    }
    cv::cornerSubPix(image, corners, {5, 5}, {-1, -1}, until);
    benchmark::DoNotOptimize(corners);
  }
}

const bool kRegistered = [] {
  for (const int size_px : {16, 24, 50, 100}) {
    const std::string name = fmt::format("{} px", size_px);
    benchmark::RegisterBenchmark(("refine/peer:cornerSubPix/" + name).c_str(), refine_with_opencv, size_px)
        ->Unit(benchmark::kMicrosecond);
    benchmark::RegisterBenchmark(("refine/ours/" + name).c_str(), refine_with_ours, size_px)
        ->Unit(benchmark::kMicrosecond);
  }
  return true;
}();

}  // namespace
}  // namespace waymark
