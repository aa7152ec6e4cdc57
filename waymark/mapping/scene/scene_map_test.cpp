// Tests cameras on bodies that observe tags on bodies: compared with ground truth, without initial values,
// and with foreign ids.
#include "waymark/mapping/scene/scene_map.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/scene/scene_report.hpp"
#include "waymark/mapping/scene/scene_values.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kSize = 0.2;

CameraModel lens(bool fisheye) {
  if (fisheye)
    return CameraModel::make(Equidistant{300, 300, 320, 240, {0.01, -0.005, 0, 0}}, 640, 480).value();
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 4};
  radtan.k = {0.045, -0.077, 0, 0, 0, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

SE3 at(double x, double y, double z, double rx = 0, double ry = 0, double rz = 0) {
  return {SO3::exp({rx, ry, rz}), Eigen::Vector3d(x, y, z)};
}

/// Ground truth and a recording of it.
struct RobotSetup {
  TagScene scene{};
  SceneRecording recording{};
  std::vector<SE3> cameras{};              ///< body_T_cam
  std::vector<std::vector<SE3>> bodies{};  ///< for each body and frame (one entry for a static body)
  std::vector<std::vector<SE3>> tags{};    ///< body_T_tag
};

const SE3& body_at(const RobotSetup& setup, std::size_t body, std::size_t frame) {
  return setup.bodies[body].size() == 1 ? setup.bodies[body].front() : setup.bodies[body][frame];
}

/// Adds detections of all visible tags, with this corner noise.
void film(RobotSetup& setup, std::size_t frames, double noise_px, Random& random) {
  for (std::size_t f = 0; f < frames; ++f) {
    SceneFrame frame{.stamp = SensorTime(std::chrono::milliseconds(100 * f))};
    for (std::size_t c = 0; c < setup.scene.cameras.size(); ++c) {
      SceneView view{.camera = c};
      const SE3 map_T_cam = body_at(setup, setup.scene.cameras[c].body, f) * setup.cameras[c];
      for (std::size_t b = 0; b < setup.tags.size(); ++b) {
        for (std::size_t t = 0; t < setup.tags[b].size(); ++t) {
          const SE3 cam_T_tag = map_T_cam.inverse() * body_at(setup, b, f) * setup.tags[b][t];
          const auto corners = visible_corners(setup.scene.cameras[c].model, cam_T_tag, kSize);
          if (!corners) continue;
          TagDetection detection{.tag = {FamilyId::Tag36h11, static_cast<int>(100 * b + t)},
                                 .corners_px = *corners};
          for (auto& corner : detection.corners_px)
            corner += noise_px * Eigen::Vector2d(random.normal(), random.normal());
          view.detections.push_back(detection);
        }
      }
      frame.views.push_back(view);
    }
    setup.recording.frames.push_back(frame);
  }
}

ScenePrior exactly(const SE3& mean) {
  return ScenePrior::of(mean, Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-4));
}

/// A rig with a pinhole camera and a fisheye camera that moves along a wall of ten tags. The mounting of the
/// fisheye camera is unknown, and one of the tags is known.
RobotSetup rig_setup(std::uint64_t seed, double noise_px) {
  Random random(seed);
  RobotSetup setup;
  setup.cameras = {at(0, 0, 0), at(0.3, 0.02, 0, 0, 0.25, 0.05)};
  setup.scene.bodies.push_back(
      {.name = "wall", .map_T_body = exactly(at(0, 0, 0)), .default_tag_size_m = kSize});
  setup.scene.bodies.push_back({.name = "rig", .is_static = false});
  setup.scene.default_body = 0;
  for (std::size_t c = 0; c < 2; ++c)
    setup.scene.cameras.push_back({.name = "cam" + std::to_string(c), .model = lens(c == 1), .body = 1});
  setup.scene.cameras[0].body_T_cam = exactly(setup.cameras[0]);
  setup.bodies = {{at(0, 0, 0)}, {}};
  setup.tags.resize(1);
  for (int i = 0; i < 10; ++i)
    setup.tags[0].push_back(at(0.4 * i - 1.5, 0.3 * (i % 3) - 0.3, 2 + random.uniform(-0.1, 0.1),
                               random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3),
                               random.uniform(-0.2, 0.2)));
  setup.scene.bodies[0].tags.push_back({{FamilyId::Tag36h11, 0}, kSize, exactly(setup.tags[0][0])});
  constexpr std::size_t kFrames = 40;
  for (std::size_t f = 0; f < kFrames; ++f) {
    const double s = static_cast<double>(f) / kFrames;
    setup.bodies[1].push_back(
        at(4 * s - 2, 0.3 * std::sin(9 * s), 0.4 * s, 0.1 * std::sin(5 * s), 0.1, 0.2 * std::sin(7 * s)));
  }
  film(setup, kFrames, noise_px, random);
  return setup;
}

/// Two fixed cameras that observe a cube with four tags. The pose of one camera and one of the tags are
/// known.
RobotSetup cube_setup(std::uint64_t seed, double noise_px) {
  Random random(seed);
  RobotSetup setup;
  setup.cameras = {at(0, 0, 0), at(1.2, 0, 0.3, 0, -0.6, 0)};
  setup.scene.bodies.push_back({.name = "lab", .map_T_body = exactly(at(0, 0, 0))});
  setup.scene.bodies.push_back({.name = "cube", .is_static = false});
  for (std::size_t c = 0; c < 2; ++c)
    setup.scene.cameras.push_back({.name = "cam" + std::to_string(c), .model = lens(false), .body = 0});
  setup.scene.cameras[0].body_T_cam = exactly(setup.cameras[0]);
  setup.bodies = {{at(0, 0, 0)}, {}};
  setup.tags = {
      {}, {at(0, 0, -0.15), at(-0.2, 0, 0, 0, 0.9, 0), at(0.2, 0, 0, 0, -0.9, 0), at(0, 0.22, 0, 0.9, 0, 0)}};
  for (std::size_t t = 0; t < 4; ++t)
    setup.scene.bodies[1].tags.push_back({{FamilyId::Tag36h11, 100 + static_cast<int>(t)}, kSize, {}});
  setup.scene.bodies[1].tags[0].body_T_tag = exactly(setup.tags[1][0]);
  for (std::size_t f = 0; f < 40; ++f) {
    const double s = static_cast<double>(f) / 40;
    setup.bodies[1].push_back(at(0.4 * std::sin(6 * s), 0.2 * std::cos(5 * s), 2 + 0.3 * s,
                                 0.5 * std::sin(11 * s), 0.5 * std::sin(13 * s), 3 * s));
  }
  film(setup, 40, noise_px, random);
  return setup;
}

double error_of(const SE3& estimate, const SE3& truth) { return minus(estimate, truth).norm(); }

TEST(SceneMap, EstimatesARigItsSecondCameraAndAWallFromOneTag) {
  const RobotSetup setup = rig_setup(1, 0);
  const auto map = map_scene(setup.scene, setup.recording);
  ASSERT_TRUE(map) << to_string(map.error());
  const auto& poses = map->problem.bundle.poses;
  EXPECT_LT(error_of(poses[map->problem.cameras[1]].value, setup.cameras[1]), 1e-5);
  ASSERT_EQ(map->scene.bodies[0].tags.size(), 10U);
  for (std::size_t t = 0; t < 10; ++t) {
    const auto id = static_cast<std::size_t>(map->scene.bodies[0].tags[t].id.number);
    ASSERT_TRUE(map->map_T_tag(0, t));
    EXPECT_LT(error_of(*map->map_T_tag(0, t), setup.tags[0][id]), 1e-5) << id;
  }
  for (std::size_t f = 0; f < setup.bodies[1].size(); ++f)
    EXPECT_LT(error_of(poses[map->problem.bodies[1][f]].value, setup.bodies[1][f]), 1e-5) << f;
}

TEST(SceneMap, EstimatesACubeAndTheSecondFixedCamera) {
  const RobotSetup setup = cube_setup(2, 0);
  const auto map = map_scene(setup.scene, setup.recording);
  ASSERT_TRUE(map) << to_string(map.error());
  const auto& poses = map->problem.bundle.poses;
  EXPECT_LT(error_of(poses[map->problem.cameras[1]].value, setup.cameras[1]), 1e-5);
  for (std::size_t t = 0; t < 4; ++t)
    EXPECT_LT(error_of(poses[map->problem.tags[1][t]].value, setup.tags[1][t]), 1e-5) << t;
}

TEST(SceneMap, CovarianceIsConsistent) {
  // NEES of the tags and of the unknown extrinsics over draws of the noise, with 6 degrees of freedom each.
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const RobotSetup setup = rig_setup(100 + seed, 0.3);
    const auto map = map_scene(setup.scene, setup.recording);
    ASSERT_TRUE(map);
    EXPECT_NEAR(map->noise_px, 0.3, 0.03) << seed;
    const auto add = [&](PoseIndex pose, const SE3& truth) {
      const Vector6 e = minus(truth, map->problem.bundle.poses[pose].value);
      sum += e.dot(map->covariance.poses[pose].llt().solve(e));
      ++count;
    };
    add(map->problem.cameras[1], setup.cameras[1]);
    for (std::size_t t = 1; t < 10; ++t)
      add(map->problem.tags[0][t],
          setup.tags[0][static_cast<std::size_t>(map->scene.bodies[0].tags[t].id.number)]);
  }
  // The errors in one draw are correlated through the anchor, so the bounds are wide for 120 * 6 squares.
  EXPECT_GT(sum / count, 4.0);
  EXPECT_LT(sum / count, 8.0);
}

/// The largest position error of any tag in the map frame, except the known one.
double worst_tag_m(const RobotSetup& setup, const SceneMap& map) {
  double worst = 0;
  for (std::size_t t = 0; t < map.scene.bodies[0].tags.size(); ++t) {
    const auto id = static_cast<std::size_t>(map.scene.bodies[0].tags[t].id.number);
    const auto map_T_tag = map.map_T_tag(0, t);
    if (map_T_tag)
      worst = std::max(worst, (map_T_tag->translation() - setup.tags[0][id].translation()).norm());
  }
  return worst;
}

TEST(SceneMap, WrongCameraParametersAreEstimatedConsistently) {
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 200; seed < 205; ++seed) {
    RobotSetup setup = rig_setup(seed, 0.1);
    std::vector<Eigen::VectorXd> truth;
    for (CameraOnBody& camera : setup.scene.cameras) {
      truth.push_back(intrinsics_of(camera.model));
      Eigen::VectorXd given = truth.back();
      given.head<2>() *= 1.008;
      given.segment<2>(2) += Eigen::Vector2d(3, -2);
      camera.model = with_intrinsics(camera.model, given).value();
    }
    const auto held = map_scene(setup.scene, setup.recording);
    const auto map = map_scene(setup.scene, setup.recording, {.free_intrinsics = true});
    ASSERT_TRUE(held && map) << seed;
    EXPECT_TRUE(held->intrinsics.empty());
    EXPECT_LT(worst_tag_m(setup, *map), worst_tag_m(setup, *held)) << seed;
    EXPECT_LT(map->reprojection_mean_px, held->reprojection_mean_px) << seed;
    ASSERT_EQ(map->intrinsics.size(), 2U);
    for (const FoundIntrinsics& lens : map->intrinsics) {
      EXPECT_EQ(intrinsics_of(map->scene.cameras[lens.camera].model), lens.found);
      for (Eigen::Index i = 0; i < lens.found.size(); ++i) {
        const double off = (lens.found[i] - truth[lens.camera][i]) / lens.sigma[i];
        EXPECT_LT(lens.sigma[i], lens.prior_sigma[i]);
        EXPECT_LT(std::abs(off), 4.5) << seed << " " << lens.names[static_cast<std::size_t>(i)];
        sum += off * off;
        ++count;
      }
    }
  }
  EXPECT_GT(sum / count, 0.4) << "80 squares, many of them correlated";
  EXPECT_LT(sum / count, 1.8);
}

TEST(SceneMap, AFocalLengthFarFromTheGivenOneIsReported) {
  RobotSetup setup = rig_setup(210, 0.1);
  Eigen::VectorXd given = intrinsics_of(setup.scene.cameras[0].model);
  given.head<2>() *= 1.05;
  setup.scene.cameras[0].model = with_intrinsics(setup.scene.cameras[0].model, given).value();
  const auto map = map_scene(setup.scene, setup.recording, {.free_intrinsics = true});
  ASSERT_TRUE(map);
  EXPECT_THAT(scene_warnings(*map), ::testing::Contains(::testing::HasSubstr("cam0: fx")));
}

TEST(SceneMap, TheTagslamModelRejectsFreeIntrinsics) {
  const RobotSetup setup = rig_setup(211, 0.1);
  EXPECT_FALSE(
      map_scene(setup.scene, setup.recording, {.model = SceneModel::Tagslam, .free_intrinsics = true}));
}

/// The setup in which everything in the map frame is transformed by the same motion.
RobotSetup moved(RobotSetup setup, const SE3& by) {
  const auto move = [&](ScenePrior& prior) { prior.mean = by * prior.mean; };
  for (SceneBody& body : setup.scene.bodies) {
    if (body.map_T_body) move(*body.map_T_body);
  }
  return setup;
}

TEST(SceneMap, AMovedFrameMovesTheMapAndNothingElse) {
  const RobotSetup setup = rig_setup(11, 0.2);
  const SE3 by = at(3, -2, 1, 0.4, -0.3, 1.1);
  const auto map = map_scene(setup.scene, setup.recording);
  const auto other = map_scene(moved(setup, by).scene, setup.recording);
  ASSERT_TRUE(map && other);
  EXPECT_NEAR(other->cost, map->cost, 1e-4 * map->cost);
  for (std::size_t t = 0; t < 10; ++t)
    EXPECT_LT(error_of(*other->map_T_tag(0, t), by * *map->map_T_tag(0, t)), 1e-5) << t;
}

TEST(SceneMap, TheOrderOfDetectionsDoesNotMatter) {
  const RobotSetup setup = rig_setup(12, 0.2);
  RobotSetup mixed = setup;
  Random random(13);
  for (SceneFrame& frame : mixed.recording.frames) {
    for (SceneView& view : frame.views) {
      for (std::size_t i = view.detections.size(); i > 1; --i)
        std::swap(view.detections[i - 1], view.detections[random.index(i)]);
    }
    std::ranges::reverse(frame.views);
  }
  const auto map = map_scene(setup.scene, setup.recording);
  const auto other = map_scene(mixed.scene, mixed.recording);
  ASSERT_TRUE(map && other);
  EXPECT_NEAR(other->cost, map->cost, 1e-5 * map->cost);
  std::map<TagId, SE3> tags;
  for (std::size_t t = 0; t < 10; ++t) tags[map->scene.bodies[0].tags[t].id] = *map->map_T_tag(0, t);
  for (std::size_t t = 0; t < 10; ++t)
    EXPECT_LT(error_of(*other->map_T_tag(0, t), tags.at(other->scene.bodies[0].tags[t].id)), 1e-5) << t;
}

TEST(SceneMap, ASceneOfTwiceTheSizeHasAMapOfTwiceTheSize) {
  const RobotSetup setup = rig_setup(14, 0.2);
  RobotSetup large = setup;
  const auto grow = [](SE3& pose) { pose = SE3(pose.rotation(), 2 * pose.translation()); };
  for (SceneBody& body : large.scene.bodies) {
    body.default_tag_size_m *= 2;
    if (body.map_T_body) grow(body.map_T_body->mean);
    for (SceneTag& tag : body.tags) {
      tag.size_m *= 2;
      if (tag.body_T_tag) grow(tag.body_T_tag->mean);
    }
  }
  for (CameraOnBody& camera : large.scene.cameras) {
    if (camera.body_T_cam) grow(camera.body_T_cam->mean);
  }
  const auto map = map_scene(setup.scene, setup.recording);
  const auto other = map_scene(large.scene, large.recording);
  ASSERT_TRUE(map && other);
  // Priors keep their sigma, so their relative weight changes.
  EXPECT_NEAR(other->cost, map->cost, 1e-2 * map->cost);
  for (std::size_t t = 0; t < 10; ++t) {
    SE3 expected = *map->map_T_tag(0, t);
    grow(expected);
    EXPECT_LT(error_of(*other->map_T_tag(0, t), expected), 1e-3) << t;
  }
}

TEST(SceneMap, NonFiniteCornersAreCountedAndSkipped) {
  RobotSetup setup = rig_setup(15, 0.2);
  for (std::size_t f = 0; f < 3; ++f)
    setup.recording.frames[f].views[0].detections.front().corners_px[f].x() = std::nan("");
  const auto map = map_scene(setup.scene, setup.recording);
  ASSERT_TRUE(map);
  EXPECT_EQ(map->observations.broken, 3);
  for (std::size_t t = 0; t < 10; ++t) EXPECT_TRUE(map->map_T_tag(0, t)->translation().allFinite());
}

TEST(SceneMap, ImpossibleQuadrilateralsDoNotMoveTheMap) {
  const RobotSetup setup = rig_setup(16, 0.1);
  RobotSetup torn = setup;
  Random random(17);
  for (std::size_t f = 0; f < torn.recording.frames.size(); f += 4) {
    for (Eigen::Vector2d& corner : torn.recording.frames[f].views[0].detections.back().corners_px)
      corner = {random.uniform(0, 640), random.uniform(0, 480)};
  }
  const auto clean = map_scene(setup.scene, setup.recording);
  const auto map = map_scene(torn.scene, torn.recording);
  ASSERT_TRUE(clean && map);
  EXPECT_GE(map->rejected.size(), clean->rejected.size() + 8);
  EXPECT_LT(worst_tag_m(torn, *map), worst_tag_m(setup, *clean) + 0.003);
}

TEST(SceneMap, ForeignAndWrongIdsDoNotChangeTheMap) {
  RobotSetup setup = cube_setup(3, 0.2);
  const auto clean = map_scene(setup.scene, setup.recording);
  Random random(4);
  for (SceneFrame& frame : setup.recording.frames) {
    TagDetection foreign = frame.views[0].detections.front();
    foreign.tag.number = 300 + static_cast<int>(random.uniform(0, 80));
    frame.views[0].detections.push_back(foreign);
  }
  // In one view, the corners of a tag on the cube are wrong.
  for (auto& corner : setup.recording.frames[7].views[0].detections.front().corners_px) corner.x() += 60;
  const auto map = map_scene(setup.scene, setup.recording);
  ASSERT_TRUE(clean && map);
  EXPECT_GT(map->observations.foreign.size(), 10U);
  ASSERT_EQ(map->rejected.size(), clean->rejected.size() + 1);
  for (std::size_t t = 0; t < 4; ++t)
    EXPECT_LT(error_of(map->problem.bundle.poses[map->problem.tags[1][t]].value, setup.tags[1][t]), 0.01);
}

TEST(SceneMap, UnconnectedTagsAreReportedAndNotMapped) {
  RobotSetup setup = rig_setup(5, 0.1);
  // Only the last frames show tags 8 and 9, and they show no other tags.
  for (std::size_t f = 0; f < setup.recording.frames.size(); ++f) {
    for (SceneView& view : setup.recording.frames[f].views) {
      std::erase_if(view.detections, [&](const TagDetection& d) { return (d.tag.number >= 8) != (f >= 30); });
    }
  }
  const auto map = map_scene(setup.scene, setup.recording);
  ASSERT_TRUE(map) << to_string(map.error());
  ASSERT_EQ(map->unconnected.size(), 1U);
  EXPECT_EQ(map->unconnected[0], (std::vector<TagId>{{FamilyId::Tag36h11, 8}, {FamilyId::Tag36h11, 9}}));
  for (std::size_t t = 0; t < map->scene.bodies[0].tags.size(); ++t)
    EXPECT_EQ(map->map_T_tag(0, t).has_value(), map->scene.bodies[0].tags[t].id.number < 8);
}

TEST(SceneMap, ASquashAppliesToTheFrameNearestToItsTime) {
  RobotSetup setup = rig_setup(9, 0.1);
  const auto all = observations_of(setup.recording, setup.scene).seen.size();
  const SceneFrame& frame = setup.recording.frames[20];
  const int id = frame.views[0].detections.front().tag.number;
  for (const auto& [off_ms, removed] : {std::pair{30, 1}, {-40, 1}, {0, 1}, {5000, 0}}) {
    setup.scene.squash = {
        {.stamp = frame.stamp + std::chrono::milliseconds(off_ms), .camera = "cam0", .ids = {id}}};
    EXPECT_EQ(observations_of(setup.recording, setup.scene).squashed, removed) << off_ms;
    EXPECT_EQ(observations_of(setup.recording, setup.scene).seen.size(),
              all - static_cast<std::size_t>(removed));
  }
}

TEST(SceneMap, FailsWithoutObservationsOrAStaticBody) {
  RobotSetup setup = rig_setup(6, 0.1);
  setup.recording.frames.clear();
  EXPECT_FALSE(map_scene(setup.scene, setup.recording));
  RobotSetup moving = cube_setup(7, 0.1);
  moving.scene.bodies[0].is_static = false;
  moving.scene.bodies[0].map_T_body.reset();
  EXPECT_FALSE(map_scene(moving.scene, moving.recording));
}

TEST(SceneMap, TheTagslamModelCostsNoMoreThanTheTruth) {
  RobotSetup setup = rig_setup(8, 0.5);
  for (CameraOnBody& camera : setup.scene.cameras) camera.wiggle_m = camera.wiggle_rad = 0.01;
  const auto map = map_scene(setup.scene, setup.recording, {.model = SceneModel::Tagslam});
  ASSERT_TRUE(map);
  SceneValues truth{.static_bodies = {{"wall", at(0, 0, 0)}}};
  for (std::size_t c = 0; c < 2; ++c) truth.cameras[setup.scene.cameras[c].name] = setup.cameras[c];
  for (std::size_t t = 0; t < 10; ++t) truth.tags[static_cast<int>(t)] = setup.tags[0][t];
  for (std::size_t f = 0; f < setup.bodies[1].size(); ++f)
    truth.moving_bodies[{"rig", setup.recording.frames[f].stamp.time_since_epoch().count()}] =
        setup.bodies[1][f];
  const auto cost = cost_at(truth, setup.scene, setup.recording);
  ASSERT_TRUE(cost);
  EXPECT_LT(map->cost, cost->cost);
  EXPECT_GT(map->cost, 0.2 * cost->cost);  // because the same problem was solved
}

}  // namespace
}  // namespace waymark
