// Tests each warning about a scene's map on its own, using a map with true poses. Then tests weakly connected
// parts of a row of tags, and the consistency of residuals with corner covariances.
#include "waymark/mapping/scene/scene_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::true_scene_map;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

SceneMap good_map() {
  static const RigScene made = rig_scene();
  return true_scene_map(made);
}

void expect_on_scene_page(const SceneMap& map) {
  for (const std::string& warning : scene_warnings(map)) testing::expect_on_page("scene", warning);
}

std::vector<TagId> tags(const std::vector<std::size_t>& numbers) {
  std::vector<TagId> ids;
  for (const std::size_t number : numbers) ids.push_back(rig_tag(number));
  return ids;
}

TEST(SceneWarnings, AreEmptyForATrueMap) { EXPECT_THAT(scene_warnings(good_map()), IsEmpty()); }

TEST(SceneWarnings, ReportAnInconsistentGivenPoseWithItsResidual) {
  SceneMap map = good_map();
  SE3& tag = map.problem.bundle.poses[map.problem.tags[0][0]].value;
  tag = tag * at(0.001, 0, 0);
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("tag 0 "), HasSubstr("0.0010 m"),
                                                     HasSubstr("0.00 deg"), HasSubstr("10.0 sigma"))));
  expect_on_scene_page(map);
  map.problem.bundle.poses[map.problem.tags[0][0]].fixed = true;
  EXPECT_THAT(scene_warnings(map), IsEmpty()) << "the pose is fixed";
  SE3& cam = map.problem.bundle.poses[map.problem.cameras[0]].value;
  cam = cam * at(0, 0, 0, 0, 0.02);
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("cam0 "), HasSubstr("1.15 deg"))));
  map.placed[map.problem.cameras[0]] = 0;
  EXPECT_THAT(scene_warnings(map), IsEmpty()) << "the camera is not placed";
}

TEST(SceneWarnings, OmitDifferencesFromGivenPosesThatNoPixelResolves) {
  RigScene made = rig_scene();
  made.scene.cameras[0].body_T_cam =
      ScenePrior::of(made.cameras[0], Eigen::Vector3d::Constant(1e-6), Eigen::Vector3d::Constant(1e-6));
  SceneMap map = true_scene_map(made);
  SE3& cam = map.problem.bundle.poses[map.problem.cameras[0]].value;
  const SE3 given = cam;
  cam = given * at(1e-5, 0, 0, 0, 1e-5);
  EXPECT_THAT(scene_warnings(map), IsEmpty()) << "14 sigma, but less than 0.01 px";
  cam = given * at(0.001, 0, 0);
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("cam0 "), HasSubstr("1000.0 sigma"))));
}

TEST(SceneWarnings, ReportMovedTags) {
  SceneMap map = good_map();
  map.moved_tags.push_back({.tag = rig_tag(3),
                            .earlier = map.problem.tags[0][3],
                            .last_before_s = 12,
                            .first_after_s = 30,
                            .distance_m = 0.1,
                            .angle_rad = 0.5});
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("tag 3:"), HasSubstr("0.100 m"),
                                                     HasSubstr("28.6 deg"), HasSubstr("30.0 s"))));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, ReportTwoTagsWithOneId) {
  SceneMap map = good_map();
  DuplicateTag duplicate{.tag = rig_tag(3),
                         .other = map.problem.tags[0][3],
                         .here_m = {1, 2, 3},
                         .there_m = {4, 6, 3},
                         .distance_m = 5,
                         .here = 40,
                         .there = 20};
  map.duplicate_tags = {duplicate};
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(HasSubstr("tag 3:"), HasSubstr("5.00 m"), HasSubstr("40 and 20"),
                                HasSubstr("(1.00, 2.00, 3.00)"), HasSubstr("(4.00, 6.00, 3.00)"))));
  expect_on_scene_page(map);
  duplicate.at_once = true;
  map.duplicate_tags = {duplicate};
  expect_on_scene_page(map);
  duplicate.at_once = false;
  duplicate.one_after_the_other = true;
  map.duplicate_tags = {duplicate};
  expect_on_scene_page(map);
  map.duplicate_tags.assign(7, duplicate);
  EXPECT_THAT(scene_warnings(map), SizeIs(6));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, ReportInconsistentDistancesAndCoordinates) {
  RigScene made = rig_scene();
  const double true_m = (made.tags[2].translation() - made.tags[5].translation()).norm();
  made.scene.distances = {{2, 5, -1, -1, true_m + 0.05, 0.01}};
  made.scene.coordinates = {{3, -1, Eigen::Vector3d::UnitX(), made.tags[3].translation().x() - 0.04, 0.01}};
  const SceneMap map = true_scene_map(made);
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(HasSubstr("tags 2 and 5"), HasSubstr("-0.0500 m"), HasSubstr("5.0 sigma")),
                          AllOf(HasSubstr("tag 3"), HasSubstr("+0.0400 m"), HasSubstr("4.0 sigma"))));
  expect_on_scene_page(map);
  made.scene.distances[0].sigma_m = 0.02;
  made.scene.coordinates[0].sigma_m = 0.02;
  EXPECT_THAT(scene_warnings(true_scene_map(made)), IsEmpty()) << "within three deviations";
}

TEST(SceneWarnings, ReportATagSizeFarFromTheGivenOne) {
  SceneMap map = good_map();
  map.size_scale = 1.02;
  map.size_prior_sigma = 0.005;
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("1.020 times"), HasSubstr("4.0 sigma"))));
  expect_on_scene_page(map);
  map.size_prior_sigma = 0.01;
  EXPECT_THAT(scene_warnings(map), IsEmpty());
}

TEST(SceneWarnings, ReportCameraParametersFarFromTheGivenOnes) {
  SceneMap map = good_map();
  FoundIntrinsics lens{.camera = 0, .names = {"fx", "fy"}};
  lens.given = Eigen::Vector2d(442, 444);
  lens.prior_sigma = Eigen::Vector2d(4, 4);
  lens.found = Eigen::Vector2d(442 + 20, 444 - 4);
  lens.sigma = Eigen::Vector2d(1, 1);
  map.intrinsics = {lens};
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(HasSubstr("cam0"), HasSubstr("fx"), HasSubstr("462"),
                                                     HasSubstr("442"), HasSubstr("5.0 sigma"))));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, ReportTagsWithRejectedObservationsKnownOnesFirst) {
  SceneMap map = good_map();
  const auto reject = [&](std::size_t tag, int every) {
    int k = 0;
    for (CornerTerm& term : map.problem.bundle.corners) {
      if (term.tag == map.problem.tags[0][tag]) term.used = term.used && ++k % every != 0;
    }
  };
  reject(5, 1);
  reject(0, 2);
  const auto words = scene_warnings(map);
  ASSERT_THAT(words, SizeIs(2));
  EXPECT_THAT(words[0], AllOf(HasSubstr("of tag 0"), HasSubstr("given pose")));
  EXPECT_THAT(words[1], AllOf(HasSubstr("of tag 5"), Not(HasSubstr("given pose"))));
  expect_on_scene_page(map);
  reject(0, 1);
  EXPECT_THAT(scene_warnings(map), Contains(StartsWith("tag 0:")));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, ListAtMostFiveTagsOfAKind) {
  SceneMap map = good_map();
  for (CornerTerm& term : map.problem.bundle.corners) term.used = false;
  EXPECT_THAT(scene_warnings(map), SizeIs(6)) << "five, and the known tag without accepted observations";
}

TEST(SceneWarnings, ListWeaklyConnectedTagsAsRanges) {
  SceneMap map = good_map();
  map.thin_cuts = {{tags({3, 4, 5, 7}), tags({2}), 2}};
  map.left_out_cuts = {{tags({9}), tags({0, 1}), 1}};
  map.undetermined = tags({1, 2});
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(StartsWith("tag 9:"), HasSubstr("one observation of tags 0, 1")),
                          AllOf(StartsWith("tags 3-5, 7:"), HasSubstr("2 observations of tag 2")),
                          StartsWith("tags 1, 2:")));
  expect_on_scene_page(map);
  std::vector<std::size_t> many;
  for (std::size_t i = 0; i < 30; ++i) many.push_back(2 * i);
  map.thin_cuts = {{tags({3, 4}), tags({2}), 1, 0.31}, {tags({7}), tags({7}), 2}, {tags({9}), tags({9}), 1}};
  map.left_out_cuts.clear();
  map.undetermined.clear();
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(StartsWith("tags 3, 4:"), HasSubstr("0.31 m")), StartsWith("tags 7, 9:")));
  expect_on_scene_page(map);
  map.thin_cuts = {{tags(many), tags({1}), 1}};
  EXPECT_THAT(scene_warnings(map),
              Contains(StartsWith("tags 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, ...")));
}

TEST(SceneWarnings, NameTagsThatOnlyTheirPriorPlaces) {
  SceneMap map = good_map();
  map.prior_only = {{rig_tag(7), 3}};
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(StartsWith("tag 7:"), HasSubstr("3 observations"))));
  expect_on_scene_page(map);
  map.prior_only = {{rig_tag(3), 1}, {rig_tag(7), 3}};
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(StartsWith("tags 3, 7:"), HasSubstr("4 observations"))));
}

TEST(SceneWarnings, ReportWrongOdometryInOneSentence) {
  SceneMap map = good_map();
  map.odometry_ratio = 2;
  EXPECT_THAT(scene_warnings(map), IsEmpty());
  map.odometry_ratio = 3.14;
  map.rejected_odometry = {{1, 44.9, 45, 2.002, 0.003, 1e6}};
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(HasSubstr("3.1 times noisier"), AllOf(HasSubstr("between 44.90 s and 45.00 s"),
                                                                HasSubstr("by 2.002 m and 0.17 deg;"))));
  expect_on_scene_page(map);
  map.rejected_odometry.resize(4);
  EXPECT_THAT(scene_warnings(map), Contains(HasSubstr("0.17 deg, and at 3 other times")));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, NameTagsThatOdometryAloneConnects) {
  SceneMap map = good_map();
  map.odometry_links = {{tags({4, 5, 6, 7}), 2.55, 51}};
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(StartsWith("tags 4-7:"), HasSubstr("2.5 m, 51 frames"))));
  expect_on_scene_page(map);
  map.odometry_links.resize(7, map.odometry_links[0]);
  EXPECT_THAT(scene_warnings(map), AllOf(SizeIs(6), Contains(HasSubstr("2 more groups"))));
  expect_on_scene_page(map);
}

TEST(SceneWarnings, CountMisreadIdsAndListSome) {
  SceneMap map = good_map();
  map.corrected_ids = {{3, rig_tag(7), rig_tag(2)}};
  EXPECT_THAT(scene_warnings(map), ElementsAre(AllOf(StartsWith("1 observation "), HasSubstr("7 for 2"))));
  expect_on_scene_page(map);
  for (std::size_t i = 0; i < 6; ++i) map.corrected_ids.push_back({i, rig_tag(i), rig_tag(i + 1)});
  EXPECT_THAT(scene_warnings(map),
              ElementsAre(AllOf(StartsWith("7 observations "), HasSubstr("3 for 4, ..."))));
  expect_on_scene_page(map);
}

TEST(CornerConsistency, IsOneIfDetectorCovariancesAreCorrect) {
  for (const double times : {1.0, 2.0}) {
    RigScene made = rig_scene({.frames = 60, .noise_px = 0.2 * times});
    for (SceneFrame& frame : made.recording.frames) {
      for (TagDetection& seen : frame.views[0].detections) {
        CornerCovariance P = 0.04 * CornerCovariance::Identity();
        P(0, 0) *= 1 + 1e-9;  // anisotropic, so it is not replaced with one noise value for all corners
        seen.corner_covariance_px2 = P;
      }
    }
    SceneMap map = true_scene_map(made);
    for (CornerTerm& term : map.problem.bundle.corners) {
      term.factor.whitening = CornerCovariance::Identity() / 0.2;
      term.factor.isotropic = true;
    }
    ASSERT_TRUE(solve(map.problem.bundle).usable());
    EXPECT_NEAR(corner_chi2_per_dof(map), times * times, 0.15 * times * times);
  }
  const SceneMap without = true_scene_map(rig_scene({.noise_px = 0.2}));
  EXPECT_EQ(corner_chi2_per_dof(without), 0) << "no covariance was given";
}

TEST(Reprojection, IsMeasuredOnCornersInUse) {
  RigScene made = rig_scene();
  SceneMap map = true_scene_map(made);
  for (CornerTerm& term : map.problem.bundle.corners) {
    for (Eigen::Vector2d& corner : term.factor.corners_px) corner += Eigen::Vector2d(3, 4);
  }
  map.problem.bundle.corners[0].factor.corners_px[0].x() += 1e6;
  map.problem.bundle.corners[0].used = false;
  measure_reprojection(map);
  EXPECT_NEAR(map.reprojection_mean_px, 5, 1e-6);
  EXPECT_NEAR(map.reprojection_median_px, 5, 1e-6);
  for (CornerTerm& term : map.problem.bundle.corners) term.used = false;
  map.reprojection_mean_px = 7;
  measure_reprojection(map);
  EXPECT_EQ(map.reprojection_mean_px, 7) << "without corners in use, it is not changed";
}

}  // namespace
}  // namespace waymark
