#include "waymark/config/yaml/map_file.hpp"

#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/line_cuts.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

MapFile some_map() {
  Random random(7);
  MapFile map{.anchor = {FamilyId::Tag36h11, 3},
              .provenance = {{"method", "chain"}, {"recording", "lap: 1.mcap"}}};
  for (int i = 3; i < 6; ++i) {
    const TagId tag{i == 5 ? FamilyId::TagStandard41h12 : FamilyId::Tag36h11, i};
    SE3::Tangent xi;
    for (double& x : xi) x = random.normal();
    map.tags.tags[tag] = {.map_T_tag = SE3::exp(xi), .size_m = 0.1 / i};
    if (i != 3) map.observations[tag] = 10 * i;
  }
  Eigen::Matrix<double, 6, 6> root;
  for (double& x : root.reshaped()) x = random.normal();
  map.tags.tags.begin()->second.covariance = (root * root.transpose()).selfadjointView<Eigen::Upper>();
  MappedTag& tied = std::next(map.tags.tags.begin())->second;
  tied.covariance = map.tags.tags.begin()->second.covariance;
  tied.tie = TagTie{map.tags.tags.begin()->first, root};
  return map;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string error_of(const std::string& text) {
  const auto map = parse_map(text, "m.yaml");
  return map ? "none" : to_string(map.error());
}

TEST(MapFile, RoundTrips) {
  const MapFile map = some_map();
  const auto path = testing::fresh_folder("map") / "map.yaml";
  ASSERT_TRUE(write_map(path, map));
  const auto back = read_map(path);
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->anchor, map.anchor);
  EXPECT_EQ(back->provenance, map.provenance);
  EXPECT_EQ(back->observations, map.observations);
  ASSERT_EQ(back->tags.tags.size(), map.tags.tags.size());
  for (const auto& [tag, mapped] : map.tags.tags) {
    const MappedTag* other = back->tags.find(tag);
    ASSERT_NE(other, nullptr);
    EXPECT_EQ(other->size_m, mapped.size_m);
    EXPECT_EQ(other->map_T_tag.translation(), mapped.map_T_tag.translation());
    EXPECT_LT((other->map_T_tag.inverse() * mapped.map_T_tag).log().norm(), 1e-15);
    EXPECT_EQ(other->covariance, mapped.covariance);
    ASSERT_EQ(other->tie.has_value(), mapped.tie.has_value());
    if (!mapped.tie) continue;
    EXPECT_EQ(other->tie->to, mapped.tie->to);
    EXPECT_EQ(other->tie->covariance, mapped.tie->covariance);
  }
  EXPECT_EQ(to_yaml(*parse_map(to_yaml(*back), "again")), to_yaml(*back));
}

TEST(MapFile, StoresAFloorThatIsNotAtZero) {
  MapFile map = some_map();
  const std::string without = to_yaml(map);
  EXPECT_EQ(without.find("floor"), std::string::npos);
  map.tags.floor = {.z_m = -0.3, .normal = Eigen::Vector3d(0.6, 0, 0.8)};
  map.tags.floor.covariance = Eigen::Vector3d(1e-6, 2e-6, 3e-6).asDiagonal();
  (*map.tags.floor.covariance)(0, 2) = (*map.tags.floor.covariance)(2, 0) = 1e-7;
  const auto back = parse_map(to_yaml(map), "m.yaml");
  ASSERT_TRUE(back) << to_string(back.error());
  EXPECT_EQ(back->tags.floor.z_m, -0.3);
  EXPECT_LT((back->tags.floor.normal - map.tags.floor.normal).norm(), 1e-15);
  EXPECT_EQ(back->tags.floor.covariance, map.tags.floor.covariance);
  EXPECT_NE(error_of(replaced(to_yaml(map), "z_m: -0.3", "z_m: low")).find("(floor.z_m)"), std::string::npos);
  EXPECT_NE(error_of(replaced(to_yaml(map), "[0.6, 0.0, 0.8]", "[0.6, 0.0, 0.9]")).find("(floor.normal)"),
            std::string::npos);
}

TEST(MapFile, ReadsTheFloorOfOlderMaps) {
  const std::string older = replaced(to_yaml(some_map()), "tags:", "floor_z_m: -0.3\ntags:");
  const auto map = parse_map(older, "m.yaml");
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->tags.floor.z_m, -0.3);
  EXPECT_EQ(map->tags.floor.normal, Eigen::Vector3d::UnitZ());
  EXPECT_NE(error_of(replaced(older, "floor_z_m: -0.3", "floor_z_m: low")).find("(floor_z_m)"),
            std::string::npos);
  EXPECT_NE(
      error_of(replaced(older, "floor_z_m", "floor: {z_m: 0, normal: [0, 0, 1]}\nfloor_z_m")).find("twice"),
      std::string::npos);
}

TEST(MapFile, InvalidInputIsReportedWithFileLineAndKey) {
  const std::string text = to_yaml(some_map());
  EXPECT_EQ(error_of("").substr(0, 9), "m.yaml:1:");
  testing::expect_on_page("map", error_of(""));
  EXPECT_THAT(
      error_of(replaced(text, "map-1", "map-9")),
      ::testing::AllOf(::testing::HasSubstr("m.yaml:2 (format): "), ::testing::HasSubstr("'waymark-map-9'")));
  EXPECT_NE(error_of(replaced(text, "size_m", "size_mm")).find("m.yaml:10 (tags[0].size_mm): unknown key"),
            std::string::npos);
  EXPECT_THAT(error_of(replaced(text, "size_m: 0", "size_m: -0")),
              ::testing::HasSubstr("m.yaml:10 (tags[0].size_m): "));
  EXPECT_NE(error_of(replaced(text, "quaternion_xyzw: [", "quaternion_xyzw: [9")).find("m.yaml:12"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "covariance: [", "covariance: [1, ")).find("22 numbers where 21"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "covariance: [", "covariance: [-")).find("negative variance"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "- tag: \"tag36h11:4\"", "- tag: \"tag36h11:3\"")).find("given twice"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "anchor: \"tag36h11:3\"", "anchor: \"tag36h11:99\"")).find("not among"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "position_m: [", "position_m: [1e300, 1, 1] # ["))
                .find("(tags[0].position_m): 1e+300 is out"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "size_m: 0", "size_m: 1e100 # ")).find("(tags[0].size_m)"),
            std::string::npos);
  EXPECT_NE(error_of(replaced(text, "tied_to: \"tag36h11:3\"", "tied_to: \"tag36h11:9\""))
                .find("tied to tag36h11:9, but"),
            std::string::npos);
  EXPECT_NE(
      error_of(replaced(text, "tied_to: \"tag36h11:3\"", "tied_to: \"tag36h11:4\"")).find("form a cycle"),
      std::string::npos);
  EXPECT_NE(error_of(replaced(text, "tag36h11:4", "tag36h11:4000")).find("(tags[1].tag)"), std::string::npos);
}

TEST(MapFile, EveryTruncationIsAnErrorAndNeverACrash) {
  const std::string text = to_yaml(some_map());
  for (std::size_t length = 0; length + 1 < text.size(); ++length)
    EXPECT_FALSE(parse_map(text.substr(0, length), "m.yaml")) << length;
  EXPECT_TRUE(parse_map(text.substr(0, text.size() - 1), "m.yaml")) << "only the last line break is missing";
}

TEST(MapFile, RejectsCutsAtLineEnds) {
  MapFile map = some_map();
  map.tags.floor.z_m = -0.3;
  const std::string text = to_yaml(map);
  for (const std::string& cut : testing::cuts_at_line_ends(text))
    EXPECT_FALSE(parse_map(cut, "m.yaml")) << cut;
  const std::string error = error_of(text.substr(0, text.rfind("  - tag")));
  EXPECT_THAT(error, ::testing::HasSubstr("m.yaml:3 (tag_count): the file is truncated: it contains 2 of 3"));
  testing::expect_on_page("map", error);
}

TEST(MapFile, EditedMapsWithoutACountAreRead) {
  const std::string text = to_yaml(some_map());
  const std::string fewer = text.substr(0, text.rfind("  - tag"));
  const std::string error = error_of(fewer + "end: 3\n");
  EXPECT_THAT(error, ::testing::HasSubstr("m.yaml:3 (tag_count): the file declares 3 tags but contains 2"));
  EXPECT_EQ(error_of(replaced(fewer, "tag_count: 3\n", "")), "none");
}

TEST(MapFile, DoesNotWriteATagThatCannotBeRead) {
  MapFile map = some_map();
  map.tags.tags[{FamilyId::Tag36h11, 587}] = map.tags.tags.begin()->second;
  const auto status = write_map(testing::fresh_folder("map") / "map.yaml", map);
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().message, ::testing::HasSubstr("587"));
}

TEST(MapFile, DoesNotWriteNan) {
  MapFile map = some_map();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  map.tags.tags.begin()->second.map_T_tag = SE3(SO3(), {0, nan, 0});
  EXPECT_FALSE(write_map(testing::fresh_folder("map") / "map.yaml", map));
}

}  // namespace
}  // namespace waymark
