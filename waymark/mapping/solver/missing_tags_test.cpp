// A camera that passes a wall of tags several times, from exactly known poses.
#include "waymark/mapping/solver/missing_tags.hpp"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using ::testing::IsEmpty;

constexpr double kSize_m = 0.16;
constexpr int kTags = 10;
constexpr int kImagesPerPass = 100;

TagId wall_tag(int number) { return {FamilyId::Tag36h11, number}; }

CameraModel wall_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value();
}

struct Wall {
  std::vector<PlacedTag> tags{};
  std::vector<PlacedImage> images{};

  [[nodiscard]] std::vector<MissingTag> missing() const {
    return missing_tags({wall_camera()}, images, tags);
  }
  /// Removes the detections of a tag in these passes.
  void hide(int number, const std::set<int>& passes) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      if (passes.contains(static_cast<int>(i) / kImagesPerPass))
        std::erase_if(images[i].detected,
                      [&](const DetectedTag& seen) { return seen.tag == wall_tag(number); });
    }
  }
};

/// Detects a tag in an image if it is visible.
void detect(const PlacedTag& tag, PlacedImage& image) {
  const auto corners = visible_corners(wall_camera(), image.map_T_cam.inverse() * tag.map_T_tag, tag.size_m);
  if (corners) image.detected.push_back({tag.tag, center_px(*corners), true});
}

/// Tags every 0.6 m on the plane z = 2 m, in rows of ten that are 0.4 m apart. The camera moves along x,
/// looks at them, and detects this share of those in view. Passes are 20 s apart.
Wall wall(int passes, double detection_rate = 0.98, std::uint64_t seed = 1, int rows = 1) {
  Wall wall;
  for (int row = 0; row < rows; ++row) {
    for (int i = 0; i < kTags; ++i)
      wall.tags.push_back(
          {wall_tag(row * kTags + i), SE3({}, {0.6 * i, 0.4 * row - 0.2 * (rows - 1), 2}), kSize_m});
  }
  Random random(seed);
  for (int pass = 0; pass < passes; ++pass) {
    for (int i = 0; i < kImagesPerPass; ++i) {
      PlacedImage image{.time_s = 30.0 * pass + 0.1 * i,
                        .map_T_cam = SE3({}, {0.06 * i, random.uniform(-0.02, 0.02), 0})};
      for (const PlacedTag& tag : wall.tags) {
        const auto corners =
            visible_corners(wall_camera(), image.map_T_cam.inverse() * tag.map_T_tag, kSize_m);
        if (corners && random.uniform() < detection_rate)
          image.detected.push_back({tag.tag, center_px(*corners), true});
      }
      wall.images.push_back(image);
    }
  }
  return wall;
}

/// A wall of an older map, in which each tag was observed together with the next one.
Wall older_wall() {
  Wall older = wall(1);
  for (std::size_t i = 1; i < older.tags.size(); ++i) {
    older.tags[i].neighbours.push_back(older.tags[i - 1].tag);
    older.tags[i - 1].neighbours.push_back(older.tags[i].tag);
  }
  return older;
}

/// Tags 1, 3, 5, 7 and 9, and a camera so close to them that an image shows at most one.
Wall sparse_wall(int passes) {
  Wall sparse = wall(passes);
  std::erase_if(sparse.tags, [](const PlacedTag& tag) { return tag.tag.number % 2 == 0; });
  for (PlacedImage& image : sparse.images) {
    image.map_T_cam = SE3({}, {0, 0, 1.2}) * image.map_T_cam;
    image.detected.clear();
    for (const PlacedTag& tag : sparse.tags) detect(tag, image);
    EXPECT_LE(image.detected.size(), 1U);
  }
  return sparse;
}

TEST(MissingTags, NoneIsMissingIfAllAreDetected) {
  for (const double rate : {1.0, 0.98, 0.7, 0.3}) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed)
      EXPECT_THAT(wall(3, rate, seed).missing(), IsEmpty()) << rate << " " << seed;
  }
}

TEST(MissingTags, ATagThatIsNotDetectedAnyMoreIsMissing) {
  for (const int number : {0, 4, 9}) {
    Wall two = wall(2);
    two.hide(number, {1});
    const std::vector<MissingTag> after_one = two.missing();
    ASSERT_EQ(after_one.size(), 1U) << number;
    EXPECT_EQ(after_one[0].tag, wall_tag(number));
    EXPECT_EQ(after_one[0].passes, 1);
    EXPECT_LT(*after_one[0].last_seen_s, 10);
    Wall three = wall(3);
    three.hide(number, {1, 2});
    const std::vector<MissingTag> after_two = three.missing();
    ASSERT_EQ(after_two.size(), 1U) << number;
    EXPECT_EQ(after_two[0].passes, 2);
    EXPECT_NEAR(after_two[0].expected_images, 2 * after_one[0].expected_images, 8);
  }
}

TEST(MissingTags, ATagThatIsDetectedAgainIsNotMissing) {
  Wall three = wall(3);
  three.hide(4, {1});
  EXPECT_THAT(three.missing(), IsEmpty());
}

TEST(MissingTags, PassesThatMissTagsNowAndThenReduceTheEvidence) {
  Wall five = wall(5);
  for (const int number : {0, 1, 2, 3, 6, 7, 8}) five.hide(number, {1});  // hidden for a while
  five.hide(4, {4});
  EXPECT_THAT(five.missing(), IsEmpty()) << "about one pass of ten misses a tag";
  five.hide(4, {3});
  EXPECT_THAT(five.missing(), IsEmpty()) << "two passes of any of ten tags may be missed";
  five.hide(4, {2});
  const std::vector<MissingTag> missing = five.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(4));
  EXPECT_EQ(missing[0].passes, 3);
}

TEST(MissingTags, EvidenceIsThatOfAllTagsOfTheMap) {
  Wall large = wall(5, 0.98, 1, 4);
  large.hide(14, {1});  // one pass of 200 misses a tag
  large.hide(25, {4});
  EXPECT_THAT(large.missing(), IsEmpty()) << "each of 40 tags could have been missed in its last pass";
  large.hide(25, {3});
  const std::vector<MissingTag> missing = large.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(25));
}

TEST(MissingTags, ATagThatIsOftenMissedIsComparedWithItself) {
  Wall five = wall(5);
  five.hide(4, {1, 3, 4});  // dirty
  five.hide(6, {3, 4});
  const std::vector<MissingTag> missing = five.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(6));
}

TEST(MissingTags, ATagBehindAnObstacleIsNotExpected) {
  // From the second half of the images, tag 4 is hidden in every pass.
  Wall two = wall(2);
  for (std::size_t i = 0; i < two.images.size(); ++i) {
    if (two.images[i].map_T_cam.translation().x() > 2.2)
      std::erase_if(two.images[i].detected, [](const DetectedTag& seen) { return seen.tag == wall_tag(4); });
  }
  EXPECT_THAT(two.missing(), IsEmpty());
}

TEST(MissingTags, ATagOfAnOlderMapIsExpectedOnlyBesideItsNeighbours) {
  Wall older = older_wall();
  older.tags.push_back({wall_tag(20), SE3({}, {2.7, 0.4, 2}), kSize_m, 0, {wall_tag(4), wall_tag(5)}});
  older.tags.push_back(
      {wall_tag(21), SE3({}, {2.7, 0.4, 2.5}), kSize_m, 0, {wall_tag(22)}});  // behind the wall
  older.tags.push_back({wall_tag(22), SE3({}, {3.7, 0.4, 2.5}), kSize_m, 0, {wall_tag(21)}});
  older.tags.push_back({wall_tag(23), SE3({}, {9, 0, 2}), kSize_m, 0, {wall_tag(9)}});    // beyond the end
  older.tags.push_back({wall_tag(24), SE3({}, {3, 0.4, 2}), kSize_m, 0, {wall_tag(8)}});  // far from it
  const std::vector<MissingTag> missing = older.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(20));
  EXPECT_FALSE(missing[0].last_seen_s);
}

TEST(MissingTags, ATagBehindItsNeighboursIsNotExpected) {
  // The camera passes between the wall and an obstacle behind it, or there is none.
  constexpr double kLarge_m = 0.5;
  Wall older = older_wall();
  older.tags.push_back(
      {wall_tag(20), SE3({}, {2.7, 0.4, 4.5}), kLarge_m, 0, {wall_tag(4), wall_tag(5), wall_tag(21)}});
  EXPECT_THAT(older.missing(), IsEmpty());
  older.tags.push_back({wall_tag(21), SE3({}, {3.4, 0.4, 4.5}), kLarge_m, 0, {wall_tag(20)}});
  for (PlacedImage& image : older.images) detect(older.tags.back(), image);
  const std::vector<MissingTag> missing = older.missing();
  ASSERT_EQ(missing.size(), 1U) << "nothing hides the neighbour";
  EXPECT_EQ(missing[0].tag, wall_tag(20));
}

TEST(MissingTags, TagsOfAFamilyWithoutADetectionAreNotExpected) {
  Wall older = older_wall();
  const TagId other{FamilyId::Tag25h9, 3};
  older.tags.push_back({other, SE3({}, {2.7, 0.4, 2}), kSize_m, 0, {wall_tag(4), wall_tag(5)}});
  EXPECT_THAT(older.missing(), IsEmpty());
  older.images.front().detected.push_back({{FamilyId::Tag25h9, 7}, {30, 30}, false});
  const std::vector<MissingTag> missing = older.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, other);
}

TEST(MissingTags, ADetectionElsewhereIsNotOneOfTheTag) {
  Wall two = wall(2);
  two.hide(4, {1});
  two.images.back().detected.push_back({wall_tag(4), {30, 30}, false});
  ASSERT_EQ(two.missing().size(), 1U);
}

TEST(MissingTags, ImagesWithoutDetectionsCountOnlyIfOneTagExplainsThat) {
  Wall dark = wall(2);
  for (int i = 10; i < 75; ++i) dark.images[static_cast<std::size_t>(kImagesPerPass + i)].detected.clear();
  EXPECT_THAT(dark.missing(), IsEmpty()) << "several tags were expected";
  Wall sparse = sparse_wall(2);
  sparse.hide(5, {1});
  const std::vector<MissingTag> missing = sparse.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(5));
  for (PlacedImage& image : sparse.images) image.sigma_m = 1;
  EXPECT_THAT(sparse.missing(), IsEmpty()) << "without another tag, the pose has to be accurate";
}

TEST(MissingTags, ACoveredCameraIsNotAMissingTag) {
  Wall sparse = sparse_wall(2);
  for (std::size_t i = kImagesPerPass + 80; i < sparse.images.size(); ++i) sparse.images[i].detected.clear();
  EXPECT_THAT(sparse.missing(), IsEmpty()) << "no detection follows the place of tag 9";
  Wall gone = sparse_wall(3);
  gone.hide(9, {1, 2});
  const std::vector<MissingTag> missing = gone.missing();
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, wall_tag(9));
  EXPECT_EQ(missing[0].passes, 1) << "the last pass does not count";
}

TEST(MissingTags, AMovedTagIsExpectedAtItsPlaceAfterTheMove) {
  const SE3 after({}, {2.6, 0.3, 2});
  for (const bool gone : {false, true}) {
    Wall three = wall(3);
    three.hide(4, {1, 2});
    three.tags[4].map_T_tag = after;
    three.tags[4].since_s = 30;
    for (std::size_t i = kImagesPerPass; i < (gone ? 2 : 3) * kImagesPerPass; ++i)
      detect(three.tags[4], three.images[i]);
    const std::vector<MissingTag> missing = three.missing();
    ASSERT_EQ(missing.size(), gone ? 1U : 0U);
    if (!gone) continue;
    EXPECT_EQ(missing[0].tag, wall_tag(4));
    EXPECT_EQ(missing[0].passes, 1);
    EXPECT_GT(*missing[0].last_seen_s, 30);
  }
}

TEST(ProbabilityOfNone, DecreasesWithImagesAndWithPasses) {
  const std::vector<internal::PassCount> few(10, {20, 20});
  const std::vector<internal::PassCount> many(100, {20, 20});
  EXPECT_DOUBLE_EQ(internal::probability_of_none(0, few), 1);
  double before = 1;
  for (int images = 1; images < 100; ++images) {
    const double now = internal::probability_of_none(images, few);
    EXPECT_LT(now, before);
    EXPECT_LT(internal::probability_of_none(images, many), now);
    before = now;
  }
  EXPECT_NEAR(internal::probability_of_none(4, {}), 0.2, 1e-12) << "uniform distribution of the rate";
}

TEST(ProbabilityOfNone, IsThatOfPassesThatMissTheTag) {
  std::vector<internal::PassCount> passes(99, {30, 30});
  passes.push_back({30, 0});
  EXPECT_NEAR(internal::probability_of_none(30, passes), 0.01, 0.004);
}

}  // namespace
}  // namespace waymark
