// Invariants of the map of every scene. The frame, tag numbers and the direction of time do not matter;
// covariances are positive definite; a search stops on request.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "tests/support/golden_page.hpp"
#include "tests/support/rig_scene.hpp"
#include "tests/support/scene_outcome.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/scene/scene_report.hpp"

namespace waymark {
namespace {

using test::at;
using test::mapped;
using test::Outcome;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::WideScene;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

SceneMap mapped(const RigScene& made, const SceneMapOptions& options = {}) {
  auto map = map_scene(made.scene, made.recording, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : SceneMap();
}

const SE3& place(const SceneMap& map, std::size_t tag) {
  return map.problem.bundle.poses[map.problem.tags[0][tag]].value;
}

/// The scene with all given poses transformed.
RigScene moved(RigScene made, const SE3& by) {
  made.scene.bodies[0].map_T_body->mean = by * made.scene.bodies[0].map_T_body->mean;
  return made;
}

TEST(SceneLaws, CovariancesArePositiveDefiniteAndFollowTheFrame) {
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

TEST(SceneLaws, RepeatedRunsAreIdentical) {
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

TEST(SceneLaws, TagNumbersDoNotMatter) {
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

TEST(SceneLaws, ReversedTimeGivesTheSameMap) {
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

TEST(SceneLaws, TheNoiseIsEstimatedAndScalesTheCovariance) {
  const SceneMap fine = mapped(rig_scene({.frames = 60, .noise_px = 0.1}));
  const SceneMap rough = mapped(rig_scene({.frames = 60, .noise_px = 0.4}));
  EXPECT_NEAR(fine.noise_px, 0.1, 0.02);
  EXPECT_NEAR(rough.noise_px, 0.4, 0.06);
  const auto sigma = [](const SceneMap& map) {
    return std::sqrt(map.covariance.poses[map.problem.tags[0][7]].trace());
  };
  EXPECT_NEAR(sigma(rough) / sigma(fine), 4, 0.8);
}

TEST(SceneLaws, ASearchStopsOnRequestAtAnyStep) {
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
  EXPECT_EQ(stages.front(), "rejecting outliers");
  EXPECT_EQ(stages.back(), "adjusting");
  ASSERT_GT(steps, 4);
  for (const int last : {1, steps / 2, steps}) {
    int asked = 0;
    const auto stopped = map_scene(made.scene, made.recording, {},
                                   [&](const std::string&, int, double) { return ++asked < last; });
    ASSERT_FALSE(stopped) << last;
    EXPECT_EQ(asked, last) << "the callback is not called again";
    EXPECT_EQ(stopped.error().code, ErrorCode::LimitExceeded);
    if (last == 1) testing::expect_on_page("scene", stopped.error());
  }
}

TEST(SceneLaws, OptionsOutOfRangeAreReported) {
  const RigScene made = rig_scene();
  SceneMapOptions options;
  options.min_observations = 0;
  const auto map = map_scene(made.scene, made.recording, options);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(map.error().place.key, HasSubstr("min_observations"));
}

TEST(SceneLaws, AnUnlistedTagWithOneObservationIsRejected) {
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

TEST(GroupViews, ASingleImageOfTheFirstCameraHasNoPeriod) {
  const auto stamp = [](int ms) { return SensorTime(std::chrono::milliseconds(ms)); };
  const auto frames = group_views(
      {{stamp(100), {.camera = 0}}, {stamp(100), {.camera = 1}}, {stamp(103), {.camera = 2}}}, true);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].views.size(), 2U) << "only views with the same stamp form a frame";
}

TEST(ScenePlanes, TagsOfAPlaneAreEstimatedInAPlane) {
  RigScene made = rig_scene();
  for (std::size_t t = 1; t < made.tags.size(); ++t)
    made.tags[t] = at(made.tags[t].translation().x(), made.tags[t].translation().y(), 2, 0, 0, 0.1);
  // The same images, with tags in one plane.
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
  const auto spread = [&](const SceneMap& map) {  // RMS distance from the best-fitting plane
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

// Values that are given in addition to observations: distances, known tags and sizes. Inconsistent values
// must be reported.

/// Adds the true distances between these tags with this standard deviation.
void measure(WideScene& wide, double sigma_m, const std::vector<std::pair<int, int>>& pairs) {
  for (const auto& [a, b] : pairs) {
    const double far = (wide.truth.at(a).translation() - wide.truth.at(b).translation()).norm();
    wide.scene.distances.push_back({a, b, -1, -1, far, sigma_m});
  }
}

TEST(GivenFacts, ADistanceMakesTheTagSizeAnUnknown) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (SceneBody& body : wide.scene.bodies) {
    body.default_tag_size_m *= 1.006;  // a measurement error in the print size
    for (SceneTag& tag : body.tags) tag.size_m *= 1.006;
  }
  for (int id : {3, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25 * 1.006, {}});
  measure(wide, 0.0005, {{3, 20}});
  SceneMap map;
  const Outcome outcome = mapped(wide, &map);
  EXPECT_NEAR(map.size_scale, 1 / 1.006, 0.0006);
  EXPECT_LT(outcome.mean_m, 0.01);  // 0.6 % of eight metres is 5 cm
  EXPECT_THAT(scene_warnings(map), Not(Contains(HasSubstr("distance"))));
}

/// The normalised squared error of the positions of all tags together, divided by their number.
double joint_nees(const WideScene& wide, const SceneMap& map) {
  std::vector<std::size_t> tags;
  for (std::size_t t = 1; t < map.scene.bodies[0].tags.size(); ++t) {
    if (map.map_T_tag(0, t)) tags.push_back(t);
  }
  std::vector<std::pair<PoseIndex, PoseIndex>> pairs;
  for (const std::size_t a : tags) {
    for (const std::size_t b : tags) pairs.emplace_back(map.problem.tags[0][a], map.problem.tags[0][b]);
  }
  const BundleCovariance covariances = covariance(map.problem.bundle, pairs);
  const auto by_pose = [&](std::size_t t) {
    return Eigen::Matrix<double, 3, 6>(internal::coordinate_jacobian(*map.map_T_tag(0, t), 1).topRows<3>());
  };
  const auto n = static_cast<Eigen::Index>(tags.size());
  Eigen::MatrixXd P(3 * n, 3 * n);
  Eigen::VectorXd error(3 * n);
  for (Eigen::Index a = 0; a < n; ++a) {
    const std::size_t tag = tags[static_cast<std::size_t>(a)];
    error.segment<3>(3 * a) = wide.truth.at(map.scene.bodies[0].tags[tag].id.number).translation() -
                              map.map_T_tag(0, tag)->translation();
    for (Eigen::Index b = 0; b < n; ++b)
      P.block<3, 3>(3 * a, 3 * b) = by_pose(tag) * covariances.pairs[static_cast<std::size_t>(a * n + b)] *
                                    by_pose(tags[static_cast<std::size_t>(b)]).transpose();
  }
  return error.dot(P.llt().solve(error)) / (3.0 * static_cast<double>(n));
}

TEST(GivenFacts, AnErrorThatAllSizesShareIsFoundByDistancesAndOtherwiseInTheCovariances) {
  constexpr double kLarger = 1.02;
  constexpr int kSeeds = 5;
  for (const double own_percent : {0.3, 0.0}) {
    for (const bool measured : {true, false}) {
      double nees = 0;
      for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        WideScene wide = test::aisles(24, seed);
        std::vector<SceneTag>& tags = wide.scene.bodies[0].tags;
        for (int id = 1; id < 24; ++id)
          tags.push_back({{FamilyId::TagStandard52h13, id}, tags[0].size_m, {}});
        const Outcome of_true_sizes = mapped(wide);
        for (SceneTag& tag : tags) tag.size_m /= kLarger;
        if (measured) measure(wide, 0.002, {{3, 20}, {1, 22}});
        const auto map = map_scene(
            wide.scene, wide.recording,
            {.search = {.tag_size_sigma_percent = own_percent, .common_tag_size_sigma_percent = 2}});
        ASSERT_TRUE(map) << to_string(map.error());
        EXPECT_NEAR(map->size_scale, kLarger, 3 * map->size_sigma) << seed;
        if (measured) {
          EXPECT_LT(map->size_sigma, 0.003) << seed;
          EXPECT_LT(test::outcome_of(wide, *map).mean_m, of_true_sizes.mean_m + 0.005) << seed;
        } else {
          EXPECT_NEAR(map->size_sigma, 0.02, 0.001) << seed;
        }
        EXPECT_THAT(map->wrong_sizes, IsEmpty());
        nees += joint_nees(wide, *map) / kSeeds;
      }
      std::printf("all sizes 2 %% off, %s distances: joint NEES %.2f of 1\n", measured ? "with" : "without",
                  nees);
      EXPECT_GT(nees, 0.5);
      EXPECT_LT(nees, 1.5);
    }
  }
}

TEST(GivenFacts, AWrongDistanceAmongManyIsReported) {
  WideScene wide = test::aisles(24, 4, 0.05);
  for (int id : {3, 9, 15, 20})
    wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25, {}});
  measure(wide, 0.002, {{3, 9}, {9, 15}, {15, 20}, {3, 20}});
  wide.scene.distances[1].measured_m += 0.1;
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_warnings(map), Contains(AllOf(HasSubstr("tags 9 and 15"), HasSubstr("sigma"))));
}

/// The largest distance between a tag in the map and its true pose, in standard deviations of the position.
double worst_sigmas(const WideScene& wide, const SceneMap& map) {
  double worst = 0;
  for (std::size_t t = 1; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map.map_T_tag(0, t);
    if (!map_T_tag) continue;
    const Eigen::Vector3d p = map_T_tag->translation();
    const Uncertain<SE3> placed{*map_T_tag, map.covariance.poses[map.problem.tags[0][t]]};
    const Eigen::Matrix3d P = coordinate_covariance(placed).topLeftCorner<3, 3>();
    const Eigen::Vector3d off = wide.truth.at(map.scene.bodies[0].tags[t].id.number).translation() - p;
    worst = std::max(worst, std::sqrt(off.dot(P.llt().solve(off))));
  }
  return worst;
}

TEST(GivenFacts, APriorWithAnUncertainRotationIsSufficient) {
  WideScene wide = test::aisles(24, 6);
  wide.scene.bodies[0].tags[0].body_T_tag =
      ScenePrior::of(wide.truth.at(0), Eigen::Vector3d::Constant(1e-3), Eigen::Vector3d::Constant(1.0));
  const Outcome outcome = mapped(wide);
  EXPECT_EQ(outcome.tags, 24U);
  EXPECT_LT(outcome.mean_m, 0.1);
}

/// Gives the pose of a tag, which is `off` from the true one.
void give_pose(WideScene& wide, int id, const Eigen::Vector3d& off, double sigma_m, double sigma_rad) {
  const SE3 mean(wide.truth.at(id).rotation(), wide.truth.at(id).translation() + off);
  wide.scene.bodies[0].tags.push_back(
      {{FamilyId::TagStandard52h13, id},
       0.25,
       ScenePrior::of(mean, Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad))});
}

TEST(GivenFacts, AKnownTagWithAWrongPoseIsReported) {
  WideScene wide = test::aisles(24, 8);
  give_pose(wide, 1, {0, 0, 0}, 1e-3, 1e-3);
  give_pose(wide, 2, {0, 0, 0}, 1e-3, 1e-3);
  give_pose(wide, 12, {0.4, 0, 0}, 1e-3, 1e-3);
  SceneMap map;
  mapped(wide, &map);
  EXPECT_THAT(scene_warnings(map), Contains(HasSubstr("tag 12 ")));
}

TEST(GivenFacts, AWrongPoseIsReportedAlsoIfTheMapYieldsToIt) {
  WideScene wide = test::aisles(24, 8);
  const auto warnings = [&](double off_m) {
    wide.scene.bodies[0].tags.resize(1);
    give_pose(wide, 20, {0.6 * off_m, 0.8 * off_m, 0}, 5e-3, 1e-2);
    SceneMap map;
    mapped(wide, &map);
    EXPECT_THAT(map.wrong_sizes, IsEmpty());
    return scene_warnings(map);
  };
  EXPECT_THAT(warnings(0), IsEmpty());
  EXPECT_THAT(warnings(0.3), ElementsAre(HasSubstr("contradict the given pose of tag 20 ")));
}

TEST(GivenFacts, AWrongPoseThatTwoOthersRefuteIsNotUsed) {
  WideScene wide = test::aisles(24, 8);
  give_pose(wide, 10, {0, 0, 0}, 5e-3, 1e-2);
  give_pose(wide, 15, {0, 0, 0}, 5e-3, 1e-2);
  const double without_m = mapped(wide).mean_m;
  give_pose(wide, 20, {0.09, 0.12, 0}, 5e-3, 1e-2);
  SceneMap map;
  EXPECT_LT(mapped(wide, &map).mean_m, 1.1 * without_m + 1e-4);
  EXPECT_THAT(scene_warnings(map), ElementsAre(HasSubstr("contradict the given pose of tag 20 ")));
}

TEST(GivenFacts, AWrongSizeIsEstimatedAndReported) {
  for (const int number : {0, 9}) {  // the only known tag; another one
    for (const double factor : {0.8, 0.98, 1.02, 1.05, 1.1, 1.4}) {
      WideScene wide = test::aisles(24, 8);
      if (number != 0) wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, number}, 0.25, {}});
      wide.scene.bodies[0].tags.back().size_m *= factor;
      SceneMap map;
      const Outcome outcome = mapped(wide, &map);
      SCOPED_TRACE(::testing::Message() << "tag " << number << ", factor " << factor);
      EXPECT_EQ(outcome.tags, 24U);
      EXPECT_LT(outcome.mean_m, 0.02);
      EXPECT_LT(worst_sigmas(wide, map), 5);
      ASSERT_EQ(map.wrong_sizes.size(), 1U);
      EXPECT_EQ(map.wrong_sizes[0].tag.number, number);
      EXPECT_NEAR(map.wrong_sizes[0].found_m, 0.25, std::max(0.003 * 0.25, 3 * map.wrong_sizes[0].sigma_m));
      EXPECT_THAT(scene_warnings(map),
                  ElementsAre(AllOf(HasSubstr(fmt::format("tag {}:", number)), HasSubstr("a side of"))));
    }
  }
}

TEST(GivenFacts, AMovedTagIsFoundAndItsLastPoseIsInTheMap) {
  // Tag 0 is the only known one.
  for (const auto& [number, distance_m] : {std::pair(0, 0.03), {0, 0.2}, {9, 0.02}, {17, 0.4}}) {
    SCOPED_TRACE(::testing::Message() << "tag " << number << ", " << distance_m << " m");
    const SE3 by(SO3::exp({0, 0, 0.05}), {distance_m * 0.6, distance_m * 0.8, 0});
    const WideScene wide = test::aisles(24, 8, 0.2, {{number, by}});
    SceneMap map;
    const Outcome outcome = mapped(wide, &map);
    EXPECT_EQ(outcome.tags, 24U);
    EXPECT_LT(outcome.mean_m, 0.02);
    EXPECT_LT(worst_sigmas(wide, map), 5);
    EXPECT_THAT(map.wrong_sizes, IsEmpty());
    ASSERT_EQ(map.moved_tags.size(), 1U);
    EXPECT_EQ(map.moved_tags[0].tag.number, number);
    EXPECT_NEAR(map.moved_tags[0].distance_m, distance_m, 0.01);
    const double half_s = 0.1 * static_cast<double>(wide.recording.frames.size()) / 2;
    EXPECT_LT(map.moved_tags[0].last_before_s, half_s);
    EXPECT_GE(map.moved_tags[0].first_after_s, half_s);
    EXPECT_THAT(scene_warnings(map), Contains(HasSubstr(fmt::format("tag {}: moved", number))));
  }
}

TEST(GivenFacts, AMovedTagIsFoundAlsoIfSizesAreExact) {
  SceneMapOptions exact;
  exact.search.tag_size_sigma_percent = 0;
  for (const int number : {0, 9}) {
    const SE3 by(SO3::exp({0, 0, 0.05}), {0.03, 0.04, 0});
    const WideScene wide = test::aisles(24, 8, 0.2, {{number, by}});
    SceneMap map;
    EXPECT_LT(mapped(wide, &map, exact).mean_m, 0.02);
    ASSERT_EQ(map.moved_tags.size(), 1U) << number;
    EXPECT_EQ(map.moved_tags[0].tag.number, number);
    EXPECT_NEAR(map.moved_tags[0].distance_m, 0.05, 0.01);
  }
}

TEST(GivenFacts, DistancesOfAMovedTagAreThoseBeforeTheMove) {
  const SE3 by(SO3(), {0.12, 0.16, 0});
  WideScene wide = test::aisles(24, 8, 0.2, {{9, by}});
  for (int id : {9, 20}) wide.scene.bodies[0].tags.push_back({{FamilyId::TagStandard52h13, id}, 0.25, {}});
  const SE3 last = wide.truth.at(9);
  wide.truth.at(9) = last * by.inverse();
  measure(wide, 0.002, {{9, 20}});
  wide.truth.at(9) = last;
  SceneMap map;
  const Outcome outcome = mapped(wide, &map);
  EXPECT_NEAR(map.size_scale, 1, 0.003);  // 0.2 m of the distance would be several per cent
  EXPECT_LT(outcome.mean_m, 0.02);
  ASSERT_EQ(map.moved_tags.size(), 1U);
  EXPECT_EQ(map.moved_tags[0].tag.number, 9);
  EXPECT_NEAR(map.moved_tags[0].distance_m, 0.2, 0.01);
  EXPECT_THAT(scene_warnings(map), Not(Contains(HasSubstr("distance"))));
}

TEST(GivenFacts, ATagThatWasNotMovedIsNotReportedAsMoved) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    WideScene wide = test::aisles(24, seed, 0.2, {{3, SE3()}});  // walked twice
    if (seed > 3) wide.scene.bodies[0].tags.back().size_m *= 1.05;
    SceneMap map;
    mapped(wide, &map);
    EXPECT_THAT(map.moved_tags, IsEmpty()) << seed;
    EXPECT_EQ(map.wrong_sizes.size(), seed > 3 ? 1U : 0U) << seed;
  }
}

TEST(GivenFacts, ATagThatWasTakenAwayIsReported) {
  for (const int number : {5, 9, 17}) {
    WideScene wide = test::aisles(24, 8, 0.2, {{3, SE3()}});  // walked twice
    const std::size_t half = wide.recording.frames.size() / 2;
    int gone = 0;
    for (std::size_t f = half; f < wide.recording.frames.size(); ++f)
      gone += static_cast<int>(
          std::erase_if(wide.recording.frames[f].views[0].detections,
                        [&](const TagDetection& seen) { return seen.tag.number == number; }));
    SceneMap map;
    mapped(wide, &map);
    ASSERT_EQ(map.missing_tags.size(), 1U) << number;
    EXPECT_EQ(map.missing_tags[0].tag.number, number);
    EXPECT_GE(map.missing_tags[0].expected_images, gone / 2);
    EXPECT_LE(map.missing_tags[0].expected_images, 1.3 * gone);  // images show at most seven tags
    EXPECT_LT(*map.missing_tags[0].last_seen_s, 0.1 * static_cast<double>(half));
    EXPECT_THAT(scene_warnings(map), Contains(HasSubstr(fmt::format("tag {}: expected", number))));
  }
}

TEST(GivenFacts, ATagThatWasNotTakenAwayIsNotReported) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    SceneMap map;
    mapped(test::aisles(24, seed, 0.2, {{3, SE3()}}), &map);
    EXPECT_THAT(map.missing_tags, IsEmpty()) << seed;
    mapped(test::ceiling(64, seed), &map);
    EXPECT_THAT(map.missing_tags, IsEmpty()) << seed;
  }
}

TEST(GivenFacts, PrintedSizesThatScatterAreInTheCovariances) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int seeds = full ? 20 : 5;
  for (const double percent : {0.0, 0.3, 1.0}) {
    Random random(31);
    double nees = 0;
    double nees_if_exact = 0;
    int warnings = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      WideScene wide = test::aisles(24, static_cast<std::uint64_t>(seed));
      std::vector<SceneTag>& tags = wide.scene.bodies[0].tags;
      for (int id = 1; id < 24; ++id) tags.push_back({{FamilyId::TagStandard52h13, id}, tags[0].size_m, {}});
      for (SceneTag& tag : tags) tag.size_m *= std::exp(percent / 100 * random.normal());
      SceneMap map;
      mapped(wide, &map);
      nees += joint_nees(wide, map) / seeds;
      warnings += scene_warnings(map).empty() ? 0 : 1;
      const auto exact = map_scene(wide.scene, wide.recording, {.search = {.tag_size_sigma_percent = 0}});
      ASSERT_TRUE(exact);
      nees_if_exact += joint_nees(wide, *exact) / seeds;
    }
    std::printf(
        "sizes %.1f %% off: joint NEES %.2f of 1 (%.1f if sizes are exact), %d of %d maps with warnings\n",
        percent, nees, nees_if_exact, warnings, seeds);
    EXPECT_GT(nees, 0.5) << percent;
    EXPECT_LT(nees, 1.5) << percent;
    EXPECT_EQ(warnings, percent < 1 ? 0 : seeds);
  }
}

TEST(GivenFacts, TheOnlyKnownTagThatSwingsIsReported) {
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
  EXPECT_THAT(scene_warnings(map), Contains(AllOf(HasSubstr("of tag 0"), HasSubstr("rejected"))));
}

// Scenes in which two tags carry one id. Their maps must be as accurate as without the second tag, and must
// name the id.

/// A scene in which the tag `other` carries the id of the tag `id`.
struct DuplicateScene {
  WideScene wide;
  int id = 0;
  SE3 first{}, second{};  ///< true poses of the two tags

  DuplicateScene(WideScene made, int id_of_both, int other)
      : wide(std::move(made)), id(id_of_both), first(wide.truth.at(id)), second(wide.truth.at(other)) {
    for (SceneFrame& frame : wide.recording.frames) {
      for (TagDetection& detection : frame.views[0].detections) {
        if (detection.tag.number == other) detection.tag.number = id;
      }
    }
    wide.truth.erase(other);
  }

  /// The errors of the map, in which the id may be either tag.
  [[nodiscard]] Outcome mapped_once(SceneMap& map) {
    test::mapped(wide, &map);
    for (std::size_t t = 0; t < map.scene.bodies[0].tags.size(); ++t) {
      const auto map_T_tag = map.map_T_tag(0, t);
      if (!map_T_tag || map.scene.bodies[0].tags[t].id.number != id) continue;
      const auto off = [&](const SE3& truth) {
        return (map_T_tag->translation() - truth.translation()).norm();
      };
      wide.truth.at(id) = off(first) < off(second) ? first : second;
    }
    return test::outcome_of(wide, map);
  }
};

/// Expects that the map names this id, and no other cause.
void expect_duplicate(const SceneMap& map, const DuplicateScene& made) {
  ASSERT_EQ(map.duplicate_tags.size(), 1U);
  const DuplicateTag& duplicate = map.duplicate_tags[0];
  EXPECT_EQ(duplicate.tag.number, made.id);
  EXPECT_NEAR(duplicate.distance_m, (made.first.translation() - made.second.translation()).norm(), 0.03);
  EXPECT_GT(duplicate.here, 0);
  EXPECT_GT(duplicate.there, 0);
  EXPECT_THAT(map.moved_tags, IsEmpty());
  EXPECT_THAT(map.wrong_sizes, IsEmpty());
  EXPECT_THAT(scene_warnings(map), ElementsAre(HasSubstr(fmt::format("tag {}: observed at two", made.id))));
}

TEST(DuplicateIds, BothTagsAreFoundAndOneIsInTheMap) {
  const std::map<int, SE3> twice = {{1, SE3()}};  // the same walk follows once more
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    for (const auto& [id, other] : {std::pair(3, 18), {3, 6}, {8, 10}, {14, 4}}) {
      for (const bool again : {false, true}) {
        SCOPED_TRACE(::testing::Message()
                     << id << " and " << other << ", seed " << seed << (again ? ", walked twice" : ""));
        const WideScene wide = test::aisles(24, seed, 0.2, again ? twice : std::map<int, SE3>());
        DuplicateScene made(wide, id, other);
        SceneMap map;
        const Outcome outcome = made.mapped_once(map);
        EXPECT_EQ(outcome.tags, 23U);
        EXPECT_LT(outcome.mean_m, 1.5 * mapped(wide).mean_m) << "as without the duplicate";
        EXPECT_LT(worst_sigmas(made.wide, map), 5);
        expect_duplicate(map, made);
        if (map.duplicate_tags.empty()) continue;
        const bool at_once = std::abs(id - other) <= 3;
        EXPECT_EQ(map.duplicate_tags[0].at_once, at_once);
        EXPECT_EQ(map.duplicate_tags[0].one_after_the_other, !at_once && !again);
      }
    }
  }
}

TEST(DuplicateIds, TheOnlyKnownTagCanBeOneOfThem) {
  const WideScene wide = test::aisles(24, 5);
  const Outcome without = mapped(wide);
  for (const int other : {3, 15}) {
    DuplicateScene made(wide, 0, other);
    SceneMap map;
    test::mapped(made.wide, &map);
    // The known pose is that of the tag in the map. If this is the other one, the map has another frame.
    double least_m = 1e9;
    for (const SE3& truth : {made.first, made.second}) {
      WideScene there = made.wide;
      for (auto& [id, map_T_tag] : there.truth) map_T_tag = made.first * (truth.inverse() * map_T_tag);
      there.truth.at(0) = made.first;
      least_m = std::min(least_m, test::outcome_of(there, map).mean_m);
    }
    EXPECT_LT(least_m, 1.5 * without.mean_m) << other;
    expect_duplicate(map, made);
  }
}

TEST(DuplicateIds, TheTagAtTheGivenPoseIsInTheMap) {
  for (const int other : {4, 20}) {
    WideScene wide = test::aisles(24, 8);
    give_pose(wide, 12, {0, 0, 0}, 1e-3, 1e-3);
    DuplicateScene made(wide, 12, other);
    SceneMap map;
    EXPECT_LT(made.mapped_once(map).mean_m, 1.5 * mapped(wide).mean_m);
    EXPECT_EQ(made.wide.truth.at(12).translation(), made.first.translation()) << other;
    expect_duplicate(map, made);
  }
}

TEST(DuplicateIds, OtherCausesAreNotReportedAsDuplicates) {
  const WideScene once = test::aisles(24, 8);
  const WideScene twice = test::aisles(24, 8, 0.2, {{9, SE3()}});
  const WideScene large = test::aisles(120, 3);
  WideScene misread = large;
  test::misread(misread.recording, 120, 0.02, 5);
  const std::vector<std::pair<WideScene, WideScene>> scenes = {
      {once, once}, {twice, twice}, {misread, large}};
  for (const auto& [wide, without] : scenes) {
    SceneMap map;
    EXPECT_LT(mapped(wide, &map).mean_m, 1.5 * mapped(without).mean_m);
    EXPECT_THAT(map.duplicate_tags, IsEmpty());
  }
}

TEST(DuplicateIds, ATagThatWasMovedFarIsNoDuplicate) {
  const double without_m = mapped(test::aisles(24, 8, 0.2, {{9, SE3()}})).mean_m;
  const SE3 far(SO3::exp({0, 0, 0.05}), {-2, 0, 0});
  SceneMap map;
  EXPECT_LT(mapped(test::aisles(24, 8, 0.2, {{9, far}}), &map).mean_m, 1.5 * without_m);
  EXPECT_THAT(map.duplicate_tags, IsEmpty());
  ASSERT_EQ(map.moved_tags.size(), 1U);
  EXPECT_EQ(map.moved_tags[0].tag.number, 9);
  EXPECT_NEAR(map.moved_tags[0].distance_m, 2, 0.03);
}

TEST(DuplicateIds, ATagThatWasMovedOutOfViewIsMissing) {
  const SE3 away(SO3::exp({0, 0, 0.05}), {1.2, 1.6, 0});  // one image shows it there
  WideScene wide = test::aisles(24, 8, 0.2, {{9, away}});
  wide.truth.at(9) = wide.truth.at(9) * away.inverse();
  SceneMap map;
  EXPECT_LT(mapped(wide, &map).mean_m, 1.5 * mapped(test::aisles(24, 8, 0.2, {{9, SE3()}})).mean_m);
  EXPECT_THAT(map.duplicate_tags, IsEmpty());
  ASSERT_EQ(map.missing_tags.size(), 1U);
  EXPECT_EQ(map.missing_tags[0].tag.number, 9);
}

/// Adds the first walk of the scene once more.
void walk_again(WideScene& wide, std::size_t frames, std::uint64_t seed) {
  Random random(seed);
  const std::vector<SE3> path(wide.map_T_cam.begin(),
                              wide.map_T_cam.begin() + static_cast<std::ptrdiff_t>(frames));
  test::internal::film(wide, path, 3.6, 7, 0.2, random);
}

TEST(DuplicateIds, ATagThatWasMovedAndReturnedIsNoDuplicate) {
  const SE3 far(SO3::exp({0, 0, 0.05}), {1.2, 0.4, 0});
  WideScene wide = test::aisles(24, 8, 0.2, {{9, far}});
  wide.truth.at(9) = wide.truth.at(9) * far.inverse();
  walk_again(wide, wide.recording.frames.size() / 2, 4);
  SceneMap map;
  EXPECT_LT(mapped(wide, &map).mean_m, 0.05);
  EXPECT_THAT(map.duplicate_tags, IsEmpty());
}

TEST(DuplicateIds, ATagAtManyPlacesIsAMovingTag) {
  WideScene wide = test::aisles(48, 9);
  for (const int other : {9, 15, 21, 27, 33, 39, 45}) wide = DuplicateScene(wide, 3, other).wide;
  wide.truth.erase(3);
  WideScene others = wide;
  for (SceneFrame& frame : others.recording.frames)
    std::erase_if(frame.views[0].detections, [](const TagDetection& seen) { return seen.tag.number == 3; });
  const Outcome without = mapped(others);
  auto map = map_scene(wide.scene, wide.recording);
  ASSERT_TRUE(map) << to_string(map.error());
  EXPECT_THAT(map->duplicate_tags, IsEmpty());
  for (std::size_t t = 0; t < map->scene.bodies[0].tags.size(); ++t) {
    if (map->scene.bodies[0].tags[t].id.number == 3) wide.truth[3] = map->map_T_tag(0, t).value_or(SE3());
  }
  EXPECT_LT(test::outcome_of(wide, *map).mean_m, 2 * without.mean_m + 0.01);
}

TEST(DuplicateIds, NearPrintsObservedAtOnceAreDuplicates) {
  // Tags have a side of 0.25 m, and most images show them obliquely.
  for (const SE3& by : {at(0.255, 0, 0), at(-0.27, 0, 0), at(0.45, 0, 0), at(0, 0.26, 0)}) {
    WideScene wide = test::aisles(24, 10);
    Random random(11);
    const std::vector<SE3> path = wide.map_T_cam;
    wide.recording.frames.clear();
    wide.map_T_cam.clear();
    wide.truth[100] = wide.truth.at(9) * by;
    test::internal::film(wide, path, 3.6, 8, 0.2, random);
    DuplicateScene made(wide, 9, 100);
    SceneMap map;
    EXPECT_LT(made.mapped_once(map).mean_m, 1.5 * mapped(wide).mean_m);
    expect_duplicate(map, made);
    EXPECT_TRUE(map.duplicate_tags.empty() || map.duplicate_tags[0].at_once);
  }
}

TEST(DuplicateIds, TheSearchStopsOnRequest) {
  const DuplicateScene made(test::aisles(24, 5), 3, 18);
  for (int last = 1; last < 60; last += 7) {
    int calls = 0;
    const auto stopped = map_scene(made.wide.scene, made.wide.recording, {},
                                   [&](const std::string&, int, double) { return ++calls < last; });
    if (calls < last) break;
    ASSERT_FALSE(stopped) << last;
    EXPECT_EQ(stopped.error().code, ErrorCode::LimitExceeded);
  }
}

TEST(DuplicateIds, OdometryIsNotTheCause) {
  DuplicateScene made(test::aisles(24, 6), 3, 18);
  test::add_odometry(made.wide, 0.002, 0.001, 3);
  SceneMap map;
  EXPECT_LT(made.mapped_once(map).mean_m, 0.02);
  EXPECT_THAT(map.rejected_odometry, IsEmpty());
  expect_duplicate(map, made);
}

// Scenes with misread ids. Their maps must be as accurate as those without misread ids, or the affected parts
// must be excluded and reported. With WAYMARK_FULL=1, 50 seeds are run.

TEST(WrongIds, AislesAreMappedAsAccuratelyAsWithoutThem) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int seeds = full ? 50 : 1;
  constexpr int kTags = 520;
  for (int seed = 1; seed <= seeds; ++seed) {
    const WideScene clean = test::aisles(kTags, static_cast<std::uint64_t>(seed));
    const Outcome reference = mapped(clean);
    EXPECT_EQ(reference.tags, kTags);
    std::printf("seed %d: %zu detections in %zu frames, clean %.3f m (worst %.3f), %zu tags, %.2f s\n", seed,
                clean.detections, clean.recording.frames.size(), reference.mean_m, reference.worst_m,
                reference.tags, reference.seconds);
    for (double share : full ? std::vector{0.0005, 0.005, 0.02} : std::vector{0.005, 0.02}) {
      WideScene changed = clean;
      const std::size_t wrong =
          test::misread(changed.recording, kTags, share, 1000 + static_cast<std::uint64_t>(seed));
      const Outcome outcome = mapped(changed);
      std::printf("  %zu wrong ids: %.3f m (worst %.3f), %zu tags, %.2f s\n", wrong, outcome.mean_m,
                  outcome.worst_m, outcome.tags, outcome.seconds);
      EXPECT_GE(static_cast<double>(outcome.tags), (share > 0.01 ? 0.90 : 0.98) * kTags) << seed;
      EXPECT_LT(outcome.mean_m, 1.5 * reference.mean_m) << "seed " << seed << ", share " << share;
    }
  }
}

TEST(WrongIds, AMisreadIdIsAssignedToTheTagAtItsPosition) {
  const WideScene clean = test::aisles(120, 3);
  WideScene changed = clean;
  const std::size_t wrong = test::misread(changed.recording, 120, 0.02, 5);
  SceneMap map;
  mapped(changed, &map);
  EXPECT_GT(static_cast<double>(map.corrected_ids.size()), 0.85 * static_cast<double>(wrong));
  for (const CorrectedId& corrected : map.corrected_ids) {
    const auto& read = changed.recording.frames[corrected.frame].views[0].detections;
    const auto& is = clean.recording.frames[corrected.frame].views[0].detections;
    bool right = false;
    for (std::size_t d = 0; d < read.size(); ++d)
      right = right || (read[d].tag == corrected.read && is[d].tag == corrected.is);
    EXPECT_TRUE(right) << corrected.read.number << " for " << corrected.is.number;
  }
  EXPECT_THAT(scene_warnings(map), Contains(HasSubstr("misread")));
  SceneMap of_clean;
  mapped(clean, &of_clean);
  EXPECT_TRUE(of_clean.corrected_ids.empty());
}

/// The same walk, in which all but a few of the detections that connect two parts have been removed.
WideScene thinly_tied(int observations) {
  WideScene wide = test::aisles(60, 7);
  int left = observations;
  for (SceneFrame& frame : wide.recording.frames) {
    auto& seen = frame.views[0].detections;
    const bool both = std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number <= 30; }) &&
                      std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number > 30; });
    if (!both) continue;
    const bool tied =
        left > 0 && std::ranges::any_of(seen, [](const TagDetection& d) { return d.tag.number == 30; });
    left -= tied ? 1 : 0;
    std::erase_if(seen, [&](const TagDetection& d) { return tied ? d.tag.number < 30 : d.tag.number <= 30; });
  }
  return wide;
}

TEST(Odometry, ConnectsTagsThatNoImageShowsTogether) {
  for (const double misread : {0.0, 0.005, 0.02}) {
    WideScene wide = test::aisles(200, 2);
    test::add_odometry(wide, 0.002, 0.001, 3);
    const std::size_t seen = test::keep_nearest(wide);
    EXPECT_GT(seen, 150U);
    const std::size_t wrong = test::misread(wide.recording, 200, misread, 4);
    SceneMap map;
    const Outcome outcome = mapped(wide, &map);
    std::printf("%zu of %zu tags, %zu wrong ids: %.3f m (worst %.3f m, %.1f sigma)\n", outcome.tags, seen,
                wrong, outcome.mean_m, outcome.worst_m, worst_sigmas(wide, map));
    EXPECT_GE(static_cast<double>(outcome.tags), (misread > 0 ? 0.98 : 1) * static_cast<double>(seen));
    EXPECT_LT(worst_sigmas(wide, map), 5);
    EXPECT_TRUE(map.undetermined.empty());
  }
}

TEST(WrongIds, APartConnectedByTwoObservationsIsMappedAndReported) {
  SceneMap map;
  EXPECT_EQ(mapped(thinly_tied(2), &map).tags, 60U);
  ASSERT_FALSE(map.thin_cuts.empty());
  EXPECT_EQ(map.thin_cuts[0].observations, 2);
  EXPECT_THAT(scene_warnings(map),
              Contains(AllOf(HasSubstr("tags 31-59"), HasSubstr("2 observations of tag 30"))));
}

TEST(WrongIds, AMapThatDependsOnOneImageOfItsOnlyKnownTagIsReported) {
  for (const bool odometry : {false, true}) {
    WideScene wide = test::aisles(40, 7);
    int left = 2;
    for (SceneFrame& frame : wide.recording.frames)
      std::erase_if(frame.views[0].detections,
                    [&](const TagDetection& seen) { return seen.tag.number == 0 && left-- <= 0; });
    if (odometry) test::add_odometry(wide, 0.002, 0.001, 3);
    SceneMap map;
    EXPECT_EQ(mapped(wide, &map).tags, 40U);
    ASSERT_FALSE(map.thin_cuts.empty()) << odometry;
    EXPECT_EQ(map.thin_cuts[0].beyond.size(), 39U);
    EXPECT_EQ(map.thin_cuts[0].by, std::vector<TagId>{wide.scene.bodies[0].tags[0].id});
    EXPECT_EQ(map.thin_cuts[0].observations, 2);
    EXPECT_FALSE(map.thin_cuts[0].otherwise_sigma_m);
  }
}

TEST(WrongIds, MotionChecksFewObservationsOnlyIfItIsPrecise) {
  for (const double sigma_m : {0.0005, 0.05}) {
    WideScene wide = thinly_tied(2);
    test::add_odometry(wide, sigma_m, sigma_m / 10, 3);
    SceneMap map;
    EXPECT_EQ(mapped(wide, &map).tags, 60U);
    const auto part =
        std::ranges::find_if(map.thin_cuts, [](const TagCut& cut) { return cut.beyond.size() == 29; });
    EXPECT_EQ(part != map.thin_cuts.end(), sigma_m > 0.01) << sigma_m;
    if (part == map.thin_cuts.end()) continue;
    ASSERT_TRUE(part->otherwise_sigma_m);
    EXPECT_GT(*part->otherwise_sigma_m, sigma_m);
    EXPECT_LT(worst_sigmas(wide, map), 5);
  }
}

TEST(WrongIds, ASceneWithoutTwoTagsInOneImageIsRefused) {
  WideScene wide = test::aisles(20, 7);
  test::keep_nearest(wide);
  const auto map = map_scene(wide.scene, wide.recording);
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().code, ErrorCode::NotFound);
  EXPECT_FALSE(map.error().hint.empty());
}

TEST(WrongIds, APartConnectedByOneObservationIsExcludedAndReported) {
  SceneMap map;
  EXPECT_EQ(mapped(thinly_tied(1), &map).tags, 31U);
  ASSERT_EQ(map.left_out_cuts.size(), 1U);
  EXPECT_EQ(map.left_out_cuts[0].beyond.size(), 29U);
  EXPECT_THAT(scene_warnings(map),
              Contains(AllOf(HasSubstr("tags 31-59"), HasSubstr("one observation of tag 30"))));
}

TEST(WrongIds, CovariancesOfAcceptedTagsAreConsistent) {
  WideScene changed = test::aisles(120, 3);
  test::misread(changed.recording, 120, 0.02, 5);
  SceneMap map;
  mapped(changed, &map);
  EXPECT_TRUE(map.undetermined.empty());
  double sum = 0;
  int count = 0;
  for (std::size_t t = 1; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto map_T_tag = map.map_T_tag(0, t);
    if (!map_T_tag) continue;
    const Matrix6& P = map.covariance.poses[map.problem.tags[0][t]];
    const Vector6 e = minus(changed.truth.at(map.scene.bodies[0].tags[t].id.number), *map_T_tag);
    EXPECT_GT(P.diagonal().minCoeff(), 0);
    sum += e.dot(P.llt().solve(e));
    ++count;
  }
  ASSERT_GT(count, 108);
  // The errors in one draw are strongly correlated, so only large deviations are significant.
  EXPECT_GT(sum / count, 1.0);
  EXPECT_LT(sum / count, 16.0);
}

TEST(WrongIds, CovariancesOfALongMapAreConsistent) {
  const WideScene wide = test::aisles(320, 3);
  SceneMap map;
  mapped(wide, &map);
  EXPECT_TRUE(map.undetermined.empty());
  for (std::size_t t = 20; t < 320; t += 50) {
    const Matrix6& P = map.covariance.poses[map.problem.tags[0][t]];
    const Vector6 e = minus(wide.truth.at(map.scene.bodies[0].tags[t].id.number), *map.map_T_tag(0, t));
    EXPECT_GT(P.diagonal().minCoeff(), 0) << t;
    EXPECT_LT(e.dot(P.llt().solve(e)), 22.46) << t << ": 0.999 quantile of chi-square";
  }
}

}  // namespace
}  // namespace waymark
