#include "waymark/recording/ros2/frame_tree.hpp"

#include <algorithm>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

SE3 shifted(double x_m, double yaw_rad = 0) { return {SO3::from_rpy(0, 0, yaw_rad), {x_m, 0, 0}}; }
bool nearly_same(const SE3& a, const SE3& b) { return (a.inverse() * b).log().norm() < 1e-9; }

/// map - odom - base - arm - hand, and base - camera - optical.
FrameTree robot_tree() {
  FrameTree tree;
  tree.add("map", "odom", shifted(1));
  tree.add("odom", "base", shifted(2, 0.5));
  tree.add("base", "arm", shifted(0.1, -0.2));
  tree.add("arm", "hand", shifted(0.2, 0.1));
  tree.add("base", "camera", shifted(0.3, 0.3));
  tree.add("camera", "optical", shifted(0.01, 1));
  return tree;
}

TEST(FrameTree, AChainIsTheProductOfItsLinksUpAndDown) {
  const FrameTree tree = robot_tree();
  const auto down = tree.chain("base", "optical");
  ASSERT_TRUE(down) << to_string(down.error());
  EXPECT_TRUE(nearly_same(*down, shifted(0.3, 0.3) * shifted(0.01, 1)));
  const auto up = tree.chain("optical", "base");
  ASSERT_TRUE(up);
  EXPECT_TRUE(nearly_same(*up, down->inverse()));
  const auto across = tree.chain("hand", "optical");
  ASSERT_TRUE(across);
  EXPECT_TRUE(nearly_same(*across, (shifted(0.1, -0.2) * shifted(0.2, 0.1)).inverse() * *down));
  EXPECT_TRUE(nearly_same(*tree.chain("hand", "hand"), SE3()));
}

TEST(FrameTree, TheOrderInWhichLinksAreToldDoesNotCount) {
  struct Told {
    const char* parent;
    const char* child;
    SE3 transform;
  };
  std::vector<Told> links = {{"a", "b", shifted(1, 0.1)},
                             {"b", "c", shifted(2, 0.2)},
                             {"c", "d", shifted(3, 0.3)},
                             {"b", "e", shifted(4)}};
  const SE3 expected = (shifted(2, 0.2) * shifted(3, 0.3)).inverse() * shifted(4);
  std::ranges::sort(links, {}, [](const Told& link) { return link.child; });
  do {
    FrameTree tree;
    for (const Told& link : links) tree.add(link.parent, link.child, link.transform);
    const auto chain = tree.chain("d", "e");
    ASSERT_TRUE(chain) << to_string(chain.error());
    EXPECT_TRUE(nearly_same(*chain, expected));
  } while (std::ranges::next_permutation(links, {}, [](const Told& link) { return link.child; }).found);
}

TEST(FrameTree, NamesWithAndWithoutSlashAreTheSame) {
  EXPECT_EQ(frame_name("//base"), "base");
  FrameTree tree;
  tree.add("/base", "camera", shifted(1));
  tree.add("base", "/camera", shifted(1));
  EXPECT_TRUE(tree.chain("base", "camera"));
  EXPECT_EQ(tree.frames().size(), 2U);
}

TEST(FrameTree, JoinedAndBelowFollowTheLinks) {
  FrameTree tree = robot_tree();
  tree.add("elsewhere", "other", shifted(1));
  EXPECT_TRUE(tree.joined("hand", "optical"));
  EXPECT_FALSE(tree.joined("hand", "other"));
  EXPECT_FALSE(tree.joined("hand", "nowhere"));
  EXPECT_TRUE(tree.below("odom", "optical"));
  EXPECT_FALSE(tree.below("optical", "odom"));
  EXPECT_FALSE(tree.below("arm", "optical"));
}

std::string refused(const FrameTree& tree, const std::string& from, const std::string& to) {
  const auto chain = tree.chain(from, to);
  EXPECT_FALSE(chain);
  return chain ? "" : to_string(chain.error());
}

TEST(FrameTree, WhatMovesHasTwoParentsOrNoNumbersIsNoLink) {
  FrameTree moving = robot_tree();
  moving.add("base", "camera", shifted(0.3004, 0.3));
  EXPECT_TRUE(moving.chain("base", "optical")) << "less than a millimetre is rounding";
  moving.add("base", "camera", shifted(0.302, 0.3));
  EXPECT_THAT(refused(moving, "base", "optical"), HasSubstr("moves"));
  EXPECT_TRUE(moving.chain("base", "hand")) << "the other links are as they were";

  FrameTree twice = robot_tree();
  twice.add("arm", "camera", shifted(0.1));
  EXPECT_THAT(refused(twice, "base", "camera"), HasSubstr("another parent too: arm"));

  FrameTree broken = robot_tree();
  broken.add("base", "camera", std::nullopt);
  EXPECT_THAT(refused(broken, "base", "camera"), HasSubstr("numbers that are none"));
  broken.add("base", "camera", shifted(0.3, 0.3));
  EXPECT_FALSE(broken.chain("base", "camera")) << "a sound message does not make up for it";
}

TEST(FrameTree, ACircleEndsAndIsNamed) {
  FrameTree tree;
  tree.add("a", "b", shifted(1));
  tree.add("b", "c", shifted(1));
  tree.add("c", "a", shifted(1));
  tree.add("outside", "d", shifted(1));
  EXPECT_FALSE(tree.joined("a", "d"));
  EXPECT_THAT(refused(tree, "a", "d"), HasSubstr("no chain"));
  EXPECT_THAT(tree.text(), HasSubstr("a"));
  EXPECT_THAT(refused(tree, "a", "c"), HasSubstr("go round in a circle: c -> a -> b -> c"))
      << "where it is left decides which transforms are composed";
  EXPECT_THAT(refused(tree, "c", "a"), HasSubstr("a -> b -> c -> a"));
  FrameTree self;
  self.add("a", "a", shifted(1));
  EXPECT_FALSE(self.text().empty());
  EXPECT_FALSE(self.joined("a", "b"));
}

TEST(FrameTree, AnErrorShowsTheTreeWithWhatIsDoubtful) {
  FrameTree tree = robot_tree();
  tree.add("base", "camera", shifted(5));
  const std::string words = refused(tree, "base", "nowhere");
  EXPECT_THAT(words, HasSubstr("no transform has the frame 'nowhere'"));
  EXPECT_THAT(words, HasSubstr("\n        camera  (moves)\n          optical"));
  EXPECT_THAT(words, HasSubstr("`base_frame`"));
  EXPECT_THAT(refused(FrameTree(), "a", "b"), HasSubstr("there are no transforms"));
}

TEST(FrameTree, ATreeWithoutEndIsCutWhereItIsShownAndWhereItIsKept) {
  FrameTree tree;
  for (int i = 0; i < 12'000; ++i)
    tree.add("f" + std::to_string(i), "f" + std::to_string(i + 1), shifted(0.001));
  EXPECT_LE(tree.frames().size(), 10'001U);
  EXPECT_LT(tree.text().size(), 10'000U);
  EXPECT_THAT(tree.text(), HasSubstr("more"));
  const auto chain = tree.chain("f0", "f500");
  ASSERT_TRUE(chain);
  EXPECT_NEAR(chain->translation().x(), 0.5, 1e-9);
}

}  // namespace
}  // namespace waymark
