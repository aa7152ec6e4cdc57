// What the joint pose does with tags it cannot use.
#include <algorithm>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "tests/support/mapped_view.hpp"
#include "waymark/pose/multi_tag_pose.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;
using testing::estimate;
using ::testing::HasSubstr;
using testing::id;
using ::testing::IsEmpty;
using testing::kSigma;
using testing::MappedView;
using testing::random_scene;

TEST(MultiTagPose, TagsThatAreNotInTheMapAreSaid) {
  Random random(11);
  MappedView scene = random_scene(random, 4);
  scene.map.tags.erase(id(1));
  const MultiTagPose pose = estimate(scene);
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::NotInMap);
  EXPECT_EQ(pose.rejected[0].detection, 1U);
  EXPECT_THAT(pose.rejected[0].words, HasSubstr("tag36h11:1 is not in the map"));
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(0, 2, 3));
}

TEST(MultiTagPose, ContradictoryDuplicatesAreBothLeftOut) {
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
    EXPECT_THAT(rejected.words, HasSubstr("seen 2 times in one image, up to 40.0 px apart"));
  }
}

TEST(MultiTagPose, ADuplicateInOnePlaceCountsOnce) {
  Random random(13);
  MappedView scene = random_scene(random, 4);
  scene.seen.push_back(scene.seen[1]);
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(0, 1, 2, 3));
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::Duplicate);
  EXPECT_EQ(pose.rejected[0].detection, 4U);
}

TEST(MultiTagPose, ATagThatWouldLieBehindTheCameraIsSaid) {
  Random random(14);
  MappedView scene = random_scene(random, 4);
  SE3& map_T_tag = scene.map.tags.at(id(0)).map_T_tag;
  map_T_tag = scene.map_T_cam * SE3(SO3(), {0.1, 0.1, -2.0});
  const MultiTagPose pose = estimate(scene);
  EXPECT_THAT(pose.estimates.at(0).detections, ElementsAre(1, 2, 3));
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].reason, RejectReason::NotVisible);
  EXPECT_THAT(pose.rejected[0].words, HasSubstr("behind the camera"));
}

TEST(MultiTagPose, OneBadCornerIsEnough) {
  Random random(15);
  MappedView scene = random_scene(random, 5);
  scene.seen[3].corners_px[1].x() += 6 * kSigma;
  const MultiTagPose pose = estimate(scene);
  ASSERT_EQ(pose.rejected.size(), 1U);
  EXPECT_EQ(pose.rejected[0].tag, id(3));
}

TEST(MultiTagPose, BadDetectionsAndMapEntriesAreSaid) {
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
    EXPECT_EQ(pose.rejected[i].reason, reasons[i]) << i << ": " << pose.rejected[i].words;
    EXPECT_FALSE(pose.rejected[i].words.empty());
  }
}

TEST(MultiTagPose, NothingSeenIsNoError) {
  const MappedView nothing;
  const MultiTagPose pose = estimate(nothing);
  EXPECT_THAT(pose.estimates, IsEmpty());
  EXPECT_THAT(pose.rejected, IsEmpty());
  EXPECT_FALSE(pose.usable());
  EXPECT_FALSE(pose.ambiguous());
}

TEST(MultiTagPose, AQuadThatIsNoSquareGivesNoPose) {
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

TEST(MultiTagPose, GarbageGivesFiniteNumbers) {
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
    EXPECT_EQ(accounted, scene.seen.size()) << "every detection is used or its absence explained";
  }
}

}  // namespace
}  // namespace waymark
