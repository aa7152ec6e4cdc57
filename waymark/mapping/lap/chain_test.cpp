// Tests the chain on laps with ground truth: it is exact without noise, and correct even if the wrong one of
// two poses fits some tags better. Then tests drives through several rooms without a common tag, with
// drifting odometry.
#include "waymark/mapping/lap/chain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertain_draw.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

TagId tag(int number) { return {.number = number}; }

SE3 base_T_cam() {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {SO3::from_matrix(optical), {0.08, 0, 0.18}};
}

/// Tags on a circle with a radius of 3 m, all facing inwards and some leaning; one tag lies on the floor.
TagMap true_tags() {
  TagMap map;
  const Eigen::Matrix3d upright = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * kPi * i / 16;
    const SE3 place = lift(SE2(3 * std::cos(angle), 3 * std::sin(angle), angle));
    const SE3 lean(SO3::exp({0.02 * (i % 5), 0.03 * (i % 3), 0.1 * i}) * SO3::from_matrix(upright),
                   {0, 0, 0.2 + 0.03 * (i % 4)});
    map.tags[tag(i)] = {.map_T_tag = place * lean, .size_m = 0.16};
  }
  map.tags[tag(16)] = {.map_T_tag = SE3(SO3::exp({kPi, 0, 0.4}), {2.2, 0.5, 0}), .size_m = 0.16};
  return map;
}

/// A drive along a circle with a radius of 1 m that ends where it began. Each frame shows the tags within 70
/// degrees of the driving direction.
Trajectory true_lap() {
  Trajectory lap;
  for (int i = 0; i <= 300; ++i) {
    const double angle = 2 * kPi * i / 300;
    lap.push_back({SensorTime(Duration(i * 66'000'000LL)),
                   lift(SE2(std::cos(angle), std::sin(angle), angle + kPi / 2))});
  }
  return lap;
}

std::vector<ObservedFrame> observe_lap(const Trajectory& lap, const TagMap& tags) {
  std::vector<ObservedFrame> frames;
  for (const StampedPose& pose : lap) {
    ObservedFrame frame{.stamp = pose.stamp};
    const SE3 cam_T_map = (pose.map_T_base * base_T_cam()).inverse();
    for (const auto& [id, mapped] : tags.tags) {
      const SE3 cam_T_tag = cam_T_map * mapped.map_T_tag;
      const Eigen::Vector3d ahead = cam_T_tag.translation().normalized();
      if (ahead.z() < std::cos(70 * kPi / 180)) continue;
      frame.tags.push_back(
          {.tag = id, .cam_T_tag = cam_T_tag, .covariance = PoseCovariance::Identity() * 1e-5});
    }
    frames.push_back(frame);
  }
  return frames;
}

Result<ChainResult> chain(const std::vector<ObservedFrame>& frames, const ChainOptions& options = {}) {
  return map_by_chain(frames, tag(0), true_tags().tags.at(tag(0)).map_T_tag, {.default_size_m = 0.16},
                      base_T_cam(), options);
}

double worst(const TagMap& map) {
  double most = 0;
  for (const auto& [id, mapped] : map.tags)
    most = std::max(most, minus(mapped.map_T_tag, true_tags().find(id)->map_T_tag).norm());
  return most;
}

TEST(TeachChain, IsExactWithoutNoise) {
  for (const bool spread : {false, true}) {
    const Trajectory lap = true_lap();
    const auto result = chain(observe_lap(lap, true_tags()), {.spread_closing_error = spread});
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_EQ(result->map.tags.size(), 17U);
    EXPECT_TRUE(result->unconnected.empty());
    EXPECT_LT(worst(result->map), 1e-9);
    EXPECT_EQ(result->frames_without_pose, 0);
    ASSERT_EQ(result->trajectory.size(), lap.size());
    // Neighbours constrain each pose weakly, which causes errors of millimetres on a curve and more at its
    // ends.
    for (std::size_t i = 0; i < lap.size(); ++i)
      EXPECT_LT(minus(result->trajectory[i].map_T_base, lap[i].map_T_base).norm(),
                i < 7 || i + 7 >= lap.size() ? 5e-3 : 5e-4)
          << i;
  }
}

TEST(TeachChain, TheMapOriginMayBeOffTheFloor) {
  const SE3 moved(SO3::exp({0, 0, 1}), {5, -2, -0.3});
  const auto result =
      map_by_chain(observe_lap(true_lap(), true_tags()), tag(0),
                   moved * true_tags().tags.at(tag(0)).map_T_tag, {.default_size_m = 0.16}, base_T_cam());
  ASSERT_TRUE(result);
  for (const auto& [id, mapped] : result->map.tags)
    EXPECT_LT(minus(mapped.map_T_tag, moved * true_tags().find(id)->map_T_tag).norm(), 1e-9);
}

/// The pose mirrored about the plane that faces the camera.
SE3 mirrored(const SE3& cam_T_tag) {
  const Eigen::Vector3d sight = cam_T_tag.translation().normalized();
  const Eigen::Vector3d normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = normal.cross(sight);
  const double angle = std::atan2(axis.norm(), normal.dot(sight));
  if (axis.norm() < 1e-9) return cam_T_tag;
  return {SO3::exp(axis.normalized() * 2 * angle) * cam_T_tag.rotation(), cam_T_tag.translation()};
}

// In four out of ten observations, the corners fit the wrong pose slightly better, as is common for distant
// tags. This cannot be resolved from a single frame.
TEST(TeachChain, AllFramesTogetherResolveWrongPoses) {
  Random random(5);
  auto frames = observe_lap(true_lap(), true_tags());
  int wrong = 0;
  for (ObservedFrame& frame : frames) {
    for (TagPoseObservation& seen : frame.tags) {
      const SE3 truth = seen.cam_T_tag;
      const bool is_wrong = random.uniform() < 0.4;
      wrong += is_wrong ? 1 : 0;
      if (is_wrong) seen.cam_T_tag = mirrored(truth);
      seen.other = TagPoseSolution{
          .cam_T_tag = is_wrong ? truth : mirrored(truth), .chi2 = 1, .covariance = seen.covariance};
    }
  }
  EXPECT_GT(wrong, 500);
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_LT(worst(result->map), 0.01);
}

TEST(TeachChain, NoisyFramesAreAveraged) {
  Random random(6);
  auto frames = observe_lap(true_lap(), true_tags());
  for (ObservedFrame& frame : frames) {
    for (TagPoseObservation& seen : frame.tags) {
      seen.covariance = PoseCovariance::Identity() * (0.02 * 0.02);
      seen.cam_T_tag = sample(Uncertain<SE3>{seen.cam_T_tag, seen.covariance}, random);
    }
  }
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_LT(worst(result->map), 0.06) << "the error of a link is that of two single observations";
}

TEST(TeachChain, ReportsUnconnectedTagsAndAMissingAnchor) {
  auto frames = observe_lap(true_lap(), true_tags());
  ObservedFrame alone{.stamp = SensorTime(std::chrono::seconds(100))};
  alone.tags.push_back({.tag = tag(40), .cam_T_tag = SE3({}, {0, 0, 1})});
  frames.push_back(alone);
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->unconnected, std::vector<TagId>{tag(40)});
  EXPECT_EQ(result->frames_without_pose, 1);

  const auto never = map_by_chain(frames, tag(99), {}, {.default_size_m = 0.16}, base_T_cam());
  ASSERT_FALSE(never);
  EXPECT_EQ(never.error().code, ErrorCode::NotFound);
  EXPECT_NE(never.error().message.find("tag36h11:99"), std::string::npos);
  testing::expect_on_page("map", never.error());
  EXPECT_FALSE(chain({}));
  EXPECT_FALSE(chain(frames, {.max_distance_m = -1}));
  const auto too_far = chain(frames, {.max_distance_m = 0.2});
  ASSERT_FALSE(too_far);
  testing::expect_on_page("map", too_far.error());
}

}  // namespace
}  // namespace waymark

namespace waymark::internal {
namespace {

const Eigen::Matrix3d kNoise = Eigen::Vector3d(4e-4, 4e-4, 9e-4).asDiagonal();
constexpr double kStep_m = 0.05;
constexpr double kRoom_m = 4;
constexpr double kBetween_m = 3;
constexpr int kTagsInRoom = 6;

TagId room_tag(int number) { return {FamilyId::TagStandard52h13, number}; }

struct Rooms {
  std::vector<FloorFrame> frames{};
  std::vector<Odometry> wheels{};
  std::vector<SE2> way{};
  std::map<TagId, SE2> truth{};
  std::set<TagId> first{};  ///< tags in the anchor's room
};

/// A path that bends to the left throughout. `drift` is the share by which odometry overestimates distances
/// and turns.
Rooms drive(int rooms, double drift, std::size_t anchor_room = 0, double noise = 0, std::uint64_t seed = 1) {
  Rooms world;
  Random random(seed);
  SE2 at;
  SE2 odom;
  const auto steps = [](double metres) { return static_cast<int>(std::lround(metres / kStep_m)); };
  for (int room = 0; room < rooms; ++room) {
    std::vector<TagId> here;
    for (int k = 0; k < kTagsInRoom; ++k) {
      here.push_back(room_tag(static_cast<int>(world.truth.size())));
      const double side = k % 2 == 0 ? 1 : -1;
      world.truth[here.back()] = at * SE2(1.2 + kRoom_m * k / kTagsInRoom, side, -2.5 * side);
    }
    if (static_cast<std::size_t>(room) == anchor_room) world.first = {here.begin(), here.end()};
    for (int i = 0; i < steps(kRoom_m) + steps(kBetween_m); ++i) {
      const SensorTime stamp{std::chrono::milliseconds(50 * static_cast<std::int64_t>(world.way.size()))};
      FloorFrame frame{.stamp = stamp};
      for (const TagId& id : here) {
        SE2 base_X_tag = at.inverse() * world.truth.at(id);
        if (base_X_tag.x() < 0.2 || base_X_tag.x() > 2.5 || std::abs(base_X_tag.y()) > 2) continue;
        base_X_tag =
            base_X_tag * SE2(noise * random.normal(), noise * random.normal(), noise * random.normal());
        frame.tags.push_back({id, {{{base_X_tag, 1e-4 * Eigen::Matrix3d::Identity()}, 0}}});
      }
      world.frames.push_back(frame);
      world.wheels.push_back({stamp, odom});
      world.way.push_back(at);
      const SE2::Tangent motion(kStep_m, 0, 0.004);
      at = at * SE2::exp(motion);
      odom = odom * SE2::exp((1 + drift) * motion);
    }
  }
  return world;
}

Places placed(const Rooms& world) {
  const Links links = links_of(world.frames);
  const TagId anchor = *world.first.begin();
  Places places = compose_from_anchor(links, anchor, world.truth.at(anchor));
  EXPECT_EQ(places.size(), world.first.size());
  place_islands(world.frames, links, OdometryTrack(world.wheels), kNoise, true, places);
  return places;
}

double worst(const Rooms& world, const Places& places) {
  double most = 0;
  for (const auto& [id, place] : places) most = std::max(most, minus(place.mean, world.truth.at(id)).norm());
  return most;
}

TEST(ChainIslands, PlacesRoomsByOdometry) {
  for (const std::size_t anchor_room : {0U, 2U, 4U}) {
    const Rooms world = drive(5, 0, anchor_room);
    const Places places = placed(world);
    EXPECT_EQ(places.size(), world.truth.size()) << anchor_room;
    EXPECT_LT(worst(world, places), 1e-6) << anchor_room;
  }
}

TEST(ChainIslands, RelativePosesWithinARoomDoNotDependOnOdometry) {
  const Rooms world = drive(5, 0.03);
  const Places places = placed(world);
  ASSERT_EQ(places.size(), world.truth.size());
  EXPECT_GT(worst(world, places), 0.1);  // the rooms were placed using odometry
  for (const auto& [a, place_a] : places) {
    for (const auto& [b, place_b] : places) {
      if (a.number / kTagsInRoom != b.number / kTagsInRoom) continue;
      const SE2 found = place_a.mean.inverse() * place_b.mean;
      EXPECT_LT(minus(found, world.truth.at(a).inverse() * world.truth.at(b)).norm(), 1e-6);
    }
  }
}

TEST(ChainIslands, DriftAffectsOnlyDistancesBetweenRooms) {
  constexpr double kDrift = 0.01;
  const Rooms world = drive(4, kDrift);
  // The distance bridged by odometry alone, which includes each gap and some frames in the next room.
  const double blind_m = 3 * (kBetween_m + 1.5);
  const double turned_rad = kDrift * 0.004 * blind_m / kStep_m;
  const double all_m = 4 * (kRoom_m + kBetween_m);
  EXPECT_LT(worst(world, placed(world)), kDrift * blind_m + turned_rad * all_m + turned_rad);
}

TEST(ChainIslands, NoiseOfOneFrameIsAveraged) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Rooms world = drive(2, 0, 0, 0.01, seed);
    const Places places = placed(world);
    ASSERT_EQ(places.size(), world.truth.size()) << seed;
    EXPECT_LT(worst(world, places), 0.15) << seed;
  }
}

TEST(ChainIslands, PlacedTagsDoNotMove) {
  const Rooms world = drive(3, 0.05);
  const Places places = placed(world);
  for (const TagId& id : world.first) EXPECT_LT(minus(places.at(id).mean, world.truth.at(id)).norm(), 1e-9);
}

TEST(ChainIslands, ATagWithFewFramesIsNotPlaced) {
  Rooms world = drive(2, 0);
  const TagId once = room_tag(99);
  int seen = 0;
  for (std::size_t f = 0; f < world.frames.size() && seen < 3; ++f) {
    if (!world.frames[f].tags.empty() || f < 50) continue;
    world.frames[f].tags.push_back({once, {{{SE2(1, 0.5, 2), 1e-4 * Eigen::Matrix3d::Identity()}, 0}}});
    ++seen;
  }
  ASSERT_EQ(seen, 3);
  const Places places = placed(world);
  EXPECT_FALSE(places.contains(once));
  EXPECT_EQ(places.size(), world.truth.size());
}

TEST(ChainIslands, NothingIsPlacedAcrossAGapInOdometry) {
  Rooms world = drive(2, 0);
  const auto middle = static_cast<std::ptrdiff_t>(world.wheels.size() / 2);
  world.wheels.erase(world.wheels.begin() + middle - 20, world.wheels.begin() + middle + 80);
  world.wheels.erase(world.wheels.begin() + middle - 20, world.wheels.end());
  EXPECT_EQ(placed(world).size(), world.first.size());
}

}  // namespace
}  // namespace waymark::internal
