// The pose of one tag compared with OpenCV's and libapriltag's, and of the camera from eight tags compared
// with OpenCV's solvePnP.
#include <deque>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>

#include "benchmarks/pose_peers.hpp"
#include "tests/support/tag_views.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using testing::kTagSize;

constexpr double kSigma = 0.1;
constexpr std::size_t kViews = 256;

std::vector<TagDetection> views(const CameraModel& camera) {
  Random random(1);
  std::vector<TagDetection> all;
  while (all.size() < kViews) {
    const SE3 cam_T_tag = testing::random_view(random, {.min_size_px = 20, .max_size_px = 200});
    all.push_back(testing::with_noise(testing::see_tag(camera, cam_T_tag).value(), kSigma, random));
  }
  return all;
}

const PinholeRadtan& lens_of(const CameraModel& camera) {
  return std::get<PinholeRadtan>(camera.projection());
}

void one_tag_ours(benchmark::State& state, const CameraModel& camera) {
  const std::vector<TagDetection> seen = views(camera);
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    benchmark::DoNotOptimize(
        estimate_tag_pose(seen[i++ % kViews], kTagSize, camera, {.corner_sigma_px = kSigma}));
  }
}

template <class Peer, class Call>
void one_tag_peer(benchmark::State& state, const CameraModel& camera, Call&& call) {
  std::deque<Peer> peers;
  for (const TagDetection& seen : views(camera)) peers.emplace_back(lens_of(camera), seen, kTagSize);
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) benchmark::DoNotOptimize(call(peers[i++ % kViews]));
}

/// Eight tags, a typical view of a robot: 30 to 120 px, all at their poses in the map, or two of them moved.
struct Scene {
  TagMap map;
  std::vector<TagDetection> seen;
  std::vector<cv::Point3d> map_corners;
  std::vector<cv::Point2d> px;
};

std::vector<Scene> scenes(const CameraModel& camera, int moved) {
  Random random(2);
  std::vector<Scene> all(64);
  for (Scene& scene : all) {
    const SE3 map_T_cam(SO3::exp({random.normal(), random.normal(), random.normal()}), {1, 2, 0.3});
    for (int number = 0; number < 8; ++number) {
      const SE3 cam_T_tag = testing::random_view(
          random, {.min_size_px = 30, .max_size_px = 120, .max_tilt_deg = 60, .max_off_axis = 0.35});
      scene.seen.push_back(
          testing::with_noise(testing::see_tag(camera, cam_T_tag, kTagSize, number).value(), kSigma, random));
      const SE3 map_T_tag = map_T_cam * cam_T_tag;
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d p = map_T_tag * testing::tag_corners().at(i);
        scene.map_corners.emplace_back(p.x(), p.y(), p.z());
        const Eigen::Vector2d& px = scene.seen.back().corners_px.at(i);
        scene.px.emplace_back(px.x() - 0.5, px.y() - 0.5);
      }
      const double by = number < moved ? 0.2 : 0;
      scene.map.tags[scene.seen.back().tag] = {
          .map_T_tag = SE3(map_T_tag.rotation(), map_T_tag.translation() + Eigen::Vector3d(by, by, -by)),
          .size_m = kTagSize};
    }
  }
  return all;
}

void eight_tags_ours(benchmark::State& state, const CameraModel& camera, int moved) {
  const std::vector<Scene> all = scenes(camera, moved);
  std::size_t i = 0, rejected = 0;
  for ([[maybe_unused]] auto _ : state) {
    const Scene& scene = all[i++ % all.size()];
    const auto pose = estimate_camera_pose(scene.seen, scene.map, camera, {.corner_sigma_px = kSigma});
    rejected += pose->rejected.size();
  }
  state.counters["rejected"] = static_cast<double>(rejected) / static_cast<double>(i);
}

/// The same 32 corners in one solution, without rejection of moved tags and without a covariance.
void eight_tags_opencv(benchmark::State& state, const CameraModel& camera, int method) {
  const std::vector<Scene> all = scenes(camera, 0);
  const PinholeRadtan& lens = lens_of(camera);
  const cv::Matx33d K(lens.fx, 0, lens.cx - 0.5, 0, lens.fy, lens.cy - 0.5, 0, 0, 1);
  const std::vector<double> k(lens.k.begin(), lens.k.begin() + lens.coefficients);
  std::size_t i = 0;
  for ([[maybe_unused]] auto _ : state) {
    const Scene& scene = all[i++ % all.size()];
    cv::Vec3d r, t;
    benchmark::DoNotOptimize(cv::solvePnP(scene.map_corners, scene.px, K, k, r, t, false, method));
  }
}

template <class Function>
void add(const std::string& name, Function&& function) {
  benchmark::RegisterBenchmark(name.c_str(), std::forward<Function>(function))->Unit(benchmark::kMicrosecond);
}

void add_one_tag(const std::string& lens, const CameraModel& camera) {
  add("pose of one tag/ours/" + lens, [=](benchmark::State& state) { one_tag_ours(state, camera); });
  add("pose of one tag/peer:OpenCV IPPE_SQUARE/" + lens, [=](benchmark::State& state) {
    one_tag_peer<peers::OpenCv>(state, camera, [](peers::OpenCv& peer) { return peer.pose(); });
  });
  add("pose of one tag/peer:OpenCV IPPE_SQUARE both/" + lens, [=](benchmark::State& state) {
    one_tag_peer<peers::OpenCv>(state, camera, [](peers::OpenCv& peer) { return peer.both(); });
  });
}

const bool kRegistered = [] {
  cv::setNumThreads(1);
  const CameraModel plain = testing::plain_camera();
  const CameraModel distorting = testing::distorting_camera();
  add_one_tag("no distortion", plain);
  add_one_tag("5 coefficients", distorting);
  add("pose of one tag/peer:libapriltag/no distortion", [=](benchmark::State& state) {
    one_tag_peer<peers::Libapriltag>(state, plain, [](peers::Libapriltag& peer) { return peer.pose(); });
  });
  for (const auto& [name, camera] :
       {std::pair("no distortion", plain), std::pair("5 coefficients", distorting)}) {
    const std::string lens = name;
    add("pose from 8 tags/ours/" + lens, [=](benchmark::State& state) { eight_tags_ours(state, camera, 0); });
    add("pose from 8 tags/peer:OpenCV ITERATIVE/" + lens,
        [=](benchmark::State& state) { eight_tags_opencv(state, camera, cv::SOLVEPNP_ITERATIVE); });
    add("pose from 8 tags/peer:OpenCV SQPNP/" + lens,
        [=](benchmark::State& state) { eight_tags_opencv(state, camera, cv::SOLVEPNP_SQPNP); });
  }
  add("pose from 8 tags, 2 moved/ours/no distortion",
      [=](benchmark::State& state) { eight_tags_ours(state, plain, 2); });
  return true;
}();

}  // namespace
}  // namespace waymark
