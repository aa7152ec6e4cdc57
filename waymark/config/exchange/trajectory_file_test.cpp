#include "waymark/config/exchange/trajectory_file.hpp"

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

std::string error_of(const std::string& text) {
  const auto trajectory = parse_trajectory(text, "t.txt");
  return trajectory ? "none" : to_string(trajectory.error());
}

TEST(TrajectoryFile, RoundTripsToTheNanosecond) {
  Random random(2);
  Trajectory trajectory;
  for (const std::int64_t start : {-1'500'000'001LL, 0LL, 1'732'200'000'123'456'789LL}) {
    for (int i = 0; i < 5; ++i) {
      SE3::Tangent xi;
      for (double& x : xi) x = random.normal();
      trajectory.push_back({SensorTime(Duration(start + 100 * i)), SE3::exp(xi)});
    }
  }
  const auto back = parse_trajectory(to_tum(trajectory), "t.txt");
  ASSERT_TRUE(back) << to_string(back.error());
  ASSERT_EQ(back->size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    EXPECT_EQ((*back)[i].stamp, trajectory[i].stamp);
    EXPECT_EQ((*back)[i].map_T_base.translation(), trajectory[i].map_T_base.translation());
    EXPECT_LT(((*back)[i].map_T_base.inverse() * trajectory[i].map_T_base).log().norm(), 1e-15);
  }
}

TEST(TrajectoryFile, ReadsFilesOfOtherPrograms) {
  const auto one =
      parse_trajectory("# a comment\n\n1305031102.1758 1 2 3 0 0 0 1\r\n1.4e9, 0, 0, 0, 0, 0, 0, 1", "t");
  ASSERT_TRUE(one) << to_string(one.error());
  EXPECT_EQ((*one)[0].stamp.time_since_epoch().count(), 1'305'031'102'175'800'000);
  EXPECT_TRUE(parse_trajectory("", "t")->empty());
}

TEST(TrajectoryFile, ReportsFileAndLineOfInvalidLines) {
  EXPECT_TRUE((error_of("1 0 0 0 0 0 0\n")).starts_with("t.txt:1: "));
  testing::expect_on_page("config", error_of("1 0 0 0 0 0 0\n"));
  EXPECT_NE(error_of("# x\n1 0 0 nan 0 0 0 1\n").find("t.txt:2"), std::string::npos);
  EXPECT_NE(error_of("1 0 0 0 0 0 0 0\n").find("t.txt:1"), std::string::npos);
  EXPECT_NE(error_of("99999999999999999999 0 0 0 0 0 0 1\n").find("t.txt:1"), std::string::npos);
  EXPECT_TRUE((error_of("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n")).starts_with("t.txt:2: "));
  testing::expect_on_page("config", error_of("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"));
}

}  // namespace
}  // namespace waymark
