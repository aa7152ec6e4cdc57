#include "waymark/app/world/lay_world.hpp"

#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/world/world.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

RobotDescription limo() { return read_robot(WAYMARK_SHARE "/robots/limo.yaml").value(); }

class LayWorld : public ::testing::Test {
 protected:
  Result<LayWorldReport> laid(const std::string& table) {
    EXPECT_TRUE(write_text_file(folder_ / "line.csv", table));
    JobControl control;
    control.note = [this](const std::string& words) { notes_.push_back(words); };
    return lay_world({.path = (folder_ / "line.csv").string(), .output = output_.string(), .robot = limo()},
                     control);
  }
  std::vector<std::string> notes_;
  fs::path folder_ = testing::fresh_folder("jobs_world");
  fs::path output_ = folder_ / "world.yaml";
};

TEST_F(LayWorld, WritesAReadableWorldForALineFromATable) {
  std::string table = "t,y_m,x_m\n";
  for (int i = 0; i < 30; ++i) table += fmt::format("{},0,{}\n", i, 0.2 * i);
  const auto report = laid(table);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_FALSE(report->world.path_closed);
  EXPECT_NEAR(report->check.lap_m, 5.8, 0.2);
  EXPECT_EQ(read_world(output_).value().tags.tags.size(), report->world.tags.tags.size());
  EXPECT_EQ(to_json(fields(*report))["tags"], report->world.tags.tags.size());
}

TEST_F(LayWorld, RenamesAnExistingWorld) {
  ASSERT_TRUE(write_text_file(output_, "mine: 1\n"));
  ASSERT_TRUE(laid("x,y\n0,0\n2,0\n4,0\n"));
  EXPECT_THAT(notes_, ElementsAre(HasSubstr((folder_ / "world.1.yaml").string())));
  EXPECT_EQ(read_text_file(folder_ / "world.1.yaml", 100), std::string("mine: 1\n"));
  EXPECT_TRUE(read_world(output_));
}

TEST_F(LayWorld, RejectsInvalidLines) {
  const auto no_point = laid("x,y\n0,0\nhere,there\n");
  ASSERT_FALSE(no_point);
  EXPECT_EQ(no_point.error().place.line, 3);
  EXPECT_FALSE(laid("0,0\n0.2,0\n")) << "two points are too few";
  const auto millimetres = laid("0,0\n2000,0\n4000,0\n");
  ASSERT_FALSE(millimetres);
  EXPECT_EQ(millimetres.error().code, ErrorCode::LimitExceeded);
  EXPECT_THAT(millimetres.error().hint, HasSubstr("millimetres"));
  EXPECT_FALSE(fs::exists(output_));
}

/// Points 0.1 m apart along straight segments ('u') and arcs with a radius of 1 m to the left ('l') and right
/// ('r').
std::string table_of(const std::vector<std::pair<char, double>>& parts) {
  std::string table = "x,y\n";
  SE2 at;
  for (const auto& [kind, length_m] : parts) {
    const double curvature_1_m = kind == 'l' ? 1 : (kind == 'r' ? -1 : 0);
    const int steps = static_cast<int>(std::lround(length_m / 0.1));
    for (int i = 0; i < steps; ++i) {
      table += fmt::format("{:.4f},{:.4f}\n", at.x(), at.y());
      at = at * SE2::exp({length_m / steps, 0, curvature_1_m * length_m / steps});
    }
  }
  return table + fmt::format("{:.4f},{:.4f}\n", at.x(), at.y());
}

World line_of_table(const fs::path& file, const std::string& table, const JobControl& control = {}) {
  EXPECT_TRUE(write_text_file(file, table));
  const auto world = read_line(file.string(), control);
  EXPECT_TRUE(world) << to_string(world.error());
  return world ? *world : World();
}

double length_of(const World& world) {
  return sample_path(world.path_m, world.path_closed, 0.02).back().arc_length_m;
}

TEST_F(LayWorld, CutsALineOnlyIfItRepeatsItsLoop) {
  const fs::path file = folder_ / "line.csv";
  const double half_m = std::numbers::pi;
  const std::vector<std::pair<char, double>> left{{'u', 4}, {'l', half_m}, {'u', 4}, {'l', half_m}};
  const std::vector<std::pair<char, double>> right{{'u', 4}, {'r', half_m}, {'u', 4}, {'r', half_m}};
  const double loop_m = 8 + 2 * half_m;
  auto parts = left;
  parts.insert(parts.end(), right.begin(), right.end());
  World line = line_of_table(file, table_of(parts));
  EXPECT_TRUE(line.path_closed);
  EXPECT_NEAR(length_of(line), 2 * loop_m, 0.3) << "two different loops";

  parts = left;
  parts.insert(parts.end(), left.begin(), left.end());
  JobControl control;
  control.note = [this](const std::string& words) { notes_.push_back(words); };
  line = line_of_table(file, table_of(parts), control);
  EXPECT_TRUE(line.path_closed);
  EXPECT_NEAR(length_of(line), loop_m, 0.3) << "one loop that was driven twice";
  EXPECT_THAT(notes_, ElementsAre(HasSubstr("repeat")));

  line = line_of_table(file, table_of({{'u', 5}, {'l', half_m}, {'u', 7}}));
  EXPECT_FALSE(line.path_closed) << "it returns without closing a loop";
  EXPECT_NEAR(length_of(line), 12 + half_m, 0.3);
}

TEST_F(LayWorld, ADrawnPolygonMayBeginAtACorner) {
  const World square = line_of_table(folder_ / "line.csv", "0,0\n3,0\n3,3\n0,3\n0,0\n");
  EXPECT_TRUE(square.path_closed);
  EXPECT_EQ(square.path_m.size(), 4U);
  EXPECT_FALSE(line_of_table(folder_ / "line.csv", "0,0\n3,0\n3,3\n3,0\n0,0\n").path_closed)
      << "it returns along the same line";
}

TEST_F(LayWorld, ADriveThatReturnsToItsStartIsALap) {
  const std::string lap = test::record_lap(folder_ / "lap.mcap", 4);
  const auto report = lay_world({.path = lap, .output = output_.string(), .robot = limo()}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(report->world.path_closed);
  const auto profile = profile_of(lap, {});
  ASSERT_TRUE(profile) << to_string(profile.error());
  SimulatedRobotOptions usual;
  const SimulatedRobotOptions like = options_like(*profile, usual);
  EXPECT_NEAR(like.camera_rate_hz, usual.camera_rate_hz, 0.1 * usual.camera_rate_hz);
  EXPECT_NEAR(like.odometry_rate_hz, usual.odometry_rate_hz, 0.1 * usual.odometry_rate_hz);
  EXPECT_FALSE(profile_table(*profile, *profile).empty());
}

TEST(NewWorld, IsRejectedIfTheFileExists) {
  const auto folder = testing::fresh_folder("jobs_new_world");
  EXPECT_TRUE(check_new_world((folder / "a.yaml").string()));
  ASSERT_TRUE(write_text_file(folder / "a.yaml", "x"));
  const Status existing = check_new_world((folder / "a.yaml").string());
  ASSERT_FALSE(existing);
  EXPECT_EQ(existing.error().place.source, folder / "a.yaml");
  EXPECT_THAT(existing.error().message, HasSubstr("exists"));
  EXPECT_FALSE(check_new_world("/nowhere/a.yaml"));
}

}  // namespace
}  // namespace waymark
