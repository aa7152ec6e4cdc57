#include "waymark/simulation/render/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/simulation/render/scene_exposure.hpp"

/// Tests occlusion, ground truth, and that images are reproducible across threads.
namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

constexpr int kWidth = 320;
constexpr int kHeight = 240;

CameraModel pinhole() {
  return CameraModel::make(PinholeRadtan{.fx = 300, .fy = 300, .cx = 160, .cy = 120}, kWidth, kHeight)
      .value();
}

SceneCameraOptions bare() {
  return {
      .exposure_ms = 0, .lens_sigma_px = 0, .white_level_dn = 200, .full_well_electrons = 0, .ambient = 1};
}

const CameraMotion kStill = [](double) { return SE3(); };

RenderedFrame take(const Scene& scene, const SceneCameraOptions& options = bare(),
                   const CameraMotion& motion = kStill, const CameraModel& model = pinhole()) {
  return SceneCamera::make(scene, model, options).value().render(motion, SensorTime(), 1).value();
}

SceneSurface panel(double x, double y, double z, double size_m, double reflectance) {
  return plain_surface({SO3(), {x, y, z}}, size_m, size_m, {.reflectance = reflectance});
}

TEST(Scene, NearerSurfacesHideFartherOnesInAnyOrder) {
  const SceneSurface far = panel(0, 0, 3, 3, 0.2);
  const SceneSurface near = panel(0, 0, 1, 0.2, 0.9);
  for (const auto& surfaces : {std::vector{far, near}, std::vector{near, far}}) {
    const Image image = take({.surfaces = surfaces}).image;
    EXPECT_EQ(image.row(120)[160], 180);
    EXPECT_EQ(image.row(120)[100], 40);
  }
}

/// A long wall to the side of the camera, whose centre is nearer than the tag at its far end.
TEST(Scene, ATagOnAWallIsDrawnOverIt) {
  const SE3 on_wall(SO3::from_rpy(0, std::numbers::pi / 2, 0), {0.8, 0, 1.5});  // on the right, facing left
  const SceneSurface wall = plain_surface(on_wall, 6, 2, {.reflectance = 0.3});
  const SE3 along = SE3(SO3(), {-1.0, 0, 0});  // moves forward along the wall
  const SceneSurface poster = plain_surface(on_wall * along, 0.4, 0.4, {.reflectance = 1.0});
  const Vector2d px = pinhole().project((on_wall * along).translation()).value();
  const Image image = take({.surfaces = {wall, poster}, .sky_reflectance = 0}).image;
  EXPECT_EQ(image.row(static_cast<int>(px.y()))[static_cast<int>(px.x())], 200);
}

TEST(Scene, TagsAreInFrontOfWallsAndBehindFurniture) {
  World world;
  world.tags.tags[{FamilyId::Tag36h11, 1}] = {.map_T_tag = upright_tag({2.0, 0.5, 0.5}, std::numbers::pi),
                                              .size_m = 0.2};
  world.tags.tags[{FamilyId::Tag36h11, 2}] = {.map_T_tag = upright_tag({2.0, -0.5, 0.5}, std::numbers::pi),
                                              .size_m = 0.2};
  world.walls.push_back({.from_m = {2.05, -2}, .to_m = {2.05, 2}});  // tags hang on its face
  world.occluders.push_back({.centre_m = {1, -0.25, 0.5}, .size_m = {0.1, 0.3, 1.0}});
  const SE3 map_T_cam(SO3::from_matrix((Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished()),
                      {0, 0, 0.5});
  const RenderedFrame frame = take(scene_of(world), bare(), [&](double) { return map_T_cam; });
  ASSERT_EQ(frame.tags.size(), 1U);  // the other tag is behind the furniture
  EXPECT_EQ(frame.tags[0].tag.number, 1);
  EXPECT_EQ(frame.tags[0].visible_fraction, 1);
  const auto centre =
      pinhole().project(frame.tags[0].cam_T_tag * Vector3d(0.115, 0, 0)).value();  // in the white margin
  EXPECT_NEAR(frame.image.row(static_cast<int>(centre.y()))[static_cast<int>(centre.x())], 200, 1);
}

TEST(Scene, TruthOfCornersVisibilityAndBlur) {
  const TagId tag{FamilyId::Tag36h11, 3};
  const SE3 pose(SO3::from_rpy(0.2, 0.3, 0.1), {0.1, 0.02, 1});
  const SceneSurface cover = plain_surface({SO3(), {0.1 + 0.25, 0, 0.9}}, 0.5, 1, {.reflectance = 0.1});
  SceneCameraOptions options = bare();
  options.exposure_ms = 10;
  const double rate = 0.8;
  const CameraMotion motion = [&](double t) { return SE3(SO3::exp({0, rate * t, 0}), Vector3d::Zero()); };
  const RenderedFrame frame = take({.surfaces = {tag_surface(tag, pose, 0.2), cover}}, options, motion);
  ASSERT_EQ(frame.tags.size(), 1U);
  const SceneTagTruth& truth = frame.tags[0];
  const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d p =
        pose.rotation().matrix() * Vector3d(0.1 * signs[i][0], 0.1 * signs[i][1], 0) + pose.translation();
    EXPECT_NEAR(truth.corners_px[i].x(), 300 * p.x() / p.z() + 160, 1e-9);
    EXPECT_NEAR(truth.corners_px[i].y(), 300 * p.y() / p.z() + 120, 1e-9);
    EXPECT_EQ(truth.corner_visible[i], signs[i][0] < 0);  // the edge of the cover crosses the middle
  }
  EXPECT_NEAR(truth.visible_fraction, 0.55, 0.1);
  EXPECT_NEAR(truth.blur_px, 300 * rate * 0.010 * (1 + 0.1 * 0.1), 0.03);
}

TEST(Scene, RollingShutterMovesTheTruthLikeTheImage) {
  const TagId tag{FamilyId::Tag36h11, 3};
  SceneCameraOptions options = bare();
  options.readout_ms = 30;
  const double rate = 1.0;
  const CameraMotion motion = [&](double t) { return SE3(SO3::exp({0, rate * t, 0}), Vector3d::Zero()); };
  const SE3 pose(SO3(), {0, 0.25, 1});
  const RenderedFrame frame = take({.surfaces = {tag_surface(tag, pose, 0.2)}}, options, motion);
  ASSERT_EQ(frame.tags.size(), 1U);
  const Vector2d& corner = frame.tags[0].corners_px[0];
  const double row_time = ((std::floor(corner.y()) + 0.5) / kHeight - 0.5) * 0.030;
  const Vector2d expected =
      pinhole().project(motion(row_time).inverse() * (pose * Vector3d(-0.1, -0.1, 0))).value();
  EXPECT_LT((corner - expected).norm(), 1e-6);
  EXPECT_GT(std::abs(corner.x() - 130), 1.5);  // the corner has moved
  // The margin to the left of the corner is white, and the border to its right is black.
  const auto* row = frame.image.row(static_cast<int>(corner.y()) + 2);
  EXPECT_GT(row[static_cast<int>(corner.x()) - 2], 180);
  EXPECT_LT(row[static_cast<int>(corner.x()) + 2], 40);
}

/// A LIMO's camera among tags, walls and furniture, with all effects enabled.
struct Busy {
  World world;
  SceneCameraOptions options{.exposure_ms = 8,
                             .readout_ms = 12,
                             .aperture_mm = 2,
                             .vignetting_power = 2,
                             .gamma = 1.8,
                             .flicker = 0.1,
                             .drift = 0.1};
  CameraMotion motion = [](double t) {
    const Eigen::Matrix3d forward = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
    return SE3(SO3::from_rpy(0, 0, 0.8 * t) * SO3::from_matrix(forward), {0.4 * t, 0, 0.3});
  };
  Busy() {
    for (int i = 0; i < 6; ++i) {
      world.tags.tags[{FamilyId::Tag36h11, i}] = {
          .map_T_tag = upright_tag({1.0 + 0.3 * i, 0.4 - 0.2 * i, 0.3}, std::numbers::pi + 0.1 * i),
          .size_m = 0.16};
    }
    world.occluders.push_back({.centre_m = {1.5, 0.3, 0.2}, .size_m = {0.2, 0.2, 0.4}});
    world.walls.push_back({.from_m = {4, -3}, .to_m = {4, 3}});
    world.floor.texture = "tiles";
  }
};

TEST(Scene, TheSameSeedGivesTheSameBytesAndAnotherSeedDoesNot) {
  const Busy busy;
  const auto camera = SceneCamera::make(scene_of(busy.world), pinhole(), busy.options).value();
  const auto one = camera.render(busy.motion, SensorTime(), 5).value();
  EXPECT_EQ(one.image, camera.render(busy.motion, SensorTime(), 5).value().image);
  EXPECT_NE(one.image, camera.render(busy.motion, SensorTime(), 6).value().image);
  EXPECT_FALSE(one.tags.empty());
}

TEST(Scene, ThreadsGiveTheSameBytes) {
  const Busy busy;
  const auto camera = SceneCamera::make(scene_of(busy.world), pinhole(), busy.options).value();
  const Image alone = camera.render(busy.motion, SensorTime(), 5).value().image;
  const auto exposure = camera.begin(busy.motion, SensorTime(), 5).value();
  const auto side_by_side = [&](auto&& work) {
    std::vector<std::thread> threads;
    for (int first = 0; first < 4; ++first) {
      threads.emplace_back([&, first] {
        for (int band = camera.bands() - 1 - first; band >= 0; band -= 4) work(band);
      });
    }
    for (std::thread& thread : threads) thread.join();
  };
  side_by_side([&](int band) { camera.expose(*exposure, band); });
  side_by_side([&](int band) { camera.read_out(*exposure, band); });
  EXPECT_EQ(alone, camera.finish(*exposure).image);
}

TEST(Scene, WithoutMotionTheExposureDoesNotMatter) {
  const Busy busy;
  SceneCameraOptions still = bare();
  SceneCameraOptions exposed = bare();
  exposed.exposure_ms = 30;
  exposed.readout_ms = 20;
  const CameraMotion stationary = [&](double) { return busy.motion(0); };
  EXPECT_EQ(take(scene_of(busy.world), still, stationary).image,
            take(scene_of(busy.world), exposed, stationary).image);
}

/// A 190 degree fisheye facing up from the floor sees walls below its horizon and nothing outside its image
/// circle.
TEST(Scene, AFisheyeSeesAllAroundAndNothingOutsideItsCircle) {
  const auto model =
      CameraModel::make(Equidistant{.fx = 70, .fy = 70, .cx = 160, .cy = 120}, kWidth, kHeight).value();
  const Busy busy;
  const SE3 map_T_cam(SO3::exp({0.1, 0.2, 0}), {0, 0, 0.4});
  const Image image = take(
                          scene_of(busy.world), bare(), [&](double) { return map_T_cam; }, model)
                          .image;
  int dark = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double angle = std::hypot(x + 0.5 - 160, y + 0.5 - 120) / 70;
      if (angle < 2.5 && image.row(y)[x] < 5) ++dark;  // everything in the room is brighter than ink
      if (angle > std::numbers::pi + 0.03) {
        EXPECT_EQ(image.row(y)[x], 0);
      }
    }
  }
  EXPECT_LT(dark, 100);
}

TEST(Scene, GlareIsBrightestAtTheReflectionOfTheLamp) {
  Scene scene{.surfaces = {panel(0, 0, 1, 1, 0.3)}, .map_t_lamp = {0.2, 0, 0}, .sky_reflectance = 0};
  const Image matt = take(scene).image;
  scene.surfaces[0].finish.gloss = 0.5;
  const Image glossy = take(scene).image;
  // The reflection is halfway between the points below the camera and below the lamp: 0.1 m to the right at 1
  // m.
  int brightest = 0;
  for (int x = 0; x < kWidth; ++x) {
    if (glossy.row(120)[x] > glossy.row(120)[brightest]) brightest = x;
  }
  EXPECT_NEAR(brightest, 160 + 30, 3);
  EXPECT_GT(glossy.row(120)[brightest], matt.row(120)[brightest] + 90);
  EXPECT_NEAR(glossy.row(120)[40], matt.row(120)[40], 1);
}

/// Inside walls and boxes, under the floor, in the plane of a tag, or just in front of one, all radiances
/// must be valid.
TEST(Scene, AnyPoseAndLensGivesValidRadiance) {
  const Busy busy;
  const Equidistant all_around{.fx = 30, .fy = 30, .cx = 80, .cy = 60};
  const PinholeRadtan narrow{.fx = 200, .fy = 200, .cx = 80, .cy = 60};
  Random random(5);
  for (const CameraModel& model :
       {CameraModel::make(all_around, 163, 119).value(), CameraModel::make(narrow, 163, 119).value()}) {
    SceneCameraOptions options = busy.options;
    options.aperture_mm = 0;
    options.blur_step_px = 2;
    const auto camera = SceneCamera::make(scene_of(busy.world), model, options).value();
    for (int i = 0; i < 15; ++i) {
      const SO3 turn =
          SO3::exp(Vector3d(random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-3, 3)));
      const auto& on_tag = busy.world.tags.tags.at({FamilyId::Tag36h11, i % 6}).map_T_tag;
      const Vector3d anywhere(random.uniform(-1, 5), random.uniform(-3, 3), random.uniform(-0.2, 2));
      const Vector3d at_tag = on_tag * Vector3d(0, 0, i % 2 == 0 ? 0 : -1e-4);
      const SE3 start(turn, i < 6 ? at_tag : anywhere);
      const double fast = i % 5 == 0 ? 5 : 0.3;
      const CameraMotion motion = [&](double t) {
        return start * SE3(SO3::exp({fast * t, 0, 0}), {0, 0, t});
      };
      const auto exposure = camera.begin(motion, SensorTime(), 1).value();
      for (int band = 0; band < camera.bands(); ++band) camera.expose(*exposure, band);
      EXPECT_TRUE(std::all_of(exposure->radiance.begin(), exposure->radiance.end(),
                              [](float radiance) { return radiance >= -0.001F && radiance < 10; }));
    }
  }
}

TEST(Scene, InvalidInputIsRejected) {
  const auto expect_error = [](const Scene& scene, const char* key, const SceneCameraOptions& options = {}) {
    const auto camera = SceneCamera::make(scene, pinhole(), options);
    ASSERT_FALSE(camera) << key;
    EXPECT_EQ(camera.error().code, ErrorCode::InvalidArgument) << key;
    EXPECT_EQ(camera.error().place.key, key);
    testing::expect_on_page("simulation", camera.error());
  };
  const TagId tag{FamilyId::Tag36h11, 1};
  EXPECT_TRUE(SceneCamera::make({.surfaces = {tag_surface(tag, SE3(), 0.1)}}, pinhole(), {}));
  expect_error({.surfaces = {panel(0, 0, 1, -1, 0.5)}}, "surfaces[0]");
  expect_error({.surfaces = {panel(0, 0, std::nan(""), 1, 0.5)}}, "surfaces[0]");
  expect_error({.surfaces = {panel(0, 0, 1, 1, std::nan(""))}}, "surfaces[0]");
  expect_error({.surfaces = {panel(0, 0, 1, 1, 1), tag_surface(tag, SE3(), 0)}}, "surfaces[1]");
  SceneSurface large = tag_surface(tag, SE3(), 0.1);
  large.tag_size_m = 0.2;
  expect_error({.surfaces = {large}}, "surfaces[0]");
  large.tag->number = 587;
  expect_error({.surfaces = {large}}, "surfaces[0]");
  expect_error({}, "gamma", {.gamma = 0});
  expect_error({}, "exposure_ms", {.exposure_ms = std::nan("")});
  const auto camera = SceneCamera::make({}, pinhole(), {}).value();
  const CameraMotion wild = [](double t) { return SE3(SO3(), {t < 0 ? std::nan("") : 0, 0, 0}); };
  EXPECT_FALSE(camera.render(wild, SensorTime(), 1));
}

}  // namespace
}  // namespace waymark
