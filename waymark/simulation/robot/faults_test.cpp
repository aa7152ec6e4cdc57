#include "waymark/simulation/robot/faults.hpp"

#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

World two_tags() {
  World world{.name = "two"};
  for (const int i : {0, 1})
    world.tags.tags[tag(i)] = {.map_T_tag = upright_tag({1.0 + i, 0, 0.3}, 0), .size_m = 0.16};
  return world;
}

Eigen::Vector3d place(const World& world, int number) {
  return world.tags.find(tag(number))->map_T_tag.translation();
}

TEST(Faults, TagFaultsAreAppliedAndReverted) {
  const World world = two_tags();
  const std::vector<Fault> faults{
      {.kind = FaultKind::TagMoved,
       .at_s = 1,
       .for_s = 2,
       .tag = tag(0),
       .shift_m = {0, 0.5, 0},
       .turn_rad = std::numbers::pi / 2},
      {.kind = FaultKind::TagsSwapped, .at_s = 4, .for_s = 1, .tag = tag(0), .other = tag(1)},
      {.kind = FaultKind::TagRemoved, .at_s = 6, .tag = tag(1)},
      {.kind = FaultKind::TagDuplicated, .at_s = 6, .tag = tag(0), .map_T_copy = upright_tag({9, 9, 1}, 0)}};
  const auto at = [&](double now_s) { return with_tag_faults(world, faults, now_s); };
  EXPECT_EQ(place(at(0.9), 0), Eigen::Vector3d(1, 0, 0.3));
  EXPECT_EQ(place(at(1), 0), Eigen::Vector3d(1, 0.5, 0.3));
  const SE3 turned = at(2.9).tags.find(tag(0))->map_T_tag;
  EXPECT_TRUE(turned.rotation().matrix().isApprox(
      upright_tag({0, 0, 0}, std::numbers::pi / 2).rotation().matrix(), 1e-12));
  EXPECT_EQ(place(at(3), 0), Eigen::Vector3d(1, 0, 0.3));
  EXPECT_EQ(place(at(4.5), 0), Eigen::Vector3d(2, 0, 0.3));
  EXPECT_EQ(place(at(4.5), 1), Eigen::Vector3d(1, 0, 0.3));
  const World end = at(100);
  EXPECT_EQ(end.tags.find(tag(1)), nullptr);
  ASSERT_EQ(end.copies.size(), 1U);
  EXPECT_EQ(end.copies[0].placed.map_T_tag.translation(), Eigen::Vector3d(9, 9, 1));
  EXPECT_EQ(end.copies[0].placed.size_m, 0.16);

  std::vector<double> moments{0};
  while (next_tag_change_s(faults, moments.back()) < std::numeric_limits<double>::infinity())
    moments.push_back(next_tag_change_s(faults, moments.back()));
  EXPECT_EQ(moments, (std::vector<double>{0, 1, 3, 4, 5, 6}));
}

TEST(Faults, AreActiveFromBeginToEnd) {
  const Fault blackout{.kind = FaultKind::CameraBlackout, .at_s = 1, .for_s = 2};
  EXPECT_FALSE(active(blackout, 0.999));
  EXPECT_TRUE(active(blackout, 1));
  EXPECT_TRUE(active(blackout, 2.999));
  EXPECT_FALSE(active(blackout, 3));
  EXPECT_TRUE(active(Fault{.kind = FaultKind::ClockJump, .at_s = 1, .for_s = 2}, 50))
      << "a clock jump is permanent";
  EXPECT_FALSE(active(std::vector{blackout}, FaultKind::CameraFrozen, 2));
}

TEST(Faults, InvalidFaultsAreRejected) {
  const World world = two_tags();
  EXPECT_TRUE(check(std::vector{Fault{.kind = FaultKind::TagRemoved, .tag = tag(1)}}, world));
  const auto expect_error = [&](const Fault& fault, const std::string& text) {
    const Status status = check(std::vector{fault}, world);
    ASSERT_FALSE(status) << text;
    EXPECT_EQ(status.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(status.error().place.key, "faults[0]");
    EXPECT_NE(status.error().message.find(text), std::string::npos) << status.error().message;
    testing::expect_on_page("simulation", status.error());
  };
  expect_error({.kind = FaultKind::TagRemoved, .tag = tag(7)}, "tag36h11:7");
  expect_error({.kind = FaultKind::TagsSwapped, .tag = tag(0), .other = tag(7)}, "tag36h11:7");
  expect_error({.at_s = -1}, "at_s");
  expect_error({.for_s = 0}, "for_s");
  expect_error({.kind = FaultKind::SlipBurst, .speed_share = 2}, "share");
}

}  // namespace
}  // namespace waymark
