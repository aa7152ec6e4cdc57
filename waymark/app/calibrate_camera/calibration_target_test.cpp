// Valid and invalid calibration targets.
#include "waymark/app/calibrate_camera/calibration_target.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/config/yaml/map_file.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string refusal(const TargetOptions& options) {
  const auto target = CalibrationTarget::make(options);
  if (target) return "none";
  return to_string(target.error());
}

TEST(CalibrationTarget, ABoardOfTagsCountsFromTheLowerLeft) {
  const auto target =
      CalibrationTarget::make({.columns = 3, .rows = 2, .tag_size_m = 0.1, .spacing = 0.5, .first_id = 10});
  ASSERT_TRUE(target) << to_string(target.error());
  EXPECT_FALSE(target->is_board());
  EXPECT_STREQ(target->mark_kind(), "tags");
  ASSERT_EQ(target->tags().tags.size(), 6U);
  const auto place = [&](int number) {
    const MappedTag* tag = target->tags().find({FamilyId::Tag36h11, number});
    EXPECT_NE(tag, nullptr) << number;
    EXPECT_EQ(tag->size_m, 0.1);
    return Eigen::Vector3d(tag->map_T_tag.translation());
  };
  EXPECT_LT((place(10) - Eigen::Vector3d(-0.15, 0.075, 0)).norm(), 1e-12)
      << "the lower left tag; y points down";
  EXPECT_LT((place(12) - Eigen::Vector3d(0.15, 0.075, 0)).norm(), 1e-12) << "the lower right tag";
  EXPECT_LT((place(13) - Eigen::Vector3d(-0.15, -0.075, 0)).norm(), 1e-12) << "the tag above the first one";
}

TEST(CalibrationTarget, CanBeAMap) {
  const auto file = testing::fresh_folder("jobs_target") / "map.yaml";
  MapFile map{.anchor = {FamilyId::Tag25h9, 1}};
  map.tags.tags[map.anchor] = {.map_T_tag = SE3(), .size_m = 0.2};
  ASSERT_TRUE(write_map(file, map));
  const auto target = CalibrationTarget::make({.map = file.string()});
  ASSERT_TRUE(target) << to_string(target.error());
  EXPECT_NE(target->tags().find(map.anchor), nullptr);
  EXPECT_THAT(refusal({.map = "/nowhere/map.yaml"}), HasSubstr("/nowhere/map.yaml"));
}

TEST(CalibrationTarget, RejectsInvalidOptions) {
  EXPECT_THAT(refusal({}), HasSubstr("`map`"));
  EXPECT_THAT(refusal({.columns = 3, .rows = 2, .tag_size_m = 0.1, .map = "map.yaml"}), HasSubstr("either"));
  EXPECT_THAT(refusal({.columns = 3, .rows = 2}), HasSubstr("`tag_size_m`"));
  EXPECT_THAT(refusal({.columns = 3, .rows = 0, .tag_size_m = 0.1}), HasSubstr("`rows`"));
  EXPECT_THAT(refusal({.columns = 30, .rows = 20, .tag_size_m = 0.1}), HasSubstr("0 to 586"));
  EXPECT_THAT(refusal({.columns = 2, .rows = 2, .tag_size_m = 0.1, .first_id = 585}),
              HasSubstr("tags 585 to 588"));
  EXPECT_THAT(refusal({.columns = 2, .rows = 2, .tag_size_m = 0.1, .first_id = -1}), HasSubstr("`first_id`"));
  EXPECT_THAT(refusal({.columns = 100000, .rows = 100000, .tag_size_m = 0.1}), HasSubstr("0 to 586"))
      << "must neither overflow nor create a board with 10^10 tags";
}

TEST(CalibrationTarget, MakesABoardByKind) {
  const auto tags = board_of({.kind = "tags", .columns = 3, .rows = 2, .tag_size_m = 0.1});
  ASSERT_TRUE(tags);
  EXPECT_FALSE(tags->has_value());
  const auto chess = board_of({.kind = "chessboard", .columns = 8, .rows = 6, .square_size_m = 0.03});
  ASSERT_TRUE(chess) << to_string(chess.error());
  ASSERT_TRUE(chess->has_value());
  EXPECT_EQ((*chess)->kind, BoardKind::Chessboard);
  EXPECT_EQ((*chess)->size_m, 0.03);
  const auto grid = board_of({.kind = "aprilgrid", .columns = 6, .rows = 6, .tag_size_m = 0.088});
  ASSERT_TRUE(grid) << to_string(grid.error());
  EXPECT_EQ((*grid)->size_m, 0.088) << "for an AprilGrid, it is the tag size";
  EXPECT_FALSE(board_of({.kind = "chessboard", .columns = 8, .rows = 6})) << "the square size is missing";
  EXPECT_FALSE(
      board_of({.kind = "charuco", .columns = 8, .rows = 6, .square_size_m = 0.03, .marker_size_m = 0.04}))
      << "the marker is larger than its square";
}

TEST(CalibrationTarget, NoTagsDetectsNothing) {
  const TagFinder finder = no_tags();
  const auto target = CalibrationTarget::make({.columns = 3, .rows = 2, .tag_size_m = 0.1});
  ASSERT_TRUE(target);
  const auto found = target->find(Image(64, 48, 255), finder);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->marks.empty());
}

TEST(CalibrationTarget, RejectsIncompleteOrTooLargeBoards) {
  EXPECT_FALSE(CalibrationTarget::make({}));
  EXPECT_FALSE(CalibrationTarget::make({.columns = 6, .rows = 5}));
  EXPECT_FALSE(CalibrationTarget::make({.columns = 6, .rows = 5, .tag_size_m = 0.04, .map = "map.yaml"}));
  const auto ids = CalibrationTarget::make({.columns = 60, .rows = 50, .tag_size_m = 0.04});
  ASSERT_FALSE(ids);
  EXPECT_THAT(ids.error().message, HasSubstr("tags 0 to 2999"));
}

}  // namespace
}  // namespace waymark
