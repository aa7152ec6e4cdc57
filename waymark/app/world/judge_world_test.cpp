#include "waymark/app/world/judge_world.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

TEST(JudgeWorld, TheCircuitIsGoodAndASlipOfUnitsIsDoubted) {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const auto good = judge_world(test::circuit(), robot.model, robot.camera, {});
  ASSERT_TRUE(good) << to_string(good.error());
  EXPECT_TRUE(good->good);
  EXPECT_NE(nearest_tag(good->check), "no tag");
  const auto json = to_json(*good, test::circuit(), robot.model);
  EXPECT_EQ(json["tags"], 24);
  EXPECT_GE(json["two_tags_fraction"].get<double>(), kGoodLapTwoTags);
  World large = test::circuit();
  large.tags.tags.begin()->second.size_m = 160;
  const auto doubted = judge_world(large, robot.model, robot.camera, {});
  ASSERT_TRUE(doubted);
  EXPECT_FALSE(doubted->good);
  EXPECT_THAT(doubted->doubts, Contains(HasSubstr("millimetres")));
  World sparse = test::circuit();
  while (sparse.tags.tags.size() > 2) sparse.tags.tags.erase(std::prev(sparse.tags.tags.end()));
  EXPECT_FALSE(judge_world(sparse, robot.model, robot.camera, {})->good) << "too few tags are seen";
}

}  // namespace
}  // namespace waymark
