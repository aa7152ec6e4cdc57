#include "waymark/jobs/migrate_files.hpp"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/route_file.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kOldMap = R"(# written by hand
format: waymark-map-1
anchor: "tag36h11:7"
floor_z_m: -0.25
tags:
  - tag: "tag36h11:7"
    size_m: 0.16
    position_m: [3.0, 1.0, 0.3]
    quaternion_xyzw: [0.0, 0.0, 0.0, 1.0]
)";
constexpr const char* kOldRoute = R"(format: waymark-route-1
closed: false
length_m: 0.2
points:
  - [0.0, 0.0, 0.0, 0.0, 0.0, 0.3]
  - [0.1, 0.1, 0.0, 0.0, 0.0, 0.3]
  - [0.2, 0.2, 0.0, 0.0, 0.0, 0.3]
)";

std::string migrated_text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

class MigrateFiles : public ::testing::Test {
 protected:
  void write(const std::string& name, std::string_view text) const {
    ASSERT_TRUE(write_text_file(folder_ / "old" / name, text));
  }
  void SetUp() override { fs::create_directories(folder_ / "old"); }
  [[nodiscard]] MigrateJob job() const { return {folder_ / "old", folder_ / "new"}; }

  const fs::path folder_ = testing::fresh_folder("migrate");
};

TEST_F(MigrateFiles, OlderFormsBecomeTodaysAndSayTheSame) {
  write("map.yaml", kOldMap);
  write("route.yaml", kOldRoute);
  write("robot.yaml", "name: mine\n");
  const auto files = migrate_files(job());
  ASSERT_TRUE(files) << to_string(files.error());
  ASSERT_EQ(files->size(), 3U);
  EXPECT_EQ(to_text((*files)[0]), "map.yaml                 map          rewritten\n");
  EXPECT_EQ(to_text((*files)[1]), "robot.yaml               other        copied\n");
  EXPECT_EQ(to_text((*files)[2]), "route.yaml               route        rewritten\n");
  EXPECT_THAT(migrated_text_of(folder_ / "new/map.yaml"), Not(HasSubstr("floor_z_m")));
  const auto map = read_map(folder_ / "new/map.yaml");
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->tags.floor.z_m, -0.25);
  EXPECT_EQ(map->tags.tags.size(), 1U);
  EXPECT_THAT(migrated_text_of(folder_ / "new/route.yaml"), HasSubstr("points_checksum"));
  const auto route = read_route(folder_ / "new/route.yaml");
  ASSERT_TRUE(route) << to_string(route.error());
  EXPECT_EQ(route->points.size(), 3U);
  EXPECT_EQ(migrated_text_of(folder_ / "new/robot.yaml"), "name: mine\n");
}

TEST_F(MigrateFiles, WhatIsInTodaysFormIsCopied) {
  write("map.yaml", to_yaml(parse_map(kOldMap, "map.yaml").value()));
  const auto files = migrate_files(job());
  ASSERT_TRUE(files) << to_string(files.error());
  EXPECT_EQ(files->front().kind, "map");
  EXPECT_FALSE(files->front().rewritten);
  EXPECT_EQ(migrated_text_of(folder_ / "new/map.yaml"), migrated_text_of(folder_ / "old/map.yaml"));
}

TEST_F(MigrateFiles, NothingIsWrittenWhereOneFileIsUnusable) {
  write("map.yaml", kOldMap);
  write("route.yaml", "format: waymark-route-9\nclosed: true\n");
  const auto later = migrate_files(job());
  ASSERT_FALSE(later);
  EXPECT_THAT(to_string(later.error()), HasSubstr("'waymark-route-9' is not a format of routes known here"));
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(MigrateFiles, AFolderThatHoldsSomethingIsNotWrittenInto) {
  write("map.yaml", kOldMap);
  const auto into_itself = migrate_files({folder_ / "old", folder_ / "old"});
  ASSERT_FALSE(into_itself);
  EXPECT_THAT(to_string(into_itself.error()), HasSubstr("the folder is not empty"));
  EXPECT_EQ(migrated_text_of(folder_ / "old/map.yaml"), kOldMap);
  EXPECT_FALSE(migrate_files({folder_ / "missing", folder_ / "new"}));
}

}  // namespace
}  // namespace waymark
