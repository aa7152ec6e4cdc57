#include "waymark/recording/ros2/frame_tree.hpp"

#include <algorithm>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
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

TEST(FrameTree, AChainIsTheProductOfItsTransforms) {
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

TEST(FrameTree, TheOrderOfTransformsDoesNotMatter) {
  struct NamedTransform {
    const char* parent;
    const char* child;
    SE3 transform;
  };
  std::vector<NamedTransform> links = {{"a", "b", shifted(1, 0.1)},
                                       {"b", "c", shifted(2, 0.2)},
                                       {"c", "d", shifted(3, 0.3)},
                                       {"b", "e", shifted(4)}};
  const SE3 expected = (shifted(2, 0.2) * shifted(3, 0.3)).inverse() * shifted(4);
  std::ranges::sort(links, {}, [](const NamedTransform& link) { return link.child; });
  do {
    FrameTree tree;
    for (const NamedTransform& link : links) tree.add(link.parent, link.child, link.transform);
    const auto chain = tree.chain("d", "e");
    ASSERT_TRUE(chain) << to_string(chain.error());
    EXPECT_TRUE(nearly_same(*chain, expected));
  } while (
      std::ranges::next_permutation(links, {}, [](const NamedTransform& link) { return link.child; }).found);
}

TEST(FrameTree, LeadingSlashesAreIgnored) {
  EXPECT_EQ(frame_name("//base"), "base");
  FrameTree tree;
  tree.add("/base", "camera", shifted(1));
  tree.add("base", "/camera", shifted(1));
  EXPECT_TRUE(tree.chain("base", "camera"));
  EXPECT_EQ(tree.frames().size(), 2U);
}

TEST(FrameTree, JoinedAndBelowFollowTheTransforms) {
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

TEST(FrameTree, RejectsTransformsThatMoveHaveTwoParentsOrInvalidValues) {
  FrameTree moving = robot_tree();
  moving.add("base", "camera", shifted(0.3004, 0.3));
  EXPECT_TRUE(moving.chain("base", "optical")) << "less than a millimetre counts as rounding";
  moving.add("base", "camera", shifted(0.302, 0.3));
  EXPECT_THAT(refused(moving, "base", "optical"), HasSubstr("moves"));
  EXPECT_TRUE(moving.chain("base", "hand")) << "other transforms are not affected";

  FrameTree twice = robot_tree();
  twice.add("arm", "camera", shifted(0.1));
  EXPECT_THAT(refused(twice, "base", "camera"), HasSubstr("arm"));
  testing::expect_on_page("recording", refused(twice, "base", "camera"));

  FrameTree broken = robot_tree();
  broken.add("base", "camera", std::nullopt);
  testing::expect_on_page("recording", refused(broken, "base", "camera"));
  broken.add("base", "camera", shifted(0.3, 0.3));
  EXPECT_FALSE(broken.chain("base", "camera")) << "a later valid message does not repair it";
}

TEST(FrameTree, ACycleTerminatesAndIsReported) {
  FrameTree tree;
  tree.add("a", "b", shifted(1));
  tree.add("b", "c", shifted(1));
  tree.add("c", "a", shifted(1));
  tree.add("outside", "d", shifted(1));
  EXPECT_FALSE(tree.joined("a", "d"));
  testing::expect_on_page("recording", refused(tree, "a", "d"));
  EXPECT_THAT(tree.text(), HasSubstr("a"));
  EXPECT_THAT(refused(tree, "a", "c"), HasSubstr("c -> a -> b -> c"))
      << "the result depends on where the cycle is left";
  testing::expect_on_page("recording", refused(tree, "a", "c"));
  EXPECT_THAT(refused(tree, "c", "a"), HasSubstr("a -> b -> c -> a"));
  FrameTree self;
  self.add("a", "a", shifted(1));
  EXPECT_FALSE(self.text().empty());
  EXPECT_FALSE(self.joined("a", "b"));
}

TEST(FrameTree, AnErrorShowsTheTreeWithItsProblems) {
  FrameTree tree = robot_tree();
  tree.add("base", "camera", shifted(5));
  const std::string words = refused(tree, "base", "nowhere");
  EXPECT_THAT(words, HasSubstr("'nowhere'"));
  testing::expect_on_page("recording", words);
  EXPECT_THAT(words, HasSubstr("\n        camera  (moves)\n          optical"));
  EXPECT_THAT(words, HasSubstr("`base_frame`"));
  testing::expect_on_page("recording", refused(FrameTree(), "a", "b"));
}

TEST(FrameTree, LimitsTheStoredAndTheShownFrames) {
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
