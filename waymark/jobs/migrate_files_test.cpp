#include "waymark/jobs/migrate_files.hpp"

#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
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
  EXPECT_EQ(files->front().done, MigratedFile::Done::Copied);
  EXPECT_EQ(migrated_text_of(folder_ / "new/map.yaml"), migrated_text_of(folder_ / "old/map.yaml"));
}

TEST_F(MigrateFiles, ASecondMigrationChangesNothing) {
  std::string route = "format: waymark-route-1\nclosed: false\nlength_m: 1.9\npoints:\n";
  for (int i = 0; i < 20; ++i) {  // yaws and a quaternion that come back another in their last digit
    const double s_m = 0.1 * i, yaw_rad = 0.7 * s_m;
    route += fmt::format("  - [{}, {}, {}, {}, 0.7, 0.3]\n", s_m, std::sin(yaw_rad) / 0.7,
                         (1 - std::cos(yaw_rad)) / 0.7, yaw_rad);
  }
  write("route.yaml", route);
  std::string map = kOldMap;
  map.replace(map.find("[0.0, 0.0, 0.0, 1.0]"), 20,
              "[-0.39651346203171867, 0.5861429087184878, -0.5852910910350146, 0.39578770034160127]");
  write("map.yaml", map);
  ASSERT_TRUE(migrate_files(job()));
  const auto again = migrate_files({folder_ / "new", folder_ / "newer"});
  ASSERT_TRUE(again) << to_string(again.error());
  for (const MigratedFile& file : *again) {
    EXPECT_EQ(file.done, MigratedFile::Done::Copied) << file.name;
    EXPECT_EQ(migrated_text_of(folder_ / "newer" / file.name), migrated_text_of(folder_ / "new" / file.name));
  }
}

TEST_F(MigrateFiles, FoldersInItAreMigratedAndWhatIsNoFileIsNamed) {
  fs::create_directories(folder_ / "old/routes/night");
  write("routes/night/route.yaml", kOldRoute);
  write("notes.txt", "in the hall\n");
  fs::create_directory_symlink(folder_ / "old", folder_ / "old/routes/round");
  const auto files = migrate_files(job());
  ASSERT_TRUE(files) << to_string(files.error());
  ASSERT_EQ(files->size(), 3U);
  EXPECT_EQ((*files)[0].name, "notes.txt");
  EXPECT_EQ((*files)[1].name, "routes/night/route.yaml");
  EXPECT_EQ((*files)[1].done, MigratedFile::Done::Rewritten);
  EXPECT_EQ((*files)[2].name, "routes/round");
  EXPECT_THAT(to_text((*files)[2]), HasSubstr("left out"));
  EXPECT_TRUE(read_route(folder_ / "new/routes/night/route.yaml"));
  EXPECT_FALSE(fs::exists(folder_ / "new/routes/round"));
}

TEST_F(MigrateFiles, NothingIsWrittenWhereOneFileIsUnusable) {
  write("map.yaml", kOldMap);
  write("route.yaml", "format: waymark-route-9\nclosed: true\n");
  const auto later = migrate_files(job());
  ASSERT_FALSE(later);
  EXPECT_THAT(to_string(later.error()), HasSubstr("'waymark-route-9' is not a format of routes known here"));
  EXPECT_FALSE(fs::exists(folder_ / "new"));
}

TEST_F(MigrateFiles, ARouteWithoutItsFirstLineIsSaid) {
  write("route.yaml", std::string(kOldRoute).substr(std::string_view(kOldRoute).find('\n') + 1));
  const auto files = migrate_files(job());
  ASSERT_TRUE(files) << to_string(files.error());
  EXPECT_EQ(files->front().done, MigratedFile::Done::CopiedWithoutFormat);
  EXPECT_THAT(to_text(files->front()), HasSubstr("no line in it begins with `format: waymark-`"));
}

TEST_F(MigrateFiles, AnOutputInsideOfTheInputIsRefused) {
  write("map.yaml", kOldMap);
  const auto inside = migrate_files({folder_ / "old", folder_ / "old/deep/new"});
  ASSERT_FALSE(inside);
  EXPECT_THAT(to_string(inside.error()), HasSubstr("lies inside the one that is read"));
  EXPECT_FALSE(fs::exists(folder_ / "old/deep"));
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
