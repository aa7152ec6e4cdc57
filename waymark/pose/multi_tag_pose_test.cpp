#include "waymark/pose/multi_tag_pose.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Cholesky>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/golden_page.hpp"
#include "tests/support/mapped_view.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertain_draw.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::estimate;
using ::testing::HasSubstr;
using testing::id;
using ::testing::IsEmpty;
using testing::kSigma;
using testing::kTagSize;
using testing::MappedView;
using testing::MatrixNear;
using testing::random_pose;
using testing::random_scene;
using testing::SE3Near;
using testing::see_tag;
using testing::with_noise;

double nees(const CameraPoseEstimate& estimate, const SE3& map_T_cam) {
  const SE3::Tangent error = minus(map_T_cam, estimate.map_T_cam);
  return error.dot(Eigen::LLT<PoseCovariance>(estimate.covariance).solve(error));
}

TEST(MultiTagPose, ExactWithoutNoise) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const MappedView scene = random_scene(random, 2 + trial % 7, 0.0);
    const MultiTagPose pose = estimate(scene);
    ASSERT_TRUE(pose.usable());
    EXPECT_THAT(pose.estimates[0].map_T_cam, SE3Near(scene.map_T_cam, 1e-9, 1e-9));
    EXPECT_EQ(pose.estimates[0].detections.size(), scene.seen.size());
    EXPECT_THAT(pose.rejected, IsEmpty());
    EXPECT_LT(pose.estimates[0].rms_px, 1e-8);
  }
}

TEST(MultiTagPose, TheCovarianceIsConsistent) {
  Random random(2);
  double sum = 0;
  const int count = std::getenv("WAYMARK_FULL") == nullptr ? 1500 : 30000;
  for (int trial = 0; trial < count; ++trial) {
    const MappedView scene = random_scene(random, 4);
    const MultiTagPose pose = estimate(scene);
    ASSERT_FALSE(pose.estimates.empty());
    sum += nees(pose.estimates[0], scene.map_T_cam);
  }
  EXPECT_NEAR(sum / count, 6.0, 1.96 * std::sqrt(12.0 / count));
}

TEST(MultiTagPose, MapUncertaintyEnlargesTheCovariance) {
  Random random(3);
  double sum = 0;
  const int count = std::getenv("WAYMARK_FULL") == nullptr ? 600 : 6000;
  int used = 0;
  for (int trial = 0; trial < count; ++trial) {
    MappedView scene = random_scene(random, 4);
    for (auto& [tag, mapped] : scene.map.tags) {
      // Errors of a few millimetres and a quarter of a degree about the tag, transformed to the map frame by
      // the adjoint.
      SE3::Tangent sigma;
      sigma << 0.003, 0.002, 0.004, 0.004, 0.003, 0.005;
      const SE3 at_tag(SO3(), mapped.map_T_tag.translation());
      const PoseCovariance Ad = at_tag.adjoint();
      mapped.covariance = Ad * sigma.cwiseAbs2().asDiagonal() * Ad.transpose();
      mapped.map_T_tag = sample(Uncertain<SE3>{mapped.map_T_tag, *mapped.covariance}, random);
    }
    const MultiTagPose pose = estimate(scene);
    ASSERT_FALSE(pose.estimates.empty());
    used += static_cast<int>(pose.estimates[0].detections.size());
    sum += nees(pose.estimates[0], scene.map_T_cam);
  }
  EXPECT_GT(used, 4 * count * 99 / 100);
  EXPECT_NEAR(sum / count, 6.0, 1.96 * std::sqrt(12.0 / count));
}

TEST(MultiTagPose, MovesWithTheMapFrame) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    MappedView scene = random_scene(random, 5);
    const MultiTagPose before = estimate(scene);
    const SE3 world_T_map = random_pose(random);
    for (auto& [tag, mapped] : scene.map.tags) mapped.map_T_tag = world_T_map * mapped.map_T_tag;
    const MultiTagPose after = estimate(scene);
    ASSERT_TRUE(before.usable() && after.usable());
    EXPECT_THAT(after.estimates[0].map_T_cam,
                SE3Near(world_T_map * before.estimates[0].map_T_cam, 1e-6, 1e-6));
    const PoseCovariance Ad = world_T_map.adjoint();
    const PoseCovariance expected = Ad * before.estimates[0].covariance * Ad.transpose();
    EXPECT_THAT(after.estimates[0].covariance, MatrixNear(expected, 1e-5 * expected.norm()));
  }
}

TEST(MultiTagPose, TheOrderOfDetectionsDoesNotMatter) {
  Random random(5);
  for (int trial = 0; trial < 30; ++trial) {
    MappedView scene = random_scene(random, 6);
    displace(scene, 2, random);
    const MultiTagPose forward = estimate(scene);
    std::reverse(scene.seen.begin(), scene.seen.end());
    const MultiTagPose backward = estimate(scene);
    ASSERT_EQ(forward.estimates.size(), backward.estimates.size());
    EXPECT_THAT(forward.estimates[0].map_T_cam, SE3Near(backward.estimates[0].map_T_cam, 1e-9, 1e-9));
    ASSERT_EQ(forward.rejected.size(), 1U);
    EXPECT_EQ(forward.rejected[0].tag, backward.rejected[0].tag);
    EXPECT_EQ(forward.rejected[0].detection, 5 - backward.rejected[0].detection);
  }
}

TEST(MultiTagPose, OutliersAreRejectedWithAReason) {
  Random random(6);
  for (const int outliers : {1, 2, 3}) {
    for (int trial = 0; trial < 60; ++trial) {
      MappedView scene = random_scene(random, 8);
      for (int i = 0; i < outliers; ++i) displace(scene, i, random);
      const MultiTagPose pose = estimate(scene);
      ASSERT_TRUE(pose.usable());
      EXPECT_LT(nees(pose.estimates[0], scene.map_T_cam), 40);
      ASSERT_GE(pose.rejected.size(), static_cast<std::size_t>(outliers));
      for (int i = 0; i < outliers; ++i) {
        const RejectedTag& rejected = pose.rejected[static_cast<std::size_t>(i)];
        EXPECT_EQ(rejected.tag, id(i));
        EXPECT_TRUE(rejected.reason == RejectReason::Outlier || rejected.reason == RejectReason::NotVisible);
        EXPECT_THAT(rejected.message, HasSubstr(to_string(id(i))));
      }
      EXPECT_LE(pose.rejected.size(), static_cast<std::size_t>(outliers) + 1)
          << "the gate accepts 999 out of 1000 good tags";
    }
  }
}

TEST(MultiTagPose, OtherTagsResolveTheAmbiguityOfSmallTags) {
  Random random(7);
  const testing::ViewRange far{
      .min_size_px = 12, .max_size_px = 25, .max_tilt_deg = 45, .max_off_axis = 0.35};
  int resolved = 0, alone_ambiguous = 0;
  for (int trial = 0; trial < 200; ++trial) {
    MappedView scene = random_scene(random, 3, kSigma, far);
    const MultiTagPose pose = estimate(scene);
    if (pose.usable() && nees(pose.estimates[0], scene.map_T_cam) < 40) ++resolved;
    scene.seen.resize(1);
    alone_ambiguous += estimate(scene).ambiguous() ? 1 : 0;
  }
  EXPECT_GT(alone_ambiguous, 100);
  EXPECT_GE(resolved, 198);
}

TEST(MultiTagPose, OneSmallTagIsReportedAsAmbiguous) {
  const CameraModel camera = testing::plain_camera();
  const SE3 cam_T_tag(SO3::exp({0.3, 0.2, 0.3}), {0.2, 0.1, 6.0});
  Random random(8);
  MappedView scene{.map_T_cam = random_pose(random)};
  scene.map.tags[id(0)] = {.map_T_tag = scene.map_T_cam * cam_T_tag, .size_m = kTagSize};
  scene.seen = {with_noise(see_tag(camera, cam_T_tag).value(), kSigma, random)};
  const MultiTagPose pose = estimate(scene);
  EXPECT_TRUE(pose.ambiguous());
  EXPECT_FALSE(pose.usable());
  ASSERT_EQ(pose.estimates.size(), 2U);
  EXPECT_LE(pose.estimates[0].chi2, pose.estimates[1].chi2);
  EXPECT_LT(std::min(nees(pose.estimates[0], scene.map_T_cam), nees(pose.estimates[1], scene.map_T_cam)), 40);
  // The two estimates are the two poses of the tag.
  const TagPose alone =
      estimate_tag_pose(scene.seen[0], kTagSize, camera, {.corner_sigma_px = kSigma}).value();
  const SE3 map_T_tag = scene.map.tags.at(id(0)).map_T_tag;
  EXPECT_THAT(pose.estimates[0].map_T_cam, SE3Near(map_T_tag * alone.best.cam_T_tag.inverse(), 0.01, 0.005));
  EXPECT_THAT(pose.estimates[1].map_T_cam,
              SE3Near(map_T_tag * alone.other->cam_T_tag.inverse(), 0.01, 0.005));
}

TEST(MultiTagPose, OneLargeTiltedTagIsNotAmbiguous) {
  Random random(9);
  const MappedView scene = random_scene(
      random, 1, kSigma, {.min_size_px = 150, .max_size_px = 150, .min_tilt_deg = 40, .max_tilt_deg = 50});
  EXPECT_TRUE(estimate(scene).usable());
}

TEST(MultiTagPose, TwoContradictingTagsAreAmbiguous) {
  Random random(10);
  for (int trial = 0; trial < 100; ++trial) {
    MappedView scene = random_scene(random, 2);
    displace(scene, 0, random);
    const MultiTagPose pose = estimate(scene);
    ASSERT_TRUE(pose.ambiguous());
    const bool truth_is_among_them =
        std::any_of(pose.estimates.begin(), pose.estimates.end(), [&](const auto& e) {
          return nees(e, scene.map_T_cam) < 60 && e.detections == std::vector<std::size_t>{1};
        });
    EXPECT_TRUE(truth_is_among_them);
  }
}

// Tests for rejected tags.

TEST(MultiTagPose, TagsThatAreNotInTheMapAreRejected) {
  Random random(11);
  MappedView scene = random_scene(random, 4);
  scene.map.tags.erase(id(1));
  const MultiTagPose pose = estimate(scene);
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::NotInMap);
  EXPECT_EQ(pose.rejected[0].detection, 1U);
  EXPECT_THAT(pose.rejected[0].message, HasSubstr("tag36h11:1"));
  testing::expect_on_page("pose", pose.rejected[0].message);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(0, 2, 3));
}

TEST(MultiTagPose, ContradictoryDuplicatesAreBothRejected) {
  Random random(12);
  MappedView scene = random_scene(random, 5);
  TagDetection copy = scene.seen[2];
  for (auto& corner : copy.corners_px) corner.x() += 40;
  scene.seen.push_back(copy);
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(0, 1, 3, 4));
  ASSERT_EQ(pose.rejected.size(), 2U);
  for (const RejectedTag& rejected : pose.rejected) {
    EXPECT_EQ(rejected.tag, id(2));
    EXPECT_EQ(rejected.reason, RejectReason::ContradictoryDuplicate);
    EXPECT_THAT(rejected.message, HasSubstr("40.0 px"));
    testing::expect_on_page("pose", rejected.message);
  }
}

TEST(MultiTagPose, ADuplicateAtOnePositionCountsOnce) {
  Random random(13);
  MappedView scene = random_scene(random, 4);
  scene.seen.push_back(scene.seen[1]);
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(0, 1, 2, 3));
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::Duplicate);
  EXPECT_EQ(pose.rejected[0].detection, 4U);
}

TEST(MultiTagPose, ATagPredictedBehindTheCameraIsRejected) {
  Random random(14);
  MappedView scene = random_scene(random, 4);
  SE3& map_T_tag = scene.map.tags.at(id(0)).map_T_tag;
  map_T_tag = scene.map_T_cam * SE3(SO3(), {0.1, 0.1, -2.0});
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(1, 2, 3));
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::NotVisible);
  testing::expect_on_page("pose", pose.rejected[0].message);
}

TEST(MultiTagPose, OneBadCornerRejectsItsTag) {
  Random random(15);
  MappedView scene = random_scene(random, 5);
  scene.seen[3].corners_px[1].x() += 6 * kSigma;
  const MultiTagPose pose = estimate(scene);
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].tag, id(3));
}

// Their residuals would pass the gates, so only the mark excludes them.
TEST(MultiTagPose, UnreliableCornersAreNotUsed) {
  Random random(17);
  const MappedView scene = random_scene(random, 4);
  MappedView marked = scene;
  marked.seen[2].corner_state = CornerState::Unreliable;
  MappedView without = scene;
  without.seen.erase(without.seen.begin() + 2);
  const MultiTagPose pose = estimate(marked);
  ASSERT_TRUE(pose.usable());
  EXPECT_THAT(pose.estimates[0].detections, ElementsAre(0, 1, 3));
  EXPECT_THAT(pose.estimates[0].map_T_cam,
              SE3Near(estimate(without).estimates.at(0).map_T_cam, 1e-12, 1e-12));
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::UnreliableCorners);
  EXPECT_EQ(pose.rejected[0].detection, 2U);
  EXPECT_STREQ(to_string(pose.rejected[0].reason), "unreliable_corners");
  testing::expect_on_page("pose", pose.rejected[0].message);
}

TEST(MultiTagPose, BadDetectionsAndMapEntriesAreRejected) {
  Random random(16);
  MappedView scene = random_scene(random, 8);
  scene.seen[0].corners_px[2].x() = std::numeric_limits<double>::quiet_NaN();
  auto& turned = scene.seen[1].corners_px;
  std::rotate(turned.begin(), turned.begin() + 1, turned.end());
  std::swap(scene.seen[2].corners_px[0], scene.seen[2].corners_px[1]);
  scene.map.tags.at(id(3)).size_m = -1;
  scene.map.tags.at(id(4)).covariance = -PoseCovariance::Identity();
  scene.seen[5].corner_covariance_px2 = CornerCovariance::Zero();
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(6, 7));
  ASSERT_EQ(pose.rejected.size(), 6U);
  const RejectReason reasons[] = {RejectReason::BadDetection, RejectReason::Outlier,
                                  RejectReason::BadDetection, RejectReason::BadMapEntry,
                                  RejectReason::BadMapEntry,  RejectReason::BadDetection};
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(pose.rejected[i].detection, i);
    EXPECT_EQ(pose.rejected[i].reason, reasons[i]) << i << ": " << pose.rejected[i].message;
    EXPECT_FALSE(pose.rejected[i].message.empty());
    testing::expect_on_page("pose", pose.rejected[i].message);
  }
}

TEST(MultiTagPose, NoDetectionsAreNotAnError) {
  const MappedView nothing;
  const MultiTagPose pose = estimate(nothing);
  EXPECT_THAT(pose.estimates, IsEmpty());
  EXPECT_THAT(pose.rejected, IsEmpty());
  EXPECT_FALSE(pose.usable());
  EXPECT_FALSE(pose.ambiguous());
}

TEST(MultiTagPose, AQuadThatIsNotASquareHasNoPose) {
  Random random(17);
  MappedView scene =
      random_scene(random, 1, 0.0, {.min_size_px = 100, .max_size_px = 100, .max_tilt_deg = 10});
  scene.seen[0].corners_px[0] -= Eigen::Vector2d(30, 0);
  scene.seen[0].corners_px[1] -= Eigen::Vector2d(30, 0);
  scene.seen[0].corners_px[2] += Eigen::Vector2d(0, 20);
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates, IsEmpty());
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::Outlier);
}

TEST(MultiTagPose, OptionsOutOfRangeAreAnError) {
  const MappedView nothing;
  for (const MultiTagOptions& bad :
       {MultiTagOptions{.corner_sigma_px = 0}, MultiTagOptions{.tag_gate_chi2 = -1},
        MultiTagOptions{.duplicate_px = -1}, MultiTagOptions{.max_iterations = 0}}) {
    EXPECT_FALSE(estimate_camera_pose(nothing.seen, nothing.map, nothing.camera, bad));
  }
}

TEST(MultiTagPose, RandomInputGivesFiniteResults) {
  Random random(18);
  for (int trial = 0; trial < 300; ++trial) {
    MappedView scene = random_scene(random, 4);
    for (auto& seen : scene.seen) {
      if (random.index(2) == 0) continue;
      for (auto& corner : seen.corners_px)
        corner += std::pow(10, random.uniform(-2, 6)) * Eigen::Vector2d(random.normal(), random.normal());
    }
    for (auto& [tag, mapped] : scene.map.tags) {
      if (random.index(2) == 0)
        mapped.map_T_tag = SE3(SO3(), Eigen::Vector3d::Constant(std::pow(10, random.uniform(-9, 9))));
    }
    const MultiTagPose pose = estimate(scene);
    std::size_t accounted = pose.rejected.size();
    for (const auto& e : pose.estimates) {
      EXPECT_TRUE(e.map_T_cam.matrix().allFinite() && e.covariance.allFinite());
      EXPECT_TRUE(std::isfinite(e.chi2) && std::isfinite(e.rms_px));
    }
    if (!pose.estimates.empty()) accounted += pose.estimates[0].detections.size();
    EXPECT_EQ(accounted, scene.seen.size()) << "every detection is used or rejected with a reason";
  }
}

}  // namespace
}  // namespace waymark
