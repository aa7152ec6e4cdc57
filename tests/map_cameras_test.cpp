// A robot with a front and a rear camera: the second camera improves a map.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tests/support/circuit_lap.hpp"

namespace waymark {
namespace {

using namespace test;

const RobotDescription& front_and_rear() {
  static const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo-front-rear.yaml").value();
  return robot;
}

/// Tags all around a circular path, facing its centre: both cameras observe equally many.
const World& ring() {
  static const World world = [] {
    constexpr int kTags = 24;
    World made{.name = "ring"};
    for (int i = 0; i < kTags; ++i) {
      const double angle = 2 * std::numbers::pi * i / kTags;
      made.tags.tags[{FamilyId::Tag36h11, i}] = {
          .map_T_tag =
              upright_tag({2.6 * std::cos(angle), 2.6 * std::sin(angle), 0.3}, angle + std::numbers::pi),
          .size_m = 0.16};
    }
    for (int i = 0; i < 72; ++i) {
      const double angle = 2 * std::numbers::pi * (i - 13) / 72;
      made.path_m.push_back({std::cos(angle), std::sin(angle)});
    }
    made.path_closed = true;
    made.anchor = {FamilyId::Tag36h11, 0};
    return made;
  }();
  return world;
}

Lap drive_two(std::uint64_t seed) { return drive(seed, {}, ring(), front_and_rear()); }

/// The same lap without the rear camera.
LapInput front_alone(LapInput lap) {
  std::erase_if(lap.frames, [](const TagFrame& frame) { return frame.camera != "front"; });
  lap.more_cameras.clear();
  return lap;
}

int observations(const BundleMap& map) {
  int sum = 0;
  for (const auto& [id, count] : map.observations) sum += count;
  return sum;
}

double rmse_m(const BundleMap& map) {
  double squared = 0;
  for (const auto& [id, tag] : map.map.tags)
    squared += (tag.map_T_tag.translation() - ring().tags.find(id)->map_T_tag.translation()).squaredNorm();
  return std::sqrt(squared / static_cast<double>(map.map.tags.size()));
}

TEST(MapCameras, ASecondCameraDoesNotChangeTheFirstOnesDetections) {
  const Lap two = drive_two(3);
  const Lap one = drive(3, {}, ring());
  const LapInput front = front_alone(two.input);
  ASSERT_EQ(front.frames.size(), one.input.frames.size());
  for (std::size_t i = 0; i < front.frames.size(); ++i) {
    ASSERT_EQ(front.frames[i].detections.size(), one.input.frames[i].detections.size()) << i;
    for (std::size_t d = 0; d < front.frames[i].detections.size(); ++d)
      ASSERT_EQ(front.frames[i].detections[d].corners_px, one.input.frames[i].detections[d].corners_px);
  }
}

TEST(MapCameras, TwoCamerasMapAtLeastAsWellAsOne) {
  constexpr int kLaps = 4;
  double with_two = 0;
  double with_one = 0;
  for (int seed = 1; seed <= kLaps; ++seed) {
    const Lap lap = drive_two(static_cast<std::uint64_t>(seed));
    const BundleMap two = map_of(lap.input);
    const BundleMap one = map_of(front_alone(lap.input));
    EXPECT_EQ(two.map.tags.size(), ring().tags.tags.size()) << "seed " << seed;
    EXPECT_EQ(one.map.tags.size(), ring().tags.tags.size()) << "seed " << seed;
    EXPECT_GT(observations(two), 1.5 * observations(one)) << "seed " << seed;
    EXPECT_EQ(two.trajectory.size(), one.trajectory.size()) << "one pose for simultaneous images";
    EXPECT_TRUE(two.summary.usable());
    EXPECT_NEAR(two.noise_ratio, 1, 0.1) << "the corners of the rear camera fit equally well";
    with_two += rmse_m(two) * rmse_m(two);
    with_one += rmse_m(one) * rmse_m(one);
  }
  std::printf("%d laps: tags %.4f m rmse with two cameras, %.4f m with the front one alone\n", kLaps,
              std::sqrt(with_two / kLaps), std::sqrt(with_one / kLaps));
  EXPECT_LE(with_two, with_one);
}

TEST(MapCameras, CamerasNeedNotBeTriggeredTogether) {
  Lap lap = drive_two(4);
  // Alternating frames of each camera.
  std::vector<TagFrame> in_turn;
  for (std::size_t i = 0; i < lap.input.frames.size(); ++i) {
    const bool front = lap.input.frames[i].camera == "front";
    if ((i / 2) % 2 == (front ? 0U : 1U)) in_turn.push_back(lap.input.frames[i]);
  }
  lap.input.frames = in_turn;
  const BundleMap map = map_of(lap.input);
  EXPECT_EQ(map.map.tags.size(), ring().tags.tags.size());
  EXPECT_EQ(map.trajectory.size(), in_turn.size());
  EXPECT_NEAR(map.noise_ratio, 1, 0.1);
  EXPECT_LT(rmse_m(map), 0.05);
}

TEST(MapCameras, AWrongMountingOfTheRearCameraIsVisible) {
  Lap lap = drive_two(5);
  std::vector<TagFrame> few;  // a third of the frames is sufficient
  for (std::size_t i = 0; i < lap.input.frames.size(); ++i) {
    if ((i / 2) % 3 == 0) few.push_back(lap.input.frames[i]);
  }
  lap.input.frames = few;
  const BundleMap right = map_of(lap.input);
  lap.input.more_cameras[0].base_T_cam =
      lap.input.more_cameras[0].base_T_cam * SE3(SO3::exp({0, 0.1, 0}), Eigen::Vector3d::Zero());
  const BundleMap wrong = map_of(lap.input);
  EXPECT_GT(static_cast<double>(wrong.rejected.size()) + 10 * (wrong.noise_ratio - 1),
            static_cast<double>(right.rejected.size()) + 10 * (right.noise_ratio - 1) + 5);
}

}  // namespace
}  // namespace waymark
