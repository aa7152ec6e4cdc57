#include "waymark/app/common/route_files.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/common/job_control.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class RouteFiles : public ::testing::Test {
 protected:
  void touch(const std::string& name, std::string_view text = "x") const {
    fs::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  fs::path folder_ = testing::fresh_folder("jobs_route_files");
};

TEST_F(RouteFiles, AreNamedAfterTheirRoute) {
  EXPECT_EQ(route_file_name(""), "route.yaml");
  EXPECT_EQ(route_file_name("kitchen"), "route-kitchen.yaml");
  EXPECT_EQ(file_name_for_route("trajectory", "kitchen", ".txt"), "trajectory-kitchen.txt");
  EXPECT_THAT(files_of_route("kitchen"), Contains("route-kitchen.yaml"));
  const std::vector<std::string> all = files_of_map({"", "kitchen"});
  EXPECT_THAT(all, Contains("map.yaml"));
  EXPECT_THAT(all, Contains("summary.json"));
  EXPECT_THAT(all, Contains("summary-kitchen.json"));
  EXPECT_THAT(all, ::testing::Not(Contains("robot.yaml"))) << "the robot file does not belong to the map";
}

TEST_F(RouteFiles, NamedRoutesAreListedInOrderWithoutBackups) {
  for (const char* name :
       {"route.yaml", "route-b.yaml", "route-a.yaml", "route-a.1.yaml", "route-c.svg", "my-route-d.yaml"})
    touch(name);
  EXPECT_THAT(route_names(folder_), ElementsAre("a", "b"));
  EXPECT_THAT(route_names(folder_ / "none"), IsEmpty());
}

TEST_F(RouteFiles, RouteNamesMustBeValidInFileNames) {
  for (const char* good : {"a", "kitchen-2", "A_b"})
    EXPECT_TRUE(check_route_name(good, "route_name")) << good;
  for (const char* bad : {"", "a b", "../x", "a.1", "ü", "a/b"}) {
    const Status status = check_route_name(bad, "route_name");
    ASSERT_FALSE(status) << bad;
    EXPECT_EQ(status.error().place.key, "route_name");
  }
}

TEST_F(RouteFiles, AFolderWithoutAMapIsReportedWithAHint) {
  const auto hint = [](const fs::path& path) {
    const Status status = check_map_folder(path);
    EXPECT_FALSE(status);
    return status ? std::string() : to_string(status.error());
  };
  touch("map/map.yaml");
  EXPECT_TRUE(check_map_folder(folder_ / "map"));
  EXPECT_THAT(hint(folder_), HasSubstr("Did you mean")) << "the map is in a subfolder";
  touch("lap.mcap", "\x89MCAP0\r\n");
  EXPECT_THAT(hint(folder_ / "lap.mcap"), HasSubstr("waymark map"));
  touch("words.txt");
  EXPECT_THAT(hint(folder_ / "words.txt"), HasSubstr("this is a file"));
  EXPECT_THAT(hint(folder_ / "none"), HasSubstr("no such folder"));
  fs::create_directories(folder_ / "empty");
  EXPECT_THAT(hint(folder_ / "empty"), HasSubstr("no map.yaml"));
}

TEST_F(RouteFiles, AMissingRouteIsReportedWithTheExistingOnes) {
  const auto error = [&](const std::string& route) {
    const Status status = check_route_exists(folder_, route);
    EXPECT_FALSE(status) << route;
    return status ? Error{} : status.error();
  };
  EXPECT_THAT(error("").hint, HasSubstr("waymark map"));
  EXPECT_THAT(error("kitchen").hint, HasSubstr("route_name=kitchen"));
  touch("route-kitchen.yaml");
  EXPECT_TRUE(check_route_exists(folder_, "kitchen"));
  EXPECT_THAT(error("").hint, HasSubstr("kitchen: set `route`"));
  EXPECT_THAT(error("kitchn").hint, HasSubstr("kitchen"));
  EXPECT_EQ(error("kitchn").place.key, "`route`");
}

}  // namespace
}  // namespace waymark
