// What must hold for the map of any scene: frame, numbers of tags and the direction of time do not matter,
// covariances are such, and a search ends when it is asked to.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "tests/support/rig_scene.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using ::testing::HasSubstr;

SceneMap mapped(const RigScene& made, const SceneMapOptions& options = {}) {
  auto map = map_scene(made.scene, made.recording, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : SceneMap();
}

const SE3& place(const SceneMap& map, std::size_t tag) {
  return map.problem.bundle.poses[map.problem.tags[0][tag]].value;
}

/// Every pose that is known, in a map that stands elsewhere.
RigScene moved(RigScene made, const SE3& by) {
  made.scene.bodies[0].map_T_body->mean = by * made.scene.bodies[0].map_T_body->mean;
  return made;
}

TEST(SceneLaws, CovariancesAreSymmetricPositiveDefiniteAndTurnWithTheFrame) {
  const RigScene made = rig_scene({.noise_px = 0.2});
  const SE3 by = at(3, -2, 1, 0.4, -0.3, 1.1);
  const SceneMap here = mapped(made);
  const SceneMap there = mapped(moved(made, by));
  const Matrix6 Ad = by.adjoint();
  for (std::size_t f = 0; f < made.rig.size(); f += 5) {
    const Matrix6& P = here.covariance.poses[here.problem.bodies[1][f]];
    const Matrix6& Q = there.covariance.poses[there.problem.bodies[1][f]];
    EXPECT_LT((P - P.transpose()).norm(), 1e-12 + 1e-9 * P.norm());
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(P).eigenvalues().minCoeff(), 0);
    const Matrix6 expected = Ad * P * Ad.transpose();
    EXPECT_LT((Q - expected).norm(), 1e-2 * expected.norm()) << f;
  }
}

TEST(SceneLaws, TwiceTheSameIsTheSameToTheBit) {
  const RigScene made = rig_scene({.cameras = 2, .noise_px = 0.2});
  const SceneMap a = mapped(made);
  const SceneMap b = mapped(made);
  ASSERT_EQ(a.problem.bundle.poses.size(), b.problem.bundle.poses.size());
  EXPECT_EQ(a.cost, b.cost);
  for (std::size_t i = 0; i < a.problem.bundle.poses.size(); ++i) {
    EXPECT_EQ(a.problem.bundle.poses[i].value.matrix(), b.problem.bundle.poses[i].value.matrix()) << i;
    EXPECT_EQ(a.covariance.poses[i], b.covariance.poses[i]) << i;
  }
}

TEST(SceneLaws, TheNumbersOfTagsDoNotMatter) {
  const RigScene made = rig_scene({.noise_px = 0.2});
  RigScene renamed = made;
  const auto name = [](TagId& id) { id.number = 500 - 3 * id.number; };
  for (SceneTag& tag : renamed.scene.bodies[0].tags) name(tag.id);
  for (SceneFrame& frame : renamed.recording.frames) {
    for (TagDetection& seen : frame.views[0].detections) name(seen.tag);
  }
  const SceneMap a = mapped(made);
  const SceneMap b = mapped(renamed);
  EXPECT_NEAR(b.cost, a.cost, 1e-6 * a.cost);
  for (std::size_t t = 0; t < made.tags.size(); ++t)
    EXPECT_LT(minus(place(a, t), place(b, t)).norm(), 1e-6) << t;
}

TEST(SceneLaws, TimeRunningBackwardsGivesTheSameMap) {
  const RigScene made = rig_scene({.noise_px = 0.2});
  RigScene backwards = made;
  auto& frames = backwards.recording.frames;
  std::ranges::reverse(frames);
  for (std::size_t f = 0; f < frames.size(); ++f) frames[f].stamp = made.recording.frames[f].stamp;
  const SceneMap a = mapped(made);
  const SceneMap b = mapped(backwards);
  EXPECT_NEAR(b.cost, a.cost, 1e-5 * a.cost);
  for (std::size_t t = 0; t < made.tags.size(); ++t)
    EXPECT_LT(minus(place(a, t), place(b, t)).norm(), 1e-4) << t;
}

TEST(SceneLaws, WhatIsCalledNoiseIsFoundAndScalesTheCovariance) {
  const SceneMap fine = mapped(rig_scene({.frames = 60, .noise_px = 0.1}));
  const SceneMap rough = mapped(rig_scene({.frames = 60, .noise_px = 0.4}));
  EXPECT_NEAR(fine.noise_px, 0.1, 0.02);
  EXPECT_NEAR(rough.noise_px, 0.4, 0.06);
  const auto sigma = [](const SceneMap& map) {
    return std::sqrt(map.covariance.poses[map.problem.tags[0][7]].trace());
  };
  EXPECT_NEAR(sigma(rough) / sigma(fine), 4, 0.8);
}

TEST(SceneLaws, ASearchEndsWhereverItIsAskedTo) {
  const RigScene made = rig_scene({.noise_px = 0.2});
  int steps = 0;
  std::vector<std::string> stages;
  const auto count = [&](const std::string& stage, int, double cost) {
    EXPECT_TRUE(std::isfinite(cost));
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
    ++steps;
    return true;
  };
  ASSERT_TRUE(map_scene(made.scene, made.recording, {}, count));
  EXPECT_EQ(stages.front(), "looking for outliers");
  EXPECT_EQ(stages.back(), "adjusting");
  ASSERT_GT(steps, 4);
  for (const int last : {1, steps / 2, steps}) {
    int asked = 0;
    const auto stopped = map_scene(made.scene, made.recording, {},
                                   [&](const std::string&, int, double) { return ++asked < last; });
    ASSERT_FALSE(stopped) << last;
    EXPECT_EQ(asked, last) << "nobody is asked again";
    EXPECT_THAT(to_string(stopped.error()), HasSubstr("stopped"));
  }
}

TEST(SceneLaws, OptionsOutOfTheirRangeAreNamed) {
  const RigScene made = rig_scene();
  SceneMapOptions options;
  options.min_observations = 0;
  const auto map = map_scene(made.scene, made.recording, options);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(map.error().place.key, HasSubstr("min_observations"));
}

TEST(SceneLaws, ATagThatIsHardlySeenIsNotBelieved) {
  RigScene made = rig_scene();
  TagDetection once = made.recording.frames[5].views[0].detections.front();
  once.tag = rig_tag(70);
  for (Eigen::Vector2d& corner : once.corners_px) corner += Eigen::Vector2d(8, 3);
  made.recording.frames[5].views[0].detections.push_back(once);
  const SceneMap map = mapped(made);
  EXPECT_EQ(map.rejected_tags, std::vector<TagId>{rig_tag(70)});
  const auto& tags = map.scene.bodies[0].tags;
  for (std::size_t t = 0; t < tags.size(); ++t)
    EXPECT_EQ(map.map_T_tag(0, t).has_value(), tags[t].id != rig_tag(70));
}

TEST(GroupViews, OnePictureOfTheFirstCameraHasNoPeriod) {
  const auto stamp = [](int ms) { return SensorTime(std::chrono::milliseconds(ms)); };
  const auto frames = group_views(
      {{stamp(100), {.camera = 0}}, {stamp(100), {.camera = 1}}, {stamp(103), {.camera = 2}}}, true);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].views.size(), 2U) << "what has the same stamp belongs to it, and nothing else is near";
}

TEST(ScenePlanes, TagsOfOnePlaneAreFoundInOne) {
  RigScene made = rig_scene();
  for (std::size_t t = 1; t < made.tags.size(); ++t)
    made.tags[t] = at(made.tags[t].translation().x(), made.tags[t].translation().y(), 2, 0, 0, 0.1);
  // The same pictures of tags that hang in one plane.
  for (std::size_t f = 0; f < made.rig.size(); ++f) {
    auto& seen = made.recording.frames[f].views[0].detections;
    seen.clear();
    Random random(f);
    for (std::size_t t = 0; t < made.tags.size(); ++t) {
      const auto corners = test::rig_corners(made, 0, f, made.tags[t]);
      if (!corners) continue;
      seen.push_back({.tag = rig_tag(t), .corners_px = *corners});
      for (Eigen::Vector2d& corner : seen.back().corners_px) {
        corner.x() += 1.5 * random.normal();
        corner.y() += 1.5 * random.normal();
      }
    }
  }
  const auto spread = [&](const SceneMap& map) {  // about the plane that fits them best
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t t = 1; t < made.tags.size(); ++t) mean += place(map, t).translation() / 7;
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    for (std::size_t t = 1; t < made.tags.size(); ++t) {
      const Eigen::Vector3d off = place(map, t).translation() - mean;
      scatter += off * off.transpose() / 7;
    }
    return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()[0]);
  };
  const double before = spread(mapped(made));
  made.scene.planes = {{.tags = {1, 2, 3, 4, 5, 6, 7}, .sigma_m = 1e-4, .sigma_rad = 1e-3}};
  const double after = spread(mapped(made));
  EXPECT_GT(before, 0.0005);
  EXPECT_LT(after, 0.2 * before);
}

}  // namespace
}  // namespace waymark
