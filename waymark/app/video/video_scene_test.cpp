// Prior knowledge in a video scene: anchors and measurements.
#include "waymark/app/video/video_scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/base/angles.hpp"

namespace waymark::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TagId tag(int number) { return {FamilyId::Tag36h11, number}; }

MapVideoJob job() {
  MapVideoJob made{
      .camera =
          CameraModel::make(PinholeRadtan{.fx = 900, .fy = 900, .cx = 640, .cy = 360}, 1280, 720).value()};
  made.sizes.default_size_m = 0.165;
  return made;
}

const std::map<TagId, int> kSeen = {{tag(3), 10}, {tag(5), 40}, {tag(8), 20}};

/// A map with these tags, at x = id and z = 1 m.
TagMap prior_with(std::initializer_list<int> numbers) {
  TagMap map;
  for (const int number : numbers)
    map.tags[tag(number)] = {.map_T_tag = SE3({}, {1.0 * number, 0, 1}), .size_m = 0.165};
  return map;
}

double sigma_of(const ScenePrior& prior, int k) { return std::sqrt(prior.covariance()(k, k)); }

TEST(VideoAnchors, AssumesTheMostObservedTagUprightAtTheOrigin) {
  const auto anchors = video_anchors(job(), kSeen);
  ASSERT_TRUE(anchors) << to_string(anchors.error());
  EXPECT_EQ(anchors->first, tag(5));
  EXPECT_TRUE(anchors->assumed);
  ASSERT_EQ(anchors->tags.size(), 1U);
  EXPECT_LT((anchors->tags.at(tag(5)).mean.matrix() - anchor_at_origin().matrix()).norm(), 1e-12);
  EXPECT_TRUE(anchors->exact.contains(tag(5)));
}

TEST(VideoAnchors, PrefersATagOfAnOlderMap) {
  MapVideoJob known = job();
  known.prior = prior_with({3, 8});
  const auto anchors = video_anchors(known, kSeen);
  ASSERT_TRUE(anchors);
  EXPECT_EQ(anchors->first, tag(8));
  EXPECT_FALSE(anchors->assumed);
  EXPECT_EQ(anchors->tags.at(tag(8)).mean.translation().x(), 8);
  known.map_T_anchor = SE3({}, {0, 0, 2});
  EXPECT_EQ(video_anchors(known, kSeen)->tags.at(tag(8)).mean.translation().z(), 2)
      << "the given pose overrides the map";
}

TEST(VideoAnchors, UprightAndFloorTagsFreeTiltAndHeightOfTheAnchor) {
  MapVideoJob measured = job();
  measured.anchors = {tag(5)};
  measured.upright = {tag(3)};
  const auto level = video_anchors(measured, kSeen);
  ASSERT_TRUE(level);
  const ScenePrior& upright = level->tags.at(tag(5));
  const Eigen::Vector3d up = upright.mean.rotation().inverse() * Eigen::Vector3d::UnitZ();
  const Matrix6 W = upright.sqrt_information;
  EXPECT_NEAR((W.bottomRightCorner<3, 3>() * up).norm(), 1e6, 1) << "yaw is fixed";
  EXPECT_NEAR((W.bottomRightCorner<3, 3>() * up.unitOrthogonal()).norm(), 4, 1e-6) << "tilt is estimated";
  EXPECT_NEAR((W.topLeftCorner<3, 3>() * up).norm(), 1e6, 1) << "height is fixed";
  EXPECT_THAT(level->exact, IsEmpty());
  measured.upright = {};
  measured.floor = {tag(8)};
  const auto floor = video_anchors(measured, kSeen);
  ASSERT_TRUE(floor);
  EXPECT_NEAR((floor->tags.at(tag(5)).sqrt_information.topLeftCorner<3, 3>() * up).norm(), 0.1, 1e-9)
      << "the floor tag determines the height";
}

TEST(VideoAnchors, SeveralHaveThePosesAndDeviationsOfTheOlderMap) {
  MapVideoJob several = job();
  several.prior = prior_with({3, 8, 99});
  several.prior_sigma_m = 0.01;
  several.prior_sigma_deg = to_degrees(0.02);
  const auto anchors = video_anchors(several, kSeen);
  ASSERT_TRUE(anchors);
  ASSERT_EQ(anchors->tags.size(), 2U) << "tag 99 was not observed";
  EXPECT_EQ(anchors->first, tag(8)) << "observed more often than tag 3";
  EXPECT_THAT(anchors->exact, IsEmpty());
  const ScenePrior& eight = anchors->tags.at(tag(8));
  const Matrix6 P = (eight.sqrt_information.transpose() * eight.sqrt_information).inverse();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(std::sqrt(P(k, k)), 0.01, 1e-6);
    EXPECT_NEAR(std::sqrt(P(k + 3, k + 3)), 0.02, 1e-6);
  }
  several.prior.tags.at(tag(8)).covariance = Matrix6(0.04 * 0.04 * Matrix6::Identity());
  EXPECT_GT(sigma_of(video_anchors(several, kSeen)->tags.at(tag(8)), 1), 0.04)
      << "added to its own covariance";
  MapVideoJob exact = job();
  exact.prior = prior_with({3, 8});
  exact.anchors = {tag(3), tag(8)};
  EXPECT_EQ(video_anchors(exact, kSeen)->exact.size(), 2U);
}

TEST(VideoAnchors, RejectsTagsThatAreUnobservedOrWithoutPose) {
  MapVideoJob wrong = job();
  wrong.anchors = {tag(77)};
  const auto unseen = video_anchors(wrong, kSeen);
  ASSERT_FALSE(unseen);
  EXPECT_EQ(unseen.error().place.key, "anchor");
  EXPECT_THAT(unseen.error().message, HasSubstr("tag36h11:77"));
  wrong.anchors = {tag(3), tag(5)};
  const auto unknown = video_anchors(wrong, kSeen);
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().message, HasSubstr("tag36h11:3"));
  wrong.anchors = {};
  wrong.prior = prior_with({99});
  wrong.prior_sigma_m = 0.01;
  const auto none = video_anchors(wrong, kSeen);
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().place.key, "prior");
}

Result<TagScene> scene_of(const MapVideoJob& wanted) {
  const auto anchors = video_anchors(wanted, kSeen);
  EXPECT_TRUE(anchors);
  return video_scene(wanted, kSeen, *anchors);
}

TEST(VideoScene, CameraIsOnTheMovingBodyAndTagsOnTheStaticOne) {
  MapVideoJob asked = job();
  asked.readout_s = 0.02;
  asked.sizes.size_by_tag_m[tag(3)] = 0.1;
  const auto scene = scene_of(asked);
  ASSERT_TRUE(scene) << to_string(scene.error());
  ASSERT_EQ(scene->cameras.size(), 1U);
  EXPECT_EQ(scene->cameras[0].body, kHand);
  EXPECT_EQ(scene->cameras[0].readout_s, 0.02);
  EXPECT_TRUE(scene->bodies[kWalls].is_static);
  EXPECT_FALSE(scene->bodies[kHand].is_static);
  EXPECT_EQ(scene->bodies[kWalls].default_tag_size_m, 0.165);
  ASSERT_EQ(scene->bodies[kWalls].tags.size(), 2U) << "the anchor and the tag with a different size";
  for (const SceneTag& listed : scene->bodies[kWalls].tags)
    EXPECT_EQ(listed.size_m, listed.id == tag(3) ? 0.1 : 0.165);
}

TEST(VideoScene, ContainsEveryMeasurement) {
  MapVideoJob asked = job();
  asked.upright = {tag(3)};
  asked.floor = {tag(8)};
  asked.planes = {{tag(3), tag(5)}};
  asked.distances = {{tag(3), tag(5), 1.5, 0.002}};
  asked.level_sigma_deg = to_degrees(0.03);
  const auto scene = scene_of(asked);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->directions.size(), 2U);
  EXPECT_EQ(scene->directions[0].factor.tag_axis, Eigen::Vector3d::UnitY());
  EXPECT_EQ(scene->directions[1].factor.tag_axis, Eigen::Vector3d::UnitZ());
  EXPECT_DOUBLE_EQ(scene->directions[1].factor.sigma_rad, 0.03);
  ASSERT_EQ(scene->coordinates.size(), 1U);
  EXPECT_EQ(scene->coordinates[0].tag, 8);
  EXPECT_EQ(scene->coordinates[0].measured_m, 0);
  EXPECT_EQ(scene->coordinates[0].sigma_m, MapVideoJob::kFlat_m);
  ASSERT_EQ(scene->distances.size(), 1U);
  EXPECT_EQ(scene->distances[0].corner_a, -1) << "measured between centres";
  EXPECT_EQ(scene->distances[0].measured_m, 1.5);
  ASSERT_EQ(scene->planes.size(), 1U);
  EXPECT_EQ(scene->planes[0].tags, (std::vector<int>{3, 5}));
}

TEST(VideoScene, RejectsTagsThatAreUnobservedOrWithoutSize) {
  const auto key_of = [](const MapVideoJob& asked) {
    const auto scene = scene_of(asked);
    return scene ? std::string("none") : scene.error().place.key;
  };
  MapVideoJob asked = job();
  asked.upright = {tag(77)};
  EXPECT_EQ(key_of(asked), "upright");
  asked = job();
  asked.floor = {tag(77)};
  EXPECT_EQ(key_of(asked), "floor");
  asked = job();
  asked.planes = {{tag(3), tag(77)}};
  EXPECT_EQ(key_of(asked), "plane");
  asked = job();
  asked.distances = {{tag(77), tag(3), 1, 0.01}};
  EXPECT_EQ(key_of(asked), "distance");
  asked = job();
  asked.sizes = {};
  asked.sizes.size_by_tag_m[tag(5)] = 0.1;
  EXPECT_FALSE(scene_of(asked)) << "tags 3 and 8 have no size";
}

}  // namespace
}  // namespace waymark::internal
