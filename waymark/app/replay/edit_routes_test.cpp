#include "waymark/app/replay/edit_routes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/map/convert_map.hpp"
#include "waymark/app/replay/optimize_route.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/route_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;

Route straight() {
  Route route{.length_m = 4};
  for (int i = 0; i <= 40; ++i)
    route.points.push_back({.map_T_base = SE2(0.1 * i, 0, 0), .arc_length_m = 0.1 * i, .speed_m_s = 0.3});
  return route;
}

/// A map with one tag next to a straight 4 m route.
class EditRoutes : public ::testing::Test {
 protected:
  void SetUp() override {
    MapFile map{.anchor = {FamilyId::Tag36h11, 7}};
    map.tags.tags[map.anchor] = {.map_T_tag = SE3(SO3(), {3, 1, 0.3}), .size_m = 0.16};
    ASSERT_TRUE(write_map(folder_ / "map.yaml", map));
    ASSERT_TRUE(write_route(folder_ / "route.yaml", straight()));
  }
  [[nodiscard]] std::vector<Station> stations() const {
    return read_route(folder_ / "route.yaml").value().stations;
  }

  fs::path folder_ = testing::fresh_folder("jobs_routes");
  RoutesJob job_{.folder = folder_.string()};
};

TEST_F(EditRoutes, AddsMovesAndRemovesAStation) {
  job_.station = "shelf";
  job_.at_m = 1.5;
  job_.pause_s = 10;
  ASSERT_TRUE(edit_routes(job_));
  ASSERT_EQ(stations().size(), 1U);
  EXPECT_EQ(stations()[0].arc_length_m, 1.5);
  job_.pause_s = {};
  job_.at_m = {};
  job_.at_tag = "7";
  const auto moved = edit_routes(job_);
  ASSERT_TRUE(moved) << to_string(moved.error());
  ASSERT_EQ(stations().size(), 1U);
  EXPECT_NEAR(stations()[0].arc_length_m, 3, 1e-9) << "the point of the route nearest to the tag";
  EXPECT_EQ(stations()[0].pause_s, 10) << "the dwell time is kept";
  EXPECT_EQ(to_json(fields(moved->front())).dump(),
            R"({"route":"","file":"route.yaml","length_m":4.0,"closed":false,"reverses":false,)"
            R"("stations":[{"name":"shelf","arc_length_m":3.0,"pause_s":10.0}]})");
  const RoutesJob take{.folder = folder_.string(), .remove = "shelf"};
  ASSERT_TRUE(edit_routes(take));
  EXPECT_TRUE(stations().empty());
  EXPECT_FALSE(edit_routes(take)) << "already removed";
}

TEST_F(EditRoutes, ErrorsNameTheirFieldAndChangeNothing) {
  const std::string before = test::file_text(folder_ / "route.yaml");
  const auto key = [&](RoutesJob job) {
    job.folder = folder_.string();
    const auto done = edit_routes(job);
    return done ? std::string("done") : done.error().place.key;
  };
  EXPECT_EQ(key({.station = "shelf"}), "station");
  EXPECT_EQ(key({.at_m = 1}), "at_m");
  EXPECT_EQ(key({.pause_s = 1}), "pause_s");
  EXPECT_EQ(key({.station = "shelf", .at_m = 1, .at_tag = "7"}), "at_tag");
  EXPECT_EQ(key({.station = "shelf", .at_tag = "8"}), "at_tag");
  EXPECT_EQ(key({.route = "kitchen"}), "`route`");
  EXPECT_EQ(key({.route = ""}), "route");
  EXPECT_NE(key({.station = "shelf", .at_m = 99}), "done") << "beyond the end of the route";
  EXPECT_EQ(test::file_text(folder_ / "route.yaml"), before);
  EXPECT_FALSE(edit_routes({.folder = "/nowhere"}));
}

TEST_F(EditRoutes, ListsTheTaughtRouteFirst) {
  ASSERT_TRUE(write_route(folder_ / route_file_name("best"), straight()));
  ASSERT_TRUE(write_route(folder_ / "route-best.1.yaml", straight()));
  const auto routes = edit_routes(job_);
  ASSERT_TRUE(routes) << to_string(routes.error());
  ASSERT_EQ(routes->size(), 2U) << "a backup is not a route";
  EXPECT_EQ((*routes)[0].name, "");
  EXPECT_EQ((*routes)[1].name, "best");
}

TEST_F(EditRoutes, AnOptimisedRouteDoesNotReplaceTheTaughtOne) {
  const std::string taught = test::file_text(folder_ / "route.yaml");
  OptimizeJob job{.folder = folder_.string(), .name = "fast"};
  job.profile.speed_m_s = 0.5;
  const auto first = optimize_route_of(job);
  ASSERT_TRUE(first) << to_string(first.error());
  EXPECT_TRUE(fs::exists(folder_ / "route-fast.yaml"));
  EXPECT_TRUE(fs::exists(folder_ / "route-fast.svg"));
  EXPECT_EQ(test::file_text(folder_ / "route.yaml"), taught);
  const Route fast = read_route(folder_ / "route-fast.yaml").value();
  for (const RoutePoint& point : fast.points) EXPECT_EQ(std::abs(point.speed_m_s), 0.5);
  EXPECT_THAT(drive_command(job), HasSubstr("route=fast"));
  job.profile.speed_m_s = 0.4;
  const auto second = optimize_route_of(job);
  ASSERT_TRUE(second);
  EXPECT_THAT(second->backups, Contains("route-fast.yaml"));
  job.folder = "/nowhere";
  EXPECT_FALSE(optimize_route_of(job));
}

TEST_F(EditRoutes, AConvertedMapLosesOnlyRemovedTags) {
  ConvertMapJob job{.input = (folder_ / "map.yaml").string(), .output = (folder_ / "copy.yaml").string()};
  ASSERT_TRUE(convert_map(job, {}));
  EXPECT_EQ(read_map(job.output).value().tags.tags.size(), 1U);
  const auto again = convert_map(job, {});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::Unwritable);
  job.force = true;
  EXPECT_TRUE(convert_map(job, {}));
  job.remove = {"7"};
  EXPECT_FALSE(convert_map(job, {})) << "no tag would be left";
  job.remove = {"9"};
  const auto other = convert_map(job, {});
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().place.key, "remove");
  job.remove.clear();
  job.form = MapForm::Transforms;
  job.output = (folder_ / "tags.mcap").string();
  ASSERT_TRUE(convert_map(job, {}));
  const auto back =
      convert_map({.input = job.output, .output = (folder_ / "back.yaml").string(), .tag_size_m = 0.16}, {});
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_LT((back->map.tags.tags.begin()->second.map_T_tag.translation() - Eigen::Vector3d(3, 1, 0.3)).norm(),
            1e-9);
}

}  // namespace
}  // namespace waymark
