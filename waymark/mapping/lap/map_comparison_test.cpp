#include "waymark/mapping/lap/map_comparison.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TagId id(int number) { return {FamilyId::Tag36h11, number}; }

TagMap some_map() {
  TagMap map;
  for (int i = 0; i < 8; ++i)
    map.tags[id(i)] = {.map_T_tag = SE3(SO3::exp({0.1 * i, 1.0, 0.3 * i}), {1.0 * i, 0.5 * (i % 3), 0.3}),
                       .size_m = 0.16};
  return map;
}

TagMap moved(const TagMap& map, const SE3& by) {
  TagMap result = map;
  for (auto& [tag, place] : result.tags) place.map_T_tag = by * place.map_T_tag;
  return result;
}

const SE3 kElsewhere(SO3::exp({0, 0, 1.2}), Eigen::Vector3d(3, -2, 0.5));

TEST(MapComparison, AMapAgreesWithItselfInAnyFrame) {
  const auto comparison = compare_maps(some_map(), moved(some_map(), kElsewhere));
  ASSERT_TRUE(comparison) << to_string(comparison.error());
  EXPECT_EQ(comparison->agreeing, 8);
  EXPECT_LT((comparison->map_T_prior * kElsewhere).log().norm(), 1e-9);
  EXPECT_TRUE(describe(*comparison).empty());
}

/// If their corners are printed inaccurately, tags appear tilted by a degree or two.
TEST(MapComparison, ALongRowOfTagsIsAlignedByTheirPositions) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    TagMap map = some_map();
    for (auto& [tag, place] : map.tags)
      place.map_T_tag = SE3(place.map_T_tag.rotation(), 3 * place.map_T_tag.translation());
    const TagMap prior = moved(map, kElsewhere);
    for (auto& [tag, place] : map.tags) {
      const Eigen::Vector3d tilt(random.normal(0, 0.03), random.normal(0, 0.03), 0);
      place.map_T_tag = SE3(SO3::exp(tilt) * place.map_T_tag.rotation(), place.map_T_tag.translation());
    }
    const auto comparison = compare_maps(map, prior);
    ASSERT_TRUE(comparison) << "seed " << seed;
    EXPECT_GE(comparison->agreeing, 7) << "seed " << seed;
    EXPECT_LT(comparison->rms_m, 0.01) << "seed " << seed;
  }
}

TEST(MapComparison, ReportsChangedTags) {
  const TagMap map = some_map();
  TagMap prior = moved(map, kElsewhere);
  std::swap(prior.tags[id(5)].map_T_tag, prior.tags[id(6)].map_T_tag);
  prior.tags[id(2)].map_T_tag = SE3(SO3(), Eigen::Vector3d(0.2, 0, 0)) * prior.tags[id(2)].map_T_tag;
  prior.tags[id(3)].size_m = 0.2;
  prior.tags.erase(id(7));
  prior.tags[id(9)] = {.map_T_tag = kElsewhere, .size_m = 0.16};
  const auto comparison = compare_maps(map, prior);
  ASSERT_TRUE(comparison);
  const std::vector<std::string> changes = describe(*comparison);
  EXPECT_THAT(changes, ElementsAre(AllOf(HasSubstr("tag36h11:2"), HasSubstr("0.20 m"), HasSubstr("0 deg")),
                                   AllOf(HasSubstr("tag36h11:3"), HasSubstr("size")),
                                   HasSubstr("tag36h11:5 and tag36h11:6"), HasSubstr("tag36h11:7"),
                                   HasSubstr("tag36h11:9")));
  for (const std::string& change : changes) testing::expect_on_page("map", change);
}

TEST(MapComparison, ReportsDifferentTagSizes) {
  TagMap larger = moved(some_map(), kElsewhere);
  for (auto& [tag, place] : larger.tags)
    place = {.map_T_tag = SE3(place.map_T_tag.rotation(), 1.25 * place.map_T_tag.translation()),
             .size_m = 0.2};
  const auto comparison = compare_maps(larger, some_map());
  ASSERT_FALSE(comparison);
  EXPECT_EQ(comparison.error().code, ErrorCode::NotFound);
  EXPECT_THAT(comparison.error().message, HasSubstr("1.25 times"));
  testing::expect_on_page("map", comparison.error());
}

TEST(MapComparison, RejectsMapsOfDifferentPlaces) {
  TagMap other = some_map();
  Random random(1);
  for (auto& [tag, place] : other.tags)
    place.map_T_tag = SE3(SO3::exp({random.normal(), random.normal(), random.normal()}),
                          {10 * random.normal(), 10 * random.normal(), 0});
  const auto comparison = compare_maps(some_map(), other);
  ASSERT_FALSE(comparison);
  testing::expect_on_page("map", comparison.error());
  EXPECT_FALSE(compare_maps(some_map(), {}));
}

TEST(MapComparison, FewOfManyTagsAgreeByChance) {
  EXPECT_FALSE(agree_by_chance(1, 5)) << "too few to judge";
  EXPECT_TRUE(agree_by_chance(1, 6));
  EXPECT_FALSE(agree_by_chance(2, 8)) << "a quarter";
  EXPECT_TRUE(agree_by_chance(5, 24));
}

TEST(MapComparison, PointsAreComparedByNumberAndPosition) {
  const TagMap map = some_map();
  std::vector<PriorPoint> prior;
  for (const auto& [tag, place] : moved(map, kElsewhere).tags)
    prior.push_back({tag.number, place.map_T_tag.translation().head<2>()});
  const auto same = compare_points(map, prior);
  ASSERT_TRUE(same) << to_string(same.error());
  EXPECT_EQ(same->agreeing, 8);
  EXPECT_LT(same->rms_m, 1e-9);
  EXPECT_TRUE(describe(*same).empty());
  std::swap(prior[5].map_p, prior[6].map_p);
  prior[2].map_p.x() += 0.01;
  const auto swapped = compare_points(map, prior);
  ASSERT_TRUE(swapped);
  EXPECT_THAT(describe(*swapped), ElementsAre(HasSubstr("tag36h11:5 and tag36h11:6")));
  EXPECT_GT(swapped->rms_m, 0.001);
  EXPECT_LT(swapped->rms_m, 0.01);
  prior.resize(2);
  EXPECT_FALSE(compare_points(map, prior));
}

}  // namespace
}  // namespace waymark
