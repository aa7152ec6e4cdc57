// Rooms between which no tag is seen, driven one after the other with wheels that drift.
#include "waymark/mapping/lap/chain_islands.hpp"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark::internal {
namespace {

const Eigen::Matrix3d kNoise = Eigen::Vector3d(4e-4, 4e-4, 9e-4).asDiagonal();
constexpr double kStep_m = 0.05;
constexpr double kRoom_m = 4;
constexpr double kBetween_m = 3;
constexpr int kTagsInRoom = 6;

TagId tag(int number) { return {FamilyId::TagStandard52h13, number}; }

struct Rooms {
  std::vector<FloorFrame> frames{};
  std::vector<Odometry> wheels{};
  std::vector<SE2> way{};
  std::map<TagId, SE2> truth{};
  std::set<TagId> first{};  ///< of the room that the anchor is in
};

/// The way bends to the left all along; `drift`: how much too far the wheels say that it went and turned.
Rooms drive(int rooms, double drift, std::size_t anchor_room = 0, double noise = 0, std::uint64_t seed = 1) {
  Rooms world;
  Random random(seed);
  SE2 at;
  SE2 odom;
  const auto steps = [](double metres) { return static_cast<int>(std::lround(metres / kStep_m)); };
  for (int room = 0; room < rooms; ++room) {
    std::vector<TagId> here;
    for (int k = 0; k < kTagsInRoom; ++k) {
      here.push_back(tag(static_cast<int>(world.truth.size())));
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

TEST(ChainIslands, WheelsLeadFromRoomToRoom) {
  for (const std::size_t anchor_room : {0U, 2U, 4U}) {
    const Rooms world = drive(5, 0, anchor_room);
    const Places places = placed(world);
    EXPECT_EQ(places.size(), world.truth.size()) << anchor_room;
    EXPECT_LT(worst(world, places), 1e-6) << anchor_room;
  }
}

TEST(ChainIslands, HowTagsOfARoomStandToEachOtherDoesNotDependOnTheWheels) {
  const Rooms world = drive(5, 0.03);
  const Places places = placed(world);
  ASSERT_EQ(places.size(), world.truth.size());
  EXPECT_GT(worst(world, places), 0.1);  // the rooms are where the wheels have them
  for (const auto& [a, place_a] : places) {
    for (const auto& [b, place_b] : places) {
      if (a.number / kTagsInRoom != b.number / kTagsInRoom) continue;
      const SE2 found = place_a.mean.inverse() * place_b.mean;
      EXPECT_LT(minus(found, world.truth.at(a).inverse() * world.truth.at(b)).norm(), 1e-6);
    }
  }
}

TEST(ChainIslands, DriftCountsBetweenRoomsOnly) {
  constexpr double kDrift = 0.01;
  const Rooms world = drive(4, kDrift);
  // Over what the wheels alone lead: each gap, and some frames of the room after it.
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

TEST(ChainIslands, WhatIsPlacedStays) {
  const Rooms world = drive(3, 0.05);
  const Places places = placed(world);
  for (const TagId& id : world.first) EXPECT_LT(minus(places.at(id).mean, world.truth.at(id)).norm(), 1e-9);
}

TEST(ChainIslands, ATagThatFewFramesSawIsLeftOut) {
  Rooms world = drive(2, 0);
  const TagId once = tag(99);
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

TEST(ChainIslands, WithoutWheelsThereAndBackNothingIsPlaced) {
  Rooms world = drive(2, 0);
  const auto middle = static_cast<std::ptrdiff_t>(world.wheels.size() / 2);
  world.wheels.erase(world.wheels.begin() + middle - 20, world.wheels.begin() + middle + 80);
  world.wheels.erase(world.wheels.begin() + middle - 20, world.wheels.end());
  EXPECT_EQ(placed(world).size(), world.first.size());
}

}  // namespace
}  // namespace waymark::internal
