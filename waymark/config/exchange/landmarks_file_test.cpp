#include "waymark/config/exchange/landmarks_file.hpp"

#include <filesystem>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"

namespace waymark {
namespace {

TEST(LandmarksFile, PointsOfATable) {
  const auto file = parse_landmarks("id,x,y\r\n1,1.69,.2\n# a comment\n5,-0.37,1.24", "points.csv");
  ASSERT_TRUE(file) << to_string(file.error());
  ASSERT_EQ(file->landmarks.size(), 2);
  const Landmark& five = file->landmarks[file->landmarks.find(std::int64_t{5})];
  EXPECT_FALSE(five.oriented);
  EXPECT_DOUBLE_EQ(five.map_T_tag.translation().x(), -0.37);
  EXPECT_GE(file->landmarks.find(TagId{FamilyId::TagCustom48h12, 1}), 0)
      << "without a family, any family matches";
}

TEST(LandmarksFile, TagsOfTheAcademyFaceTheViewer) {
  const auto file = parse_landmarks(
      "tags:\n  tag_0:\n    position: [1.75, -3.535, 0.8, -1.57079632679]\n  tag_2:\n    position: [5.935, "
      "-2.89, "
      "0.8, 0]\n",
      "apriltags_poses.yaml", 0.24);
  ASSERT_TRUE(file) << to_string(file.error());
  const SE3& window = file->tags.find({.number = 2})->map_T_tag;
  EXPECT_LT((window.rotation() * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
  EXPECT_LT((window.rotation() * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_NEAR(window.translation().x(), 5.925, 1e-9);
  EXPECT_NEAR(file->tags.find({.number = 0})->map_T_tag.translation().y(), -3.525, 1e-9);
  EXPECT_DOUBLE_EQ(file->landmarks[0].size_m, 0.24);
}

TEST(LandmarksFile, WaymarkMapsKeepSizesAndCovariances) {
  MapFile map{.anchor = {.number = 3}};
  MappedTag tag{.map_T_tag = SE3({}, {5, 0, 0.3}), .size_m = 0.16};
  tag.covariance = Eigen::Matrix<double, 6, 6>::Identity() * 1e-4;
  map.tags.tags[{.number = 3}] = tag;
  const auto file = parse_landmarks(to_yaml(map), "map.yaml");
  ASSERT_TRUE(file) << to_string(file.error());
  // Rotating the frame by 0.01 rad moves a tag that is 5 m away by 5 cm, which is its uncertainty.
  EXPECT_NEAR(file->landmarks[0].covariance(1, 1), 1e-4 * (1 + 25), 1e-4 * 0.2);
}

TEST(LandmarksFile, ReportsThePlaceOfErrors) {
  const auto expect_error = [](const std::string& text, const std::string& word) {
    const auto file = parse_landmarks(text, "m");
    ASSERT_FALSE(file);
    EXPECT_NE(to_string(file.error()).find(word), std::string::npos) << to_string(file.error());
  };
  expect_error("id,x,y\n1,2\n", "m:2");
  expect_error("id,x,y\n1,2,nan\n", "m:2");
  expect_error("id,x,y\n1,2,3\n1,2,3\n", "duplicate landmark 1");
  expect_error("a,b\n1,2\n", "m:1");
  expect_error("hello: world\n", "not a map");
  expect_error("# a route: x, y\nformat: waymark-route\n", "not a map");
  expect_error("# a, b", "not a map");
  expect_error("tags:\n  tag_0:\n    position: [1, 2]\n", "4");
  expect_error("", "not a map");
}

TEST(LandmarksFile, SuggestsTheMapFolderInAFolder) {
  const auto folder = testing::fresh_folder("landmarks");
  std::filesystem::create_directories(folder / "map");
  ASSERT_TRUE(write_text_file(folder / "map/map.yaml", "hello: world\n"));
  const auto around = read_landmarks(folder);
  ASSERT_FALSE(around);
  EXPECT_EQ(around.error().hint, "Did you mean " + (folder / "map").string() + "?");
}

}  // namespace
}  // namespace waymark
