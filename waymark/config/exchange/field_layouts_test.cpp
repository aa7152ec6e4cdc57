// Tests that Limelight field maps contain the same tags as the WPILib layout of the same field.
#include "waymark/config/exchange/field_layouts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/exchange/landmarks_file.hpp"
#include "waymark/config/exchange/map_exchange.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

/// Tag 1 of the 2024 field as published by Limelight, relative to the centre of the field, in millimetres and
/// metres.
constexpr const char* kFmap = R"({"type": "frc", "fiducials": [{"family": "apriltag3_36h11_classic", "id": 1,
  "size": 165.1, "unique": true, "transform": [-0.5, -0.866025, 0, 6.808597, 0.866025, -0.5, 0, -3.859403,
  0, 0, 1, 1.355852, 0, 0, 0, 1]}]})";

TEST(FmapLayout, MatchesTheWpilibLayoutExceptForTheOrigin) {
  const auto fmap = parse_fmap(kFmap, "field.fmap");
  ASSERT_TRUE(fmap) << to_string(fmap.error());
  const MappedTag* tag = fmap->find({FamilyId::Tag36h11, 1});
  ASSERT_NE(tag, nullptr);
  EXPECT_DOUBLE_EQ(tag->size_m, 0.1651);
  WAYMARK_REAL_DATA(path, "wpical/2024-crescendo.json");
  const auto text = read_text_file(path, 1 << 20);
  ASSERT_TRUE(text) << to_string(text.error());
  const auto layout = parse_wpilib_layout(*text, "2024-crescendo.json");
  ASSERT_TRUE(layout) << to_string(layout.error());
  const MappedTag* same = layout->find({FamilyId::Tag36h11, 1});
  ASSERT_NE(same, nullptr);
  EXPECT_LT((same->map_T_tag.rotation().inverse() * tag->map_T_tag.rotation()).log().norm(), 1e-5);
  const Eigen::Vector3d middle(16.541 / 2, 8.211 / 2, 0);  // centre of that field
  EXPECT_LT((same->map_T_tag.translation() - middle - tag->map_T_tag.translation()).norm(), 1e-3);
}

TEST(FmapLayout, RoundTrips) {
  TagMap map;
  map.tags[{FamilyId::Tag16h5, 3}] = {SE3(SO3::from_rpy(0.1, -0.2, 2), {1, 2, 0.3}), 0.152};
  map.tags[{FamilyId::Tag36h11, 3}] = {SE3(SO3::from_rpy(-1, 0.4, 0.3), {-1, 0, 2}), 0.1651};
  const auto text = to_fmap(map);
  ASSERT_TRUE(text) << to_string(text.error());
  const auto again = parse_any_map(*text, "again.fmap");
  ASSERT_TRUE(again) << to_string(again.error());
  EXPECT_EQ(again->form, MapForm::Fmap);
  ASSERT_EQ(again->map.tags.tags.size(), 2U);
  for (const auto& [id, tag] : map.tags) {
    const MappedTag& read = again->map.tags.tags.at(id);
    EXPECT_LT((read.map_T_tag.inverse() * tag.map_T_tag).log().norm(), 1e-12);
    EXPECT_NEAR(read.size_m, tag.size_m, 1e-12);
  }
  EXPECT_EQ(parse_landmarks(*text, "again.fmap")->format, "fmap");
}

TEST(FmapLayout, ReportsErrorsWithTheirPlace) {
  const auto error_of = [](const std::string& text) {
    const auto map = parse_fmap(text, "field.fmap");
    return map ? std::string() : to_string(map.error());
  };
  const std::string good = kFmap;
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return text;
  };
  EXPECT_EQ(error_of(good), "");
  EXPECT_THAT(error_of(with("36h11_classic", "99h9")), HasSubstr("field.fmap:1"));
  EXPECT_THAT(error_of(with("165.1", "-3")), HasSubstr("size"));
  EXPECT_THAT(error_of(with("165.1", "0.1651")), HasSubstr("size")) << "metres instead of millimetres";
  EXPECT_THAT(error_of(with("-0.5, -0.866025", "7, -0.866025")), HasSubstr("transform"));
  EXPECT_THAT(error_of(with("0, 0, 0, 1]", "0, 0, 0]")), HasSubstr("16"));
  EXPECT_NE(error_of("{\"fiducials\": []}"), "");
  EXPECT_NE(error_of("{\"fiducials\": ["), "");
  TagMap custom;
  custom.tags[{FamilyId::TagCustom48h12, 1}] = {SE3(), 0.1};
  EXPECT_FALSE(to_fmap(custom));
}

using ::testing::HasSubstr;

/// One tag on the far wall (x = 4) that faces -x: yaw 180 degrees in WPILib.
constexpr const char* kJson =
    R"({"tags":[{"ID":7,"pose":{"translation":{"x":4.0,"y":1.0,"z":1.5},
  "rotation":{"quaternion":{"W":0.0,"X":0.0,"Y":0.0,"Z":1.0}}}}],"field":{"length":8.0,"width":4.0}})";

void expect_axis(const SE3& map_T_tag, const Eigen::Vector3d& of_tag, const Eigen::Vector3d& in_map) {
  EXPECT_LT((map_T_tag.rotation() * of_tag - in_map).norm(), 1e-9)
      << (map_T_tag.rotation() * of_tag).transpose();
}

TEST(WpilibLayout, ConvertsTheTagAxes) {
  const auto map = parse_wpilib_layout(kJson, "field.json");
  ASSERT_TRUE(map) << to_string(map.error());
  const MappedTag* tag = map->find({FamilyId::Tag36h11, 7});
  ASSERT_NE(tag, nullptr);
  EXPECT_DOUBLE_EQ(tag->size_m, 0.1651);
  EXPECT_LT((tag->map_T_tag.translation() - Eigen::Vector3d(4, 1, 1.5)).norm(), 1e-12);
  // A viewer at x < 4 looks along +x: into the wall is +x, right is -y, down is -z.
  expect_axis(tag->map_T_tag, Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  expect_axis(tag->map_T_tag, Eigen::Vector3d::UnitX(), -Eigen::Vector3d::UnitY());
  expect_axis(tag->map_T_tag, Eigen::Vector3d::UnitY(), -Eigen::Vector3d::UnitZ());
}

TEST(WpilibLayout, CsvIsInInchesAndDegrees) {
  const auto map =
      parse_wpilib_layout("ID,X,Y,Z,Z-Rotation,X-Rotation\n4,365.2,241.64,73.54,0,30\n", "field.csv", 0.2);
  ASSERT_TRUE(map) << to_string(map.error());
  const MappedTag& tag = map->tags.begin()->second;
  EXPECT_DOUBLE_EQ(tag.size_m, 0.2);
  EXPECT_LT((tag.map_T_tag.translation() - Eigen::Vector3d(9.27608, 6.137656, 1.867916)).norm(), 1e-9);
  // The tag faces +x and is tilted down by 30 degrees, so its inward normal points back and up.
  expect_axis(tag.map_T_tag, Eigen::Vector3d::UnitZ(), Eigen::Vector3d(-std::cos(M_PI / 6), 0, 0.5));
  EXPECT_TRUE(parse_wpilib_layout("ID,X,Y,Z,Rotation\n1,593.68,9.68,53.38,120\n", "2024.csv"));
}

TEST(WpilibLayout, RoundTrips) {
  const auto map = parse_wpilib_layout(kJson, "field.json");
  ASSERT_TRUE(map);
  const auto again = parse_wpilib_layout(to_wpilib_layout(*map), "again.json");
  ASSERT_TRUE(again) << to_string(again.error());
  const SE3& a = map->tags.begin()->second.map_T_tag;
  const SE3& b = again->tags.begin()->second.map_T_tag;
  EXPECT_LT((a.inverse() * b).log().norm(), 1e-12);
}

TEST(WpilibLayout, KeepsTheFieldSizeBetweenForms) {
  const FieldSize field{8, 4};
  const auto read = parse_any_map(kJson, "field.json");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->field, field);
  for (const MapForm form : {MapForm::Wpilib, MapForm::Fmap}) {
    std::vector<std::string> warnings;
    const auto text = to_text(read->map, form, warnings, read->field);
    ASSERT_TRUE(text) << to_string(text.error());
    EXPECT_EQ(field_size_of(*text), field) << *text;
    for (const std::string& words : warnings) EXPECT_THAT(words, ::testing::Not(HasSubstr("field")));
    const auto landmarks = parse_landmarks(*text, "again");
    ASSERT_TRUE(landmarks) << to_string(landmarks.error());
    EXPECT_EQ(landmarks->field, field);
  }
  EXPECT_EQ(field_size_of(to_wpilib_layout(read->map.tags)), (FieldSize{4, 1})) << "the box of the tags";
  for (const char* none :
       {"{}", "{\"field\":3}", R"({"field":{"length":0,"width":4}})", "id,x,y", "{\"field\":"})
    EXPECT_FALSE(field_size_of(none)) << none;
}

TEST(WpilibLayout, IsAcceptedAsAMap) {
  const auto any = parse_any_map(kJson, "field.json");
  ASSERT_TRUE(any) << to_string(any.error());
  EXPECT_EQ(any->form, MapForm::Wpilib);
  ASSERT_FALSE(any->warnings.empty());
  EXPECT_THAT(any->warnings.front(), HasSubstr("0.1651"));
  const auto landmarks = parse_landmarks(kJson, "field.json");
  ASSERT_TRUE(landmarks) << to_string(landmarks.error());
  EXPECT_EQ(landmarks->format, "wpilib");
  EXPECT_THAT(landmarks->notes, ::testing::ElementsAre(HasSubstr("0.1651 m")));
  EXPECT_TRUE(parse_landmarks(kJson, "field.json", 0.2)->notes.empty());
}

TEST(WpilibLayout, ReportsErrorsWithTheirPlace) {
  const auto missing = parse_wpilib_layout("{\n\"tags\": [\n{\"ID\": 3}]}", "field.json");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.line, 3);
  EXPECT_THAT(to_string(missing.error()), HasSubstr("pose"));
  EXPECT_FALSE(parse_wpilib_layout("{\"tags\": [", "field.json"));
  EXPECT_FALSE(parse_wpilib_layout(std::string(100'000, '['), "field.json"));
  EXPECT_FALSE(parse_wpilib_layout("{\"tags\":" + std::string(1'000'000, '['), "field.json"));
}

TEST(WpilibLayout, ReadsTheFieldOf2024) {
  WAYMARK_REAL_DATA(folder, "wpical");
  const auto map = read_any_map(folder / "2024-crescendo.json");
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_EQ(map->map.tags.tags.size(), 16U);
  // Tags 3 and 4 are side by side on the wall x = 16.579 m, 0.565 m apart, and face the field.
  const SE3& third = map->map.tags.find({FamilyId::Tag36h11, 3})->map_T_tag;
  const SE3& fourth = map->map.tags.find({FamilyId::Tag36h11, 4})->map_T_tag;
  EXPECT_NEAR((third.inverse() * fourth).translation().x(), -0.56515, 1e-9);
  EXPECT_NEAR((third.inverse() * fourth).translation().z(), 0, 1e-9);
}

}  // namespace
}  // namespace waymark
