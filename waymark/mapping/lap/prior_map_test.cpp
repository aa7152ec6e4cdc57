// Tests that the pose errors of tags with inaccurately printed corners are consistent with the stated
// covariance. Then tests a lap that is tied to an existing map: common errors of the map's tags, unmoved
// tags, and fixed tags.
#include "waymark/mapping/lap/prior_map.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "tests/support/golden_page.hpp"
#include "tests/support/ring_drive.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::internal {
namespace {

constexpr double kSize_m = 0.16;
constexpr double kPrinted_m = 0.0005;

/// A camera that passes a tag at known poses, and its noise-free corners, each with a print error.
struct Pass {
  Bundle bundle{};
  PoseIndex tag = 0;
};

Pass pass(std::uint64_t seed) {
  Random random(seed);
  std::array<Eigen::Vector3d, 4> printed = tag_corners(kSize_m);
  for (Eigen::Vector3d& corner : printed) {
    corner.x() += random.normal(0, kPrinted_m);
    corner.y() += random.normal(0, kPrinted_m);
  }
  Pass made;
  Bundle& bundle = made.bundle;
  bundle.cameras.push_back(
      CameraModel::make(PinholeRadtan{.fx = 430, .fy = 430, .cx = 320, .cy = 240, .coefficients = 4}, 640,
                        480)
          .value());
  const PoseIndex map = bundle.add({}, true);
  const PoseIndex mounting = bundle.add({}, true);
  made.tag = bundle.add({});
  constexpr int kViews = 12;
  for (int i = 0; i < kViews; ++i) {
    const double nearer_m = 0.06 * i;
    const SE3 map_T_cam(SO3::exp({0.05, 0.02 * i, 0}), {-0.4 + 0.02 * i, 0.1, -1.8 + nearer_m});
    CornerTerm term{.rig = bundle.add(map_T_cam, true), .cam = mounting, .body = map, .tag = made.tag};
    term.factor.size_m = kSize_m;
    term.factor.whitening *= 5;  // a sigma of a fifth of a pixel
    for (std::size_t c = 0; c < 4; ++c)
      term.factor.corners_px.at(c) = *bundle.cameras[0].project(map_T_cam.inverse() * printed.at(c));
    bundle.corners.push_back(term);
  }
  return made;
}

TEST(PrintedTags, HaveAConsistentPoseCovariance) {
  constexpr int kTags = 200;
  double chi2 = 0;
  double turned2 = 0;
  for (std::uint64_t seed = 1; seed <= kTags; ++seed) {
    Pass made = pass(seed);
    ASSERT_TRUE(solve(made.bundle).usable());
    const Vector6 off = made.bundle.poses[made.tag].value.log();
    const std::map<PoseIndex, Matrix6> P = covariance_of_print(made.bundle, kPrinted_m);
    ASSERT_EQ(P.size(), 1U);
    chi2 += off.dot(P.at(made.tag).ldlt().solve(off)) / kTags;
    turned2 += off.segment<2>(3).squaredNorm() / (2 * kTags);
  }
  std::printf("  chi2 %.2f of 6 degrees of freedom; tilted by %.1f mrad, RMS\n", chi2,
              1000 * std::sqrt(turned2));
  EXPECT_NEAR(chi2, 6, 0.9);
}

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

Matrix6 random_covariance(Random& random, double sigma) {
  Matrix6 L;
  for (double& x : L.reshaped()) x = sigma * random.normal();
  return L * L.transpose() + 1e-3 * sigma * sigma * Matrix6::Identity();
}

double smallest_eigenvalue(const Matrix6& P) {
  return Eigen::SelfAdjointEigenSolver<Matrix6>(P, Eigen::EigenvaluesOnly).eigenvalues().minCoeff();
}

/// A map made from laps: the anchor is exact, and the other tags have covariances.
TagMap map_of_laps(std::uint64_t seed, int tags) {
  Random random(seed);
  TagMap map;
  map.tags[ring_tag(0)] = {.size_m = 0.16};
  const Matrix6 shared = random_covariance(random, 0.01);
  for (int i = 1; i <= tags; ++i)
    map.tags[ring_tag(i)] = {.size_m = 0.16,
                             .covariance = Matrix6(shared + random_covariance(random, 0.003))};
  map.tags[ring_tag(tags)].tie = TagTie{ring_tag(1), shared};
  return map;
}

TEST(CommonCovariance, IsNoLargerThanThatOfAnyTag) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const TagMap map = map_of_laps(seed, 6);
    const Matrix6 common = common_covariance(map);
    EXPECT_GT(common.trace(), 0) << seed;
    EXPECT_GT(smallest_eigenvalue(common), -1e-12) << seed;
    for (const auto& [id, tag] : map.tags) {
      if (!tag.covariance || tag.tie) continue;
      EXPECT_GT(smallest_eigenvalue(*tag.covariance - common), -1e-6 * tag.covariance->norm())
          << seed << " " << id.number;
    }
  }
}

TEST(CommonCovariance, FollowsTheFrame) {
  const SE3 by(SO3::exp({0.3, -0.2, 1}), {2, -1, 0.5});
  const Matrix6 Ad = by.adjoint();
  TagMap map = map_of_laps(3, 2);  // with two tags, the order does not matter
  const Matrix6 here = common_covariance(map);
  for (auto& [id, tag] : map.tags) {
    if (tag.covariance) tag.covariance = Matrix6(Ad * *tag.covariance * Ad.transpose());
  }
  const Matrix6 expected = Ad * here * Ad.transpose();
  EXPECT_LT((common_covariance(map) - expected).norm(), 1e-4 * expected.norm());
}

TEST(CommonCovariance, IsThatOfASingleTagAndZeroForMeasuredTags) {
  TagMap map = map_of_laps(4, 1);
  map.tags[ring_tag(1)].tie.reset();
  EXPECT_LT((common_covariance(map) - *map.tags[ring_tag(1)].covariance).norm(), 1e-9);
  map.tags[ring_tag(0)].covariance = Matrix6(1e-4 * Matrix6::Identity());
  EXPECT_TRUE(is_measured(map));
  EXPECT_EQ(common_covariance(map), Matrix6::Zero()) << "each tag was measured individually";
  EXPECT_EQ(common_covariance({}), Matrix6::Zero());
}

/// An adjusted lap, and a map of the same place from another source.
struct Extension {
  RingDrive drive;
  LapBundle lap;
  BundleCovariance known{};
  LapPrior prior{};

  explicit Extension(std::uint64_t seed = 1)
      : drive(drive_ring({.noise_px = 0.05, .seed = seed})),
        lap(lap_bundle(drive.lap, test::true_start(drive))) {
    EXPECT_TRUE(solve(lap.bundle).usable());
    known = covariance(lap.bundle);
    prior.map = drive.tags;
    for (auto& [id, tag] : prior.map.tags) {
      if (id != ring_tag(0)) tag.covariance = Matrix6(1e-6 * Matrix6::Identity());
    }
  }
  Result<TiedPrior> tie() { return tie_to_prior(prior, drive.lap.anchor, known, lap); }
  SE3& place(int number) { return lap.bundle.poses[lap.tags.at(ring_tag(number))].value; }
};

TEST(TieToPrior, UnmovedTagsAgree) {
  Extension e;
  const auto tied = e.tie();
  ASSERT_TRUE(tied) << to_string(tied.error());
  EXPECT_EQ(tied->agreeing.size(), 12U);
  EXPECT_THAT(tied->moved, IsEmpty());
  EXPECT_THAT(tied->warnings, IsEmpty());
  EXPECT_TRUE(e.lap.bundle.poses[e.lap.tags.at(ring_tag(0))].fixed) << "exact in the prior map";
  EXPECT_FALSE(e.lap.anchor) << "the lap's own anchor no longer defines the map";
  const double before = covariance(e.lap.bundle).poses[e.lap.tags.at(ring_tag(5))].trace();
  EXPECT_LT(before, e.known.poses[e.lap.tags.at(ring_tag(5))].trace()) << "the prior map adds information";
  ASSERT_TRUE(solve(e.lap.bundle).usable());
  for (int number = 0; number < 12; ++number)
    EXPECT_LT((e.place(number).translation() - e.drive.tags.tags.at(ring_tag(number)).map_T_tag.translation())
                  .norm(),
              0.005)
        << number;
}

TEST(TieToPrior, AMovedTagIsReportedAndItsOldPoseStays) {
  Extension e;
  SE3& old = e.prior.map.tags.at(ring_tag(4)).map_T_tag;
  old = SE3({}, {0.2, 0, 0}) * old;
  const auto tied = e.tie();
  ASSERT_TRUE(tied);
  EXPECT_THAT(tied->moved, ElementsAre(ring_tag(4)));
  EXPECT_THAT(tied->warnings, ElementsAre(AllOf(HasSubstr("tag36h11:4"), HasSubstr("20"))));
  testing::expect_on_page("map", tied->warnings.front());
  EXPECT_NE(tied->before.at(ring_tag(4)), e.lap.tags.at(ring_tag(4)));
  EXPECT_LT(minus(e.lap.bundle.poses[tied->before.at(ring_tag(4))].value, old).norm(), 1e-12);
  EXPECT_EQ(tied->before.at(ring_tag(5)), e.lap.tags.at(ring_tag(5)));
}

TEST(TieToPrior, SwappedTagsAreReportedOnceAsAPair) {
  Extension e;
  std::swap(e.prior.map.tags.at(ring_tag(4)).map_T_tag, e.prior.map.tags.at(ring_tag(7)).map_T_tag);
  const auto tied = e.tie();
  ASSERT_TRUE(tied);
  EXPECT_THAT(tied->warnings, ElementsAre(HasSubstr("tag36h11:4 and tag36h11:7")));
  testing::expect_on_page("map", tied->warnings.front());
  EXPECT_EQ(tied->agreeing.size(), 10U);
}

TEST(TieToPrior, FrozenTagsKeepTheirPoses) {
  Extension e;
  e.prior.frozen = {ring_tag(3)};
  e.prior.map.tags.at(ring_tag(3)).map_T_tag =
      SE3({}, {0.001, 0, 0}) * e.prior.map.tags.at(ring_tag(3)).map_T_tag;
  const SE3 held = e.prior.map.tags.at(ring_tag(3)).map_T_tag;
  ASSERT_TRUE(e.tie());
  ASSERT_TRUE(solve(e.lap.bundle).usable());
  EXPECT_EQ(e.place(3).matrix(), held.matrix());
  EXPECT_TRUE(is_held(e.prior, ring_tag(3), e.prior.map.tags.at(ring_tag(3))));
  EXPECT_TRUE(is_held(e.prior, ring_tag(0), e.prior.map.tags.at(ring_tag(0)))) << "exact in the prior map";
  EXPECT_FALSE(is_held(e.prior, ring_tag(1), e.prior.map.tags.at(ring_tag(1))));
}

/// The anchor was moved since the map was made, so a lap that uses it is displaced with all its tags.
TEST(TieToPrior, ALapWithAMovedAnchorIsAlignedWithTheMap) {
  Extension e;
  const SE3 by(SO3::from_rpy(0, 0, 0.4), {0.3, -0.2, 0});
  e.prior.map.tags.at(ring_tag(0)).map_T_tag = by * e.prior.map.tags.at(ring_tag(0)).map_T_tag;
  e.drive.lap.map_T_anchor = by * e.drive.lap.map_T_anchor;
  ChainResult start = test::true_start(e.drive);
  for (auto& [id, tag] : start.map.tags) tag.map_T_tag = by * tag.map_T_tag;
  for (StampedPose& pose : start.trajectory) pose.map_T_base = by * pose.map_T_base;
  e.lap = lap_bundle(e.drive.lap, start);
  ASSERT_TRUE(solve(e.lap.bundle).usable());
  e.known = covariance(e.lap.bundle);
  const auto tied = e.tie();
  ASSERT_TRUE(tied) << to_string(tied.error());
  EXPECT_EQ(tied->agreeing.size(), 11U);
  EXPECT_THAT(tied->moved, ElementsAre(ring_tag(0)));
  ASSERT_TRUE(solve(e.lap.bundle).usable());
  for (int number = 0; number < 12; ++number)
    EXPECT_LT(minus(e.place(number), e.drive.tags.tags.at(ring_tag(number)).map_T_tag).norm(), 0.02)
        << number;
}

TEST(TieToPrior, RejectsAMapOfAnotherPlaceWithAHint) {
  Extension e;
  Random random(8);
  for (auto& [id, tag] : e.prior.map.tags)
    tag.map_T_tag = SE3(SO3::exp({random.normal(), random.normal(), random.normal()}),
                        {9 * random.normal(), 9 * random.normal(), 0});
  const auto tied = e.tie();
  ASSERT_FALSE(tied);
  EXPECT_EQ(tied.error().code, ErrorCode::NotFound);
  testing::expect_on_page("map", tied.error());
  EXPECT_FALSE(tied.error().hint.empty());
  Extension strangers;
  TagMap renamed;
  for (const auto& [id, tag] : strangers.prior.map.tags) renamed.tags[ring_tag(100 + id.number)] = tag;
  strangers.prior.map = renamed;
  EXPECT_FALSE(strangers.tie()) << "the maps have no tag in common";
}

TEST(TieToPrior, AnInconsistentTagOfAMeasuredMapIsUntied) {
  Extension e(3);
  for (auto& [id, tag] : e.prior.map.tags) tag.covariance = Matrix6(1e-6 * Matrix6::Identity());
  ASSERT_TRUE(is_measured(e.prior.map));
  SE3& moved = e.prior.map.tags.at(ring_tag(6)).map_T_tag;
  moved = SE3({}, {0.03, 0.02, 0}) * moved;
  auto tied = e.tie();
  ASSERT_TRUE(tied);
  ASSERT_THAT(tied->agreeing, Contains(ring_tag(6))) << "roughly";
  ASSERT_TRUE(solve(e.lap.bundle).usable());
  int rounds = 0;
  while (rounds < 24 && revise_agreement(e.prior, e.lap, *tied)) {
    ASSERT_TRUE(solve(e.lap.bundle).usable());
    ++rounds;
  }
  EXPECT_LT(rounds, 24) << "it terminates";
  EXPECT_THAT(tied->moved, ElementsAre(ring_tag(6)));
  EXPECT_THAT(tied->warnings, ElementsAre(::testing::ContainsRegex("tag36h11:6 .* 3[5-7] mm")));
  EXPECT_LT((e.place(6).translation() - e.drive.tags.tags.at(ring_tag(6)).map_T_tag.translation()).norm(),
            0.01);
}

TEST(TieToPrior, AMapFromLapsIsNotRevised) {
  Extension e;
  auto tied = e.tie();
  ASSERT_TRUE(tied);
  EXPECT_FALSE(revise_agreement(e.prior, e.lap, *tied));
}

TEST(TiePairs, ContainOnlyFreeTags) {
  Extension e;
  e.drive.lap.prior = e.prior;
  e.prior.frozen = {ring_tag(3)};
  const auto tied = e.tie();
  ASSERT_TRUE(tied);
  const TiePairs pairs = pairs_to_tie(e.drive.lap, e.lap, *tied);
  ASSERT_EQ(pairs.tags.size(), pairs.poses.size());
  EXPECT_GE(pairs.tags.size(), 8U) << "neighbours in images";
  for (std::size_t i = 0; i < pairs.tags.size(); ++i) {
    for (const TagId& id : {pairs.tags[i].first, pairs.tags[i].second}) {
      EXPECT_NE(id, ring_tag(0));
      EXPECT_NE(id, ring_tag(3));
    }
    EXPECT_EQ(pairs.poses[i].first, e.lap.tags.at(pairs.tags[i].first));
    EXPECT_EQ(pairs.poses[i].second, e.lap.tags.at(pairs.tags[i].second));
  }
}

}  // namespace
}  // namespace waymark::internal
