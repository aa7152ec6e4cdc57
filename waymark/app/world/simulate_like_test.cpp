#include "waymark/app/world/simulate_like.hpp"

#include <filesystem>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

TEST(SimulateLike, MatchesDurationSpeedAndRatesOfTheRecording) {
  const std::filesystem::path folder = testing::fresh_folder("simulate_like");
  const std::string lap = (folder / "lap.mcap").string();
  const RobotSetup setup = load_setup("circuit24", "", 1).value();
  ASSERT_TRUE(teach_lap(setup, {.output = lap, .speed_m_s = 0.2}, {}));
  const auto like = profile_of(lap, {});
  ASSERT_TRUE(like) << to_string(like.error());
  const auto made = simulate_like(setup, *like, {.like = lap, .output = (folder / "made.mcap").string()}, {});
  ASSERT_TRUE(made) << to_string(made.error());
  EXPECT_NEAR(made->duration_s, like->duration_s, 1);
  EXPECT_NEAR(made->mean_speed_m_s, like->mean_speed_m_s, 0.05 * like->mean_speed_m_s);
  EXPECT_NEAR(made->streams.at("odometry").rate_hz, like->streams.at("odometry").rate_hz, 1);
}

}  // namespace
}  // namespace waymark
