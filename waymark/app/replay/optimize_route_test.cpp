#include "waymark/app/replay/optimize_route.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/replay/route_builder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// A map folder for circuit24 with the route of a lap.
class OptimizeRoute : public ::testing::Test {
 protected:
  void SetUp() override {
    static const Route taught = build_route(test::drive(6).truth).value();
    ASSERT_TRUE(
        write_map(folder_ / "map.yaml", {.tags = test::circuit().tags, .anchor = test::circuit().anchor}));
    ASSERT_TRUE(write_route(folder_ / "route.yaml", with_map(taught, test::circuit().tags)));
    ASSERT_TRUE(write_text_file(folder_ / "robot.yaml", test::file_text(WAYMARK_SHARE "/robots/limo.yaml")));
  }
  fs::path folder_ = testing::fresh_folder("jobs_optimize");
  OptimizeJob job_{.folder = folder_.string()};
};

TEST_F(OptimizeRoute, IsFasterKeepsTheClearanceAndBelongsToTheMap) {
  const auto report = optimize_route_of(job_);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_LE(report->found.optimized.lap_s, report->found.taught.lap_s + 1e-9);
  EXPECT_GT(report->found.optimized.min_clearance_m, 0.1);
  const Route route = read_route(folder_ / "route-best.yaml").value();
  EXPECT_TRUE(check_map(route, test::circuit().tags, "route-best.yaml"));
  EXPECT_FALSE(route.map_tags.empty()) << "records the tags of its map";
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["route"], "best");
  EXPECT_EQ(json["files"].size(), 2U);
  for (const auto& file : json["files"]) EXPECT_TRUE(fs::exists(file.get<std::string>())) << file;
  EXPECT_EQ(json["optimized"]["lap_s"], report->found.optimized.lap_s);
}

TEST_F(OptimizeRoute, TheCommandReplaysTheOptimisedSpeed) {
  EXPECT_EQ(drive_command(job_), "waymark replay " + folder_.string() + " route=best");
  job_.profile.speed_m_s = 0.9;
  job_.profile.lateral_acceleration_m_s2 *= 2;
  EXPECT_THAT(drive_command(job_), HasSubstr("max_speed_m_s=0.9")) << "above the default limit";
  EXPECT_THAT(drive_command(job_), HasSubstr(" lateral_acceleration_m_s2="));
  EXPECT_THAT(drive_command(job_), Not(HasSubstr(" speed_m_s="))) << "the route contains the speed";
  job_.folder = "my maps/one";
  EXPECT_THAT(drive_command(job_), HasSubstr("'my maps/one'"));
}

TEST_F(OptimizeRoute, ErrorsNameTheFileAndNothingIsWritten) {
  const auto place = [&] {
    const auto before = test::names_in(folder_);
    const auto report = optimize_route_of(job_);
    EXPECT_FALSE(report);
    EXPECT_EQ(test::names_in(folder_), before);
    return report ? std::string() : report.error().place.source;
  };
  ASSERT_TRUE(write_text_file(folder_ / "robot.yaml", "name: [limo"));
  EXPECT_EQ(place(), (folder_ / "robot.yaml").string());
  fs::remove(folder_ / "route.yaml");
  EXPECT_EQ(place(), (folder_ / "route.yaml").string());
  fs::remove(folder_ / "map.yaml");
  EXPECT_EQ(place(), folder_.string()) << "not a map folder";
}

TEST_F(OptimizeRoute, UsesTheDefaultRobotWithoutRobotFile) {
  fs::remove(folder_ / "robot.yaml");
  const auto report = optimize_route_of(job_);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(fs::exists(folder_ / "route-best.yaml"));
}

}  // namespace
}  // namespace waymark
