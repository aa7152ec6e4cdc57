// A second lap improves an existing map: circuit24, maps and laps of different seeds.
#include <cstdlib>

#include <gmock/gmock.h>

#include "tests/support/circuit_lap.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/pose/homography.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using namespace test;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

double rmse(const TagMap& map) {
  double squares = 0;
  for (const auto& [id, mapped] : map.tags)
    squares +=
        (mapped.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation()).squaredNorm();
  return std::sqrt(squares / static_cast<double>(map.tags.size()));
}

LapInput extending(LapInput lap, const TagMap& map, std::set<TagId> frozen = {}) {
  lap.prior = LapPrior{.map = map, .frozen = std::move(frozen)};
  return lap;
}

TEST(MapExtension, ASecondLapImprovesTheMapConsistently) {
  const int pairs = std::getenv("WAYMARK_FULL") != nullptr ? 20 : 3;
  double before = 0;
  double after = 0;
  Score score;
  for (int i = 0; i < pairs; ++i) {
    const BundleMap first = map_of(drive(static_cast<std::uint64_t>(101 + 2 * i)).input, exact_sizes());
    const BundleMap second =
        map_of(extending(drive(static_cast<std::uint64_t>(102 + 2 * i)).input, first.map), exact_sizes());
    EXPECT_EQ(second.prior_agreeing, 24);
    EXPECT_TRUE(second.prior_warnings.empty());
    before += std::pow(rmse(first.map), 2) / pairs;
    after += std::pow(rmse(second.map), 2) / pairs;
    for (const auto& [id, mapped] : second.map.tags) {
      if (!mapped.covariance) continue;
      score.add(mapped.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation(),
                position_covariance(mapped.map_T_tag, *mapped.covariance));
    }
  }
  std::printf(
      "%d pairs of laps: tags %.4f m rmse after one lap, %.4f after two; %.3f of the stated covariance, "
      "%.3f in their 95 %% ellipsoids\n",
      pairs, std::sqrt(before), std::sqrt(after), score.ratio(), score.coverage());
  EXPECT_LT(std::sqrt(after), 0.9 * std::sqrt(before));
  EXPECT_GT(score.coverage(), 0.92);
  constexpr int kMinPairs = 10;  // errors of one map are correlated
  if (pairs >= kMinPairs) {
    EXPECT_LT(score.coverage(), 0.98);
  }
}

TEST(MapExtension, ReportsAMovedTagAndUsesItsNewPose) {
  TagMap map = map_of(drive(121).input).map;
  const TagMap truth = map;
  map.tags.at(tag(9)).map_T_tag = SE3(SO3(), Eigen::Vector3d(0.12, 0, 0)) * map.tags.at(tag(9)).map_T_tag;
  std::swap(map.tags.at(tag(14)).map_T_tag, map.tags.at(tag(15)).map_T_tag);
  const Lap lap = drive(122);
  const BundleMap extended = map_of(extending(lap.input, map));
  EXPECT_THAT(extended.prior_warnings,
              ::testing::UnorderedElementsAre(AllOf(HasSubstr("tag36h11:9 "), HasSubstr(" 12")),
                                              HasSubstr("tag36h11:14 and tag36h11:15")));
  EXPECT_EQ(extended.prior_agreeing, 21);
  EXPECT_LT(worst_of_others(extended, {}), 0.04);
}

/// Changes detections to those of tags with misplaced corners (print and mounting), equal in all images: the
/// homography of each tag's plane shifts them.
void print(double sigma_m, std::uint64_t seed, LapInput& lap) {
  Random random(seed);
  std::map<TagId, std::array<Eigen::Vector2d, 4>> printed;
  std::array<Eigen::Vector2d, 4> right;
  for (std::size_t c = 0; c < 4; ++c) right.at(c) = tag_corners(*lap.sizes.default_size_m).at(c).head<2>();
  for (const auto& [id, mapped] : circuit().tags.tags) {
    printed[id] = right;
    for (Eigen::Vector2d& corner : printed[id]) {
      corner.x() += random.normal(0, sigma_m);
      corner.y() += random.normal(0, sigma_m);
    }
  }
  for (TagFrame& frame : lap.frames) {
    for (TagDetection& seen : frame.detections) {
      const auto image = homography_dlt(right, seen.corners_px);
      ASSERT_TRUE(image);
      for (std::size_t c = 0; c < 4; ++c)
        seen.corners_px.at(c) = apply_homography(*image, printed.at(seen.tag).at(c));
    }
  }
}

/// Tags measured by hand: errors of 2 mm and 2 mrad.
TagMap measured(std::uint64_t seed) {
  constexpr double kOff = 0.002;
  Random random(seed);
  TagMap map = circuit().tags;
  for (auto& [id, tag] : map.tags) {
    Vector6 off;
    for (double& number : off) number = random.normal(0, kOff);
    const SE3 true_place = tag.map_T_tag;
    tag.map_T_tag =
        SE3(SO3::exp(off.tail<3>()) * true_place.rotation(), true_place.translation() + off.head<3>());
    tag.covariance =
        from_coordinate_covariance(tag.map_T_tag, Matrix6(kOff * kOff * Matrix6::Identity())).covariance;
  }
  return map;
}

/// Tag 4 is so far from the anchor that the anchor's print error could explain three centimetres, but the
/// other tags exclude that. Print errors of neighbouring tags, which are not modelled, distort a lap too: one
/// tag in fifty may be reported as moved.
TEST(MapExtension, FindsMovedTagsAmongInaccuratelyPrintedTags) {
  constexpr double kPrinted_m = 0.0004;
  const int laps = std::getenv("WAYMARK_FULL") != nullptr ? 20 : 2;
  int wrong = 0;
  for (std::uint64_t seed = 151; seed < 151 + static_cast<std::uint64_t>(laps); ++seed) {
    TagMap map = measured(seed);
    SE3& moved = map.tags.at(tag(4)).map_T_tag;
    moved = SE3(SO3(), Eigen::Vector3d(0.02, -0.0224, 0)) * moved;
    SE3& turned = map.tags.at(tag(22)).map_T_tag;
    turned = turned * SE3(SO3::exp({0, 0, to_radians(5)}), Eigen::Vector3d::Zero());
    Lap lap = drive(seed);
    print(kPrinted_m, seed, lap.input);
    const BundleMap extended = map_of(extending(lap.input, map));
    EXPECT_THAT(extended.prior_warnings, Contains(HasSubstr("tag36h11:4 "))) << "seed " << seed;
    EXPECT_THAT(extended.prior_warnings, Contains(HasSubstr("tag36h11:22 "))) << "seed " << seed;
    EXPECT_EQ(extended.prior_agreeing + static_cast<int>(extended.prior_warnings.size()), 24);
    wrong += static_cast<int>(extended.prior_warnings.size()) - 2;
  }
  std::printf("%d of %d unmoved tags reported as moved\n", wrong, 22 * laps);
  EXPECT_LE(wrong, 22 * laps / 50);
}

TEST(MapExtension, KeepsUnobservedTagsAndFixesFrozenOnes) {
  const BundleMap first = map_of(drive(131).input);
  Lap lap = drive(132);
  for (TagFrame& frame : lap.input.frames)
    std::erase_if(frame.detections, [](const TagDetection& d) { return d.tag == tag(10); });
  const BundleMap extended = map_of(extending(lap.input, first.map, {tag(5), tag(10)}));
  ASSERT_EQ(extended.map.tags.size(), 24U);
  for (int frozen : {5, 10})
    EXPECT_EQ(extended.map.tags.at(tag(frozen)).map_T_tag, first.map.tags.at(tag(frozen)).map_T_tag);
  EXPECT_EQ(extended.observations.at(tag(10)), 0);
  const BundleMap free = map_of(extending(lap.input, first.map));
  EXPECT_FALSE(free.map.tags.at(tag(10)).map_T_tag == first.map.tags.at(tag(10)).map_T_tag)
      << "corrections of the whole map move it";
  EXPECT_LT(
      (free.map.tags.at(tag(10)).map_T_tag.translation() - first.map.tags.at(tag(10)).map_T_tag.translation())
          .norm(),
      0.03);
}

TEST(MapExtension, ReportsATagThatWasTakenAway) {
  const BundleMap first = map_of(drive(161).input);
  EXPECT_THAT(map_of(extending(drive(162).input, first.map)).missing_tags, ::testing::IsEmpty());
  int reported = 0;
  constexpr int kTags = 6;
  for (int number = 1; number <= kTags; ++number) {
    Lap lap = drive(162);
    for (TagFrame& frame : lap.input.frames)
      std::erase_if(frame.detections, [&](const TagDetection& d) { return d.tag == tag(3 * number); });
    const BundleMap extended = map_of(extending(lap.input, first.map));
    reported += static_cast<int>(extended.missing_tags.size());
    for (const MissingTag& missing : extended.missing_tags) EXPECT_EQ(missing.tag, tag(3 * number));
  }
  std::printf("%d of %d tags that were taken away are reported\n", reported, kTags);
  EXPECT_GE(reported, kTags - 1);
}

TEST(MapExtension, RejectsALapOfAnotherPlace) {
  TagMap elsewhere;
  Random random(5);
  for (const auto& [id, mapped] : circuit().tags.tags) {
    elsewhere.tags[id] = {SE3(SO3::exp({random.normal(), random.normal(), random.normal()}),
                              {9 * random.normal(), 9 * random.normal(), 0.3}),
                          0.16, Matrix6(1e-4 * Matrix6::Identity())};
  }
  const auto map = map_by_bundle(extending(drive(141).input, elsewhere));
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::NotFound);
  testing::expect_on_page("map", map.error());
}

}  // namespace
}  // namespace waymark
