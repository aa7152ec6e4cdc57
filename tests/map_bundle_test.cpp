// Maps of circuit24 by bundle adjustment, from corners with noise: as accurate as the measurements allow
// (Cramer and Rao), as certain as they say, and honest about laps in which something was wrong.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <optional>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/config/robot_file.hpp"
#include "waymark/config/world_file.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/map_checks.hpp"
#include "waymark/samples/corners.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

const World& circuit() {
  static const World world = read_world(WAYMARK_SHARE "/worlds/circuit24.yaml").value();
  return world;
}

struct Lap {
  LapInput input;
  Trajectory truth{};
};

Lap drive(std::uint64_t seed) {
  static const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const World& world = circuit();
  Lap lap{.input = {.camera = robot.camera,
                    .base_T_cam = robot.model.base_T_cam,
                    .sizes = {.default_size_m = 0.16},
                    .anchor = world.anchor,
                    .map_T_anchor = world.tags.find(world.anchor)->map_T_tag}};
  LapListener listener;
  listener.on_sample = [&](const Sample& sample) {
    if (const auto* frame = std::get_if<TagFrame>(&sample)) lap.input.frames.push_back(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) lap.input.odometry.push_back(*odometry);
    if (const auto* truth = std::get_if<TruthPose>(&sample))
      lap.truth.push_back({truth->stamp, truth->map_T_base});
    return Status();
  };
  EXPECT_TRUE(drive_scripted_lap({world, robot.model, robot.camera, {.seed = seed}}, {}, listener));
  return lap;
}

BundleMap map_of(const LapInput& lap) {
  auto map = map_by_bundle(lap);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap{};
}

Eigen::Matrix3d position_covariance(const SE3& map_T_x, const Matrix6& covariance) {
  return coordinate_covariance(Uncertain<SE3>{map_T_x, covariance}).topLeftCorner<3, 3>();
}

/// Squared errors and the bound on their mean, over many laps.
struct Score {
  double squared = 0;
  double bound = 0;
  int count = 0;
  int inside = 0;  ///< of the 95 % ellipsoid
  void add(const Eigen::Vector3d& error, const Eigen::Matrix3d& P) {
    constexpr double k95 = 7.815;  // chi-square, 3 degrees of freedom
    squared += error.squaredNorm();
    bound += P.trace();
    inside += error.dot(P.llt().solve(error)) < k95 ? 1 : 0;
    ++count;
  }
  [[nodiscard]] double ratio() const { return std::sqrt(squared / bound); }
  [[nodiscard]] double rmse_m() const { return std::sqrt(squared / count); }
  [[nodiscard]] double coverage() const { return static_cast<double>(inside) / count; }
};

std::optional<SE3> true_pose(const Lap& lap, SensorTime stamp) {
  const auto after = std::ranges::lower_bound(lap.truth, stamp, {}, &StampedPose::stamp);
  if (after == lap.truth.begin() || after == lap.truth.end()) return std::nullopt;
  const auto before = std::prev(after);
  const double share = to_seconds(stamp - before->stamp) / to_seconds(after->stamp - before->stamp);
  return interpolate(before->map_T_base, after->map_T_base, share);
}

TEST(BundleMap, ReachesTheCramerRaoBoundAndKnowsIt) {
  const int laps = std::getenv("WAYMARK_FULL") != nullptr ? 50 : 16;
  Score tags;
  Score trajectory;
  for (int seed = 1; seed <= laps; ++seed) {
    const Lap lap = drive(static_cast<std::uint64_t>(seed));
    const BundleMap map = map_of(lap.input);
    ASSERT_EQ(map.map.tags.size(), circuit().tags.tags.size());
    for (const auto& [id, tag] : map.map.tags) {
      if (!tag.covariance) continue;  // the anchor
      tags.add(tag.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation(),
               position_covariance(tag.map_T_tag, *tag.covariance));
    }
    for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
      const auto truth = true_pose(lap, map.trajectory[i].stamp);
      if (!truth) continue;
      const SE3& estimate = map.trajectory[i].map_T_base;
      trajectory.add(estimate.translation() - truth->translation(),
                     position_covariance(estimate, map.trajectory_covariance[i]));
    }
  }
  std::printf(
      "%d laps: tags %.4f m rmse, %.3f of the bound, %.3f in their 95 %% ellipsoids; trajectory %.4f m, "
      "%.3f, %.3f\n",
      laps, tags.rmse_m(), tags.ratio(), tags.coverage(), trajectory.rmse_m(), trajectory.ratio(),
      trajectory.coverage());
  EXPECT_GT(trajectory.count, 100 * laps);
  EXPECT_LT(tags.ratio(), 1.15);
  EXPECT_GT(tags.ratio(), 0.75) << "nobody beats the bound: the covariance is too large";
  EXPECT_LT(trajectory.ratio(), 1.15);
  EXPECT_GT(tags.coverage(), 0.92);
  EXPECT_LT(tags.coverage(), 0.98);
}

TEST(BundleMap, TheSameLapGivesTheSameBits) {
  const Lap lap = drive(3);
  const BundleMap a = map_of(lap.input);
  const BundleMap b = map_of(lap.input);
  for (const auto& [id, tag] : a.map.tags) EXPECT_EQ(tag.map_T_tag, b.map.tags.at(id).map_T_tag);
}

TEST(BundleMap, AGoodLapIsNotComplainedAbout) {
  const Lap lap = drive(1);
  EXPECT_TRUE(check_map(lap.input, map_of(lap.input)).empty())
      << check_map(lap.input, map_of(lap.input)).front();
}

TEST(BundleMap, NamesATagSizeThatContradictsTheWheels) {
  Lap lap = drive(2);
  lap.input.sizes.default_size_m = 0.20;
  const auto words = check_map(lap.input, map_of(lap.input));
  EXPECT_THAT(words, Contains(HasSubstr("tag sizes look 2")));
  EXPECT_THAT(words, Contains(HasSubstr("% too large (is it 0.16")));
}

void for_each_detection(LapInput& lap, const std::function<void(const TagFrame&, TagDetection&)>& change) {
  for (TagFrame& frame : lap.frames) {
    for (TagDetection& detection : frame.detections) change(frame, detection);
  }
}

double worst_of_others(const BundleMap& map, const std::set<TagId>& spoiled) {
  double worst = 0;
  for (const auto& [id, tag] : map.map.tags) {
    if (spoiled.contains(id)) continue;
    worst = std::max(worst,
                     (tag.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation()).norm());
  }
  return worst;
}

TEST(BundleMap, NamesAnIdThatTwoTagsCarry) {
  Lap lap = drive(4);
  const TagId real{FamilyId::Tag36h11, 5};
  const TagId copy{FamilyId::Tag36h11, 14};
  for_each_detection(lap.input, [&](const TagFrame&, TagDetection& detection) {
    if (detection.tag == copy) detection.tag = real;
  });
  const BundleMap map = map_of(lap.input);
  const auto words = check_map(lap.input, map);
  EXPECT_THAT(words, Contains(::testing::AllOf(HasSubstr("tag36h11:5 was seen in two places"),
                                               HasSubstr("two tags carry this id"))));
  EXPECT_LT(worst_of_others(map, {real}), 0.05);
}

/// What a detector would have seen had the tag stood elsewhere: corners shifted as its centre is.
TEST(BundleMap, NamesATagThatWasMoved) {
  Lap lap = drive(5);
  const TagId other{FamilyId::Tag36h11, 1};  // seen at the start and again at the end
  const SensorTime half = lap.input.frames[lap.input.frames.size() / 2].stamp;
  const SE3 map_T_before = circuit().tags.find(other)->map_T_tag;
  const SE3 map_T_after = SE3(SO3(), Eigen::Vector3d(0.15, 0.1, 0)) * map_T_before;
  for (TagFrame& frame : lap.input.frames) {
    const auto truth = true_pose(lap, frame.stamp);
    if (frame.stamp < half || !truth) continue;
    const SE3 cam_T_map = (*truth * lap.input.base_T_cam).inverse();
    for (TagDetection& detection : frame.detections) {
      if (detection.tag != other) continue;
      const auto before =
          visible_corners(lap.input.camera, cam_T_map * map_T_before, 0.16, {.margin_px = -1e4});
      const auto after =
          visible_corners(lap.input.camera, cam_T_map * map_T_after, 0.16, {.margin_px = -1e4});
      for (std::size_t c = 0; before && after && c < 4; ++c)
        detection.corners_px[c] += (*after)[c] - (*before)[c];
    }
  }
  const BundleMap map = map_of(lap.input);
  EXPECT_THAT(
      check_map(lap.input, map),
      Contains(::testing::AllOf(HasSubstr("tag36h11:1 was seen in two places"), HasSubstr("it was moved"))));
  EXPECT_LT(worst_of_others(map, {other}), 0.05);
}

TEST(BundleMap, LeavesWrongIdsOut) {
  Lap lap = drive(6);
  Random random(60);
  int wrong = 0;
  for_each_detection(lap.input, [&](const TagFrame&, TagDetection& detection) {
    if (random.uniform(0, 1) > 0.05) return;
    detection.tag.number = static_cast<int>(random.uniform(0, 23.99));
    ++wrong;
  });
  const BundleMap map = map_of(lap.input);
  EXPECT_GT(static_cast<double>(map.rejected.size()), 0.7 * wrong);
  EXPECT_LT(worst_of_others(map, {}), 0.03);
  EXPECT_THAT(check_map(lap.input, map), Contains(HasSubstr("contradict the others")));
}

TEST(BundleMap, WorksWithoutOdometryAndThroughBlindness) {
  Lap lap = drive(7);
  LapInput no_wheels = lap.input;
  no_wheels.odometry.clear();
  EXPECT_LT(worst_of_others(map_of(no_wheels), {}), 0.04);
  for (std::size_t i = 300; i < 345; ++i) lap.input.frames[i].detections.clear();  // covered for 3 s
  const BundleMap map = map_of(lap.input);
  EXPECT_EQ(map.frames_without_pose, 0) << "wheels carry the robot through";
  EXPECT_LT(worst_of_others(map, {}), 0.04);
  EXPECT_LT(trajectory_errors(map.trajectory, lap.truth).max_m, 0.06);
}

TEST(BundleMap, PlacesATagThatTheChainIsTooFarFrom) {
  Lap lap = drive(9);
  const TagId far{FamilyId::Tag36h11, 12};
  constexpr double kFarPx = 442 * 0.16 / 2.6;  // side of a tag 2.6 m away
  for (TagFrame& frame : lap.input.frames) {
    std::erase_if(frame.detections, [&](const TagDetection& detection) {
      return detection.tag == far && mean_side_px(detection.corners_px) > kFarPx;
    });
  }
  int sightings = 0;
  for (const TagFrame& frame : lap.input.frames)
    sightings += static_cast<int>(std::ranges::count(frame.detections, far, &TagDetection::tag));
  ASSERT_GE(sightings, 10);
  const ChainOptions chain{.max_distance_m = 2.5};
  const auto mapped = map_by_bundle(lap.input, chain);
  ASSERT_TRUE(mapped) << to_string(mapped.error());
  const BundleMap& map = *mapped;
  ASSERT_NE(map.map.find(far), nullptr) << "placed by its sightings once the base poses are known";
  EXPECT_TRUE(map.unconnected.empty());
  const double off =
      (map.map.find(far)->map_T_tag.translation() - circuit().tags.find(far)->map_T_tag.translation()).norm();
  EXPECT_LT(off, 0.15);
}

TEST(BundleMap, SurvivesWhatIsNoMeasurement) {
  Lap lap = drive(8);
  lap.input.frames[100].detections[0].corners_px[2].x() = std::nan("");
  lap.input.frames[200].stamp = lap.input.frames[199].stamp;
  lap.input.odometry[500].odom_T_base = SE2(std::nan(""), 0, 0);
  const BundleMap map = map_of(lap.input);
  EXPECT_LT(worst_of_others(map, {}), 0.03);
  for (const StampedPose& pose : map.trajectory) EXPECT_TRUE(pose.map_T_base.log().allFinite());
  LapInput no_anchor = lap.input;
  no_anchor.anchor = {FamilyId::Tag36h11, 99};
  EXPECT_FALSE(map_by_bundle(no_anchor));
}

}  // namespace
}  // namespace waymark
