// Tests which tags only their prior places, and which priors the observations contradict.
#include "waymark/mapping/scene/prior_checks.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using test::exactly;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::true_scene_map;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

/// Tag 7 has a prior, and images that show it show no other tag.
RigScene with_a_lonely_tag() {
  RigScene made = rig_scene();
  made.scene.bodies[0].tags[7].body_T_tag = exactly(made.tags[7]);
  for (SceneFrame& frame : made.recording.frames) {
    for (SceneView& view : frame.views) {
      const auto lonely = [](const TagDetection& seen) { return seen.tag == rig_tag(7); };
      if (std::ranges::any_of(view.detections, lonely))
        std::erase_if(view.detections, [&](const TagDetection& seen) { return !lonely(seen); });
    }
  }
  return made;
}

int observations_of_tag_7(const RigScene& made) {
  int count = 0;
  for (const SceneFrame& frame : made.recording.frames) {
    for (const SceneView& view : frame.views)
      count += static_cast<int>(std::ranges::count(view.detections, rig_tag(7), &TagDetection::tag));
  }
  return count;
}

TEST(TagsOnPriorAlone, IsATagThatIsNeverSeenWithAnother) {
  const RigScene made = with_a_lonely_tag();
  const int count = observations_of_tag_7(made);
  ASSERT_GT(count, 0);
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), ElementsAre(Pair(rig_tag(7), count)));
}

TEST(TagsOnPriorAlone, IsNoTagThatIsSeenWithOthers) {
  RigScene made = rig_scene();
  made.scene.bodies[0].tags[7].body_T_tag = exactly(made.tags[7]);
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

TEST(TagsOnPriorAlone, MotionBetweenFramesConnects) {
  RigScene made = with_a_lonely_tag();
  made.scene.bodies[1].stays_put = SceneMotionNoise{.sigma_m = 0.1, .sigma_rad = 0.1};
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

TEST(TagsOnPriorAlone, AGivenDistanceConnects) {
  RigScene made = with_a_lonely_tag();
  const double true_m = (made.tags[7].translation() - made.tags[0].translation()).norm();
  made.scene.distances = {{7, 0, -1, -1, true_m, 0.01}};
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

/// A prior with this covariance at the identity, and the estimate from it and a measurement.
struct Combined {
  PosePriorFactor given{};
  SE3 estimate{};
  Matrix6 covariance = Matrix6::Zero();
};

Combined combined(const Vector6& measured, const Vector6& sigma_given, const Vector6& sigma_measured) {
  const Matrix6 given = sigma_given.cwiseInverse().cwiseAbs2().asDiagonal();
  const Matrix6 of_measurement = sigma_measured.cwiseInverse().cwiseAbs2().asDiagonal();
  const Matrix6 covariance = (given + of_measurement).inverse();
  return {{SE3(), sigma_given.cwiseInverse().asDiagonal()},
          SE3::exp(covariance * of_measurement * measured),
          covariance};
}

TEST(GivenPoses, AreContradictedByChanceOnceInAThousand) {
  const Vector6 sigma_given = (Vector6() << 1, 2, 1, 3, 1, 1).finished() * 1e-3;
  const Vector6 sigma_measured = (Vector6() << 1, 1, 8, 1, 2, 0.3).finished() * 1e-3;
  const Vector6 sigma = (sigma_given.cwiseAbs2() + sigma_measured.cwiseAbs2()).cwiseSqrt();
  constexpr int kSamples = 20000;
  Random random(7);
  int contradicted = 0;
  for (int i = 0; i < kSamples; ++i) {
    Vector6 measured;
    for (double& x : measured) x = random.normal();
    const Combined c = combined(measured.cwiseProduct(sigma), sigma_given, sigma_measured);
    contradicted += contradiction_sigmas(c.given, c.estimate, c.covariance) ? 1 : 0;
  }
  EXPECT_GT(contradicted, 6);  // 20 are expected, with a standard deviation of 4.5
  EXPECT_LT(contradicted, 38);
}

TEST(GivenPoses, AreComparedWithWhatTheEstimateWouldBeWithoutThem) {
  Vector6 measured = Vector6::Zero();
  measured.head<3>() = Eigen::Vector3d(0.03, 0.04, 0);
  const Combined c = combined(measured, Vector6::Constant(5e-3), Vector6::Constant(8e-3));
  EXPECT_LT(c.estimate.translation().norm(), 0.02) << "the estimate yields to the given pose";
  const auto sigmas = contradiction_sigmas(c.given, c.estimate, c.covariance);
  ASSERT_TRUE(sigmas);
  EXPECT_NEAR(*sigmas, 0.05 / std::hypot(5e-3, 8e-3), 1e-6);
}

TEST(GivenPoses, ThatAreNotUsedAreComparedWithTheEstimate) {
  const PosePriorFactor given{SE3(), (200 * Vector6::Ones()).asDiagonal()};  // 5 mm and 5 mrad
  const SE3 estimate(SO3(), {0.03, 0.04, 0});
  const Matrix6 covariance = Vector6::Constant(8e-3).cwiseAbs2().asDiagonal();
  const auto sigmas = contradiction_sigmas(given, estimate, covariance, false);
  ASSERT_TRUE(sigmas);
  EXPECT_NEAR(*sigmas, 0.05 / std::hypot(5e-3, 8e-3), 1e-6);
}

TEST(GivenPoses, ThatAloneDetermineTheEstimateAreNotContradicted) {
  const Combined c = combined(Vector6::Constant(10), Vector6::Constant(1e-3), Vector6::Constant(1e3));
  EXPECT_FALSE(contradiction_sigmas(c.given, c.estimate, c.covariance));
}

}  // namespace
}  // namespace waymark
