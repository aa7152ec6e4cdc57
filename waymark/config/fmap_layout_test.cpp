// Limelight's field maps: the same tags as in WPILib's layout of the same field.
#include "waymark/config/fmap_layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/landmarks_file.hpp"
#include "waymark/config/map_exchange.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/wpilib_layout.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

/// Tag 1 of the field of 2024, as Limelight publishes it: from the middle of the field, in millimetres and
/// metres.
constexpr const char* kFmap = R"({"type": "frc", "fiducials": [{"family": "apriltag3_36h11_classic", "id": 1,
  "size": 165.1, "unique": true, "transform": [-0.5, -0.866025, 0, 6.808597, 0.866025, -0.5, 0, -3.859403,
  0, 0, 1, 1.355852, 0, 0, 0, 1]}]})";

TEST(FmapLayout, StandsWhereTheLayoutOfWpilibHasItButForTheOrigin) {
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
  const Eigen::Vector3d middle(16.541 / 2, 8.211 / 2, 0);  // of that field
  EXPECT_LT((same->map_T_tag.translation() - middle - tag->map_T_tag.translation()).norm(), 1e-3);
}

TEST(FmapLayout, ComesBackAsItWasWritten) {
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

TEST(FmapLayout, SaysWhatIsWrongAndWhere) {
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
  EXPECT_THAT(error_of(with("-0.5, -0.866025", "7, -0.866025")), HasSubstr("transform"));
  EXPECT_THAT(error_of(with("0, 0, 0, 1]", "0, 0, 0]")), HasSubstr("16"));
  EXPECT_NE(error_of("{\"fiducials\": []}"), "");
  EXPECT_NE(error_of("{\"fiducials\": ["), "");
  TagMap custom;
  custom.tags[{FamilyId::TagCustom48h12, 1}] = {SE3(), 0.1};
  EXPECT_FALSE(to_fmap(custom));
}

}  // namespace
}  // namespace waymark
