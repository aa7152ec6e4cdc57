#include "waymark/config/exchange/map_exchange.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

constexpr TagId kFirst{FamilyId::Tag36h11, 3};
constexpr TagId kSecond{FamilyId::Tag36h11, 7};

/// Upright tags, which all formats can represent.
MapFile some_map() {
  MapFile map{.anchor = kFirst, .provenance = {{"method", "bundle"}}};
  map.tags.tags[kFirst] = {SE3(SO3::from_rpy(0, 0, 0.7) * body_R_optical(), {1, 2, 0.3}), 0.16};
  map.tags.tags[kSecond] = {SE3(SO3::from_rpy(0, 0, -2) * body_R_optical(), {-1, 0.5, 0.8}), 0.16,
                            Eigen::Matrix<double, 6, 6>(1e-4 * Eigen::Matrix<double, 6, 6>::Identity())};
  return map;
}

void expect_same_places(const MapFile& a, const MapFile& b) {
  ASSERT_EQ(a.tags.tags.size(), b.tags.tags.size());
  for (const auto& [id, tag] : a.tags.tags) {
    ASSERT_NE(b.tags.find(id), nullptr);
    EXPECT_LT((tag.map_T_tag.inverse() * b.tags.find(id)->map_T_tag).log().norm(), 1e-9) << to_string(id);
    EXPECT_DOUBLE_EQ(tag.size_m, b.tags.find(id)->size_m);
  }
}

TEST(MapExchange, EveryFormRoundTripsPositions) {
  const MapFile map = some_map();
  for (const std::string& name : map_form_names()) {
    std::vector<std::string> warnings;
    const auto text = to_text(map, map_form(name).value(), warnings);
    ASSERT_TRUE(text) << name;
    const auto read = parse_any_map(*text, "some.yaml", 0.16);
    ASSERT_TRUE(read) << name << ": " << to_string(read.error());
    EXPECT_EQ(read->form, map_form(name).value());
    expect_same_places(map, read->map);
  }
}

TEST(MapExchange, TagslamTagsHaveOneFamily) {
  MapFile map = some_map();
  const MappedTag tag = map.tags.tags.begin()->second;
  map.tags.tags = {{{FamilyId::TagStandard41h12, 5}, tag}, {{FamilyId::TagStandard41h12, 600}, tag}};
  std::vector<std::string> warnings;
  const auto read = parse_any_map(*to_text(map, MapForm::Tagslam, warnings), "poses.yaml");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_EQ(read->map.tags.tags.size(), 2U);
  EXPECT_NE(read->map.tags.find({FamilyId::TagStandard41h12, 5}), nullptr);
  EXPECT_NE(read->map.tags.find({FamilyId::TagStandard41h12, 600}), nullptr);
}

TEST(MapExchange, TagslamKeepsStandardDeviations) {
  std::vector<std::string> warnings;
  const auto read = parse_any_map(*to_text(some_map(), MapForm::Tagslam, warnings), "poses.yaml");
  ASSERT_TRUE(read);
  EXPECT_TRUE(warnings.empty());
  EXPECT_FALSE(read->map.tags.find(kFirst)->covariance);
  ASSERT_TRUE(read->map.tags.find(kSecond)->covariance);
  EXPECT_GT(read->map.tags.find(kSecond)->covariance->trace(), 1e-4);
}

TEST(MapExchange, WarnsAboutWhatAFormCannotHold) {
  MapFile map = some_map();
  map.tags.tags[kFirst].map_T_tag = SE3(SO3::from_rpy(0, 0.5, 0) * body_R_optical(), {1, 2, 0.3});
  std::vector<std::string> warnings;
  ASSERT_TRUE(to_text(map, MapForm::Academy, warnings));
  ASSERT_EQ(warnings.size(), 3U);
  for (const std::string& warning : warnings) testing::expect_on_page("map", warning);
  map.tags.tags[{FamilyId::Tag25h9, 3}] = map.tags.tags[kFirst];
  EXPECT_FALSE(to_text(map, MapForm::Academy, warnings));
  EXPECT_FALSE(to_text({}, MapForm::Transforms, warnings));
  EXPECT_FALSE(map_form("tagslm"));
}

std::string error_of(std::string_view text, std::optional<double> size = {}) {
  const auto read = parse_any_map(text, "f.yaml", size);
  return read ? std::string() : to_string(read.error());
}

TEST(MapExchange, ReportsErrorsWithTheirPlace) {
  constexpr const char* kTransform =
      "transforms:\n  - child_frame_id: tag36h11:1\n    transform:\n      translation: {x: 1, y: 2, z: 3}\n"
      "      rotation: {x: 0, y: 0, z: 0, w: 0}\n";
  EXPECT_THAT(error_of(kTransform), HasSubstr("`tag_size_m`"));
  EXPECT_THAT(error_of(kTransform, 0.16), HasSubstr("f.yaml:5"));
  EXPECT_NE(error_of("transforms:\n  - child_frame_id: base_link\n", 0.16), "");
  testing::expect_on_page("map", error_of("transforms:\n  - child_frame_id: base_link\n", 0.16));
  EXPECT_THAT(
      error_of("bodies:\n - lab:\n     tags:\n       - id: 1\n         pose:\n           position: {x: 0}\n"),
      HasSubstr("f.yaml:6"));
  EXPECT_THAT(
      error_of("bodies:\n - lab:\n     tags:\n       - id: 1\n         pose: {position: {x: 0, y: 0, z: 0}, "
               "rotation: {x: 0, y: 0, z: 0}}\n"),
      HasSubstr("size"));
  EXPECT_THAT(error_of("bodies: 3\n"), HasSubstr("f.yaml"));
  EXPECT_THAT(error_of("id,x,y\n1,0,0\n"), HasSubstr("points"));
  EXPECT_THAT(error_of("nothing: 1\n"), HasSubstr("f.yaml"));
  EXPECT_THAT(error_of("", -1.0), HasSubstr("(tag_size_m)"));
}

}  // namespace
}  // namespace waymark
