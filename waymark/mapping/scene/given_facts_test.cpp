// What is given beside observations: distances, known tags, sizes. Each frees what it tells of, and is named
// where the rest contradicts it.
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scene_outcome.hpp"
#include "waymark/mapping/scene/scene_checks.hpp"

namespace waymark {
namespace {

using test::mapped;
using test::Outcome;
using test::WideScene;

/// Distances between these tags as they are, that good.
void measure(WideScene& wide, double sigma_m, const std::vector<std::pair<int, int>>& pairs) {
  for (const auto& [a, b] : pairs) {
    const double far = (wide.truth.at(a).translation() - wide.truth.at(b).translation()).norm();
    wide.scene.distances.push_back({a, b, -1, -1, far, sigma_m});
  }
}

TEST(GivenFacts, ADistanceFreesTheSizeOfTheTags) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (SceneBody& body : wide.scene.bodies) {
    body.default_tag_size_m *= 1.006;  // as somebody measured the print
    for (SceneTag& tag : body.tags) tag.size_m *= 1.006;
  }
  for (int id : {3, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25 * 1.006, {}});
  measure(wide, 0.0005, {{3, 20}});
  SceneMap map;
  const Outcome outcome = mapped(wide, &map);
  EXPECT_NEAR(map.size_scale, 1 / 1.006, 0.0006);
  EXPECT_LT(outcome.mean_m, 0.01);  // 0.6 % of eight metres are 5 cm
  EXPECT_THAT(scene_doubts(map), testing::Not(testing::Contains(testing::HasSubstr("distance"))));
}

TEST(GivenFacts, OneOfManyDistancesThatIsWrongIsNamed) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (int id : {3, 9, 15, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25, {}});
  measure(wide, 0.002, {{3, 9}, {9, 15}, {15, 20}, {3, 20}});
  wide.scene.distances[1].measured_m += 0.1;
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::AllOf(testing::HasSubstr("between tags 9 and 15"),
                                                                  testing::HasSubstr("sigma"))));
}

TEST(GivenFacts, APriorThatHardlyKnowsTheTurnLeadsToAMap) {
  WideScene wide = test::aisles(24, 6);
  wide.scene.bodies[0].tags[0].body_T_tag =
      ScenePrior::of(wide.truth.at(0), Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1.0));
  const Outcome outcome = mapped(wide);
  EXPECT_EQ(outcome.tags, 24U);
  EXPECT_LT(outcome.mean_m, 0.1);
}

TEST(GivenFacts, AKnownTagThatStandsElsewhereIsNamed) {
  WideScene wide = test::aisles(24, 8);
  const auto give = [&](int id, const Eigen::Vector3d& off) {
    const SE3 mean(wide.truth.at(id).rotation(), wide.truth.at(id).translation() + off);
    wide.scene.bodies[0].tags.push_back(
        {{FamilyId::TagStandard52h13, id},
         0.25,
         ScenePrior::of(mean, Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1e-3))});
  };
  give(1, {0, 0, 0});
  give(2, {0, 0, 0});
  give(12, {0.4, 0, 0});
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::HasSubstr("tag 12 ")));
}

TEST(GivenFacts, TheOnlyKnownTagIsNamedWhenItsSizeIsWrong) {
  WideScene wide = test::aisles(24, 8);
  wide.scene.bodies[0].tags[0].size_m *= 1.4;
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::AllOf(
                                     testing::HasSubstr("observations of tag 0 contradict the rest"),
                                     testing::HasSubstr("of the size given"))));
}

TEST(GivenFacts, TheOnlyKnownTagIsNamedWhenItHangsLoose) {
  WideScene wide = test::aisles(24, 8);
  Random random(3);
  for (SceneFrame& frame : wide.recording.frames) {
    for (TagDetection& detection : frame.views[0].detections) {
      if (detection.tag.number != 0) continue;
      const Eigen::Vector2d swing(22 * random.normal(), 5 * random.normal());
      for (Eigen::Vector2d& corner : detection.corners_px) corner += swing;
    }
  }
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_doubts(map), testing::Contains(testing::HasSubstr("of tag 0 contradict the rest")));
}

}  // namespace
}  // namespace waymark
