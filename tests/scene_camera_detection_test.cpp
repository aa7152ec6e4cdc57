// Detections in images of SceneCamera compared with those in exact photographs of the same tags: the same
// tags, and corner errors of equal size.
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/simulation/render/photograph.hpp"
#include "waymark/simulation/render/scene_camera.hpp"
#include "waymark/tags/apriltag3/apriltag_detector.hpp"

namespace waymark {
namespace {

constexpr double kTagSizeM = 0.15;
constexpr double kReflectanceOfInk = 0.06;

CameraModel camera() {
  const PinholeRadtan lens{
      .fx = 600, .fy = 600, .cx = 320, .cy = 240, .k = {-0.15, 0.03, 0, 0}, .coefficients = 4};
  return CameraModel::make(lens, 640, 480).value();
}

/// Twelve tags of 24 to 80 px, tilted up to 60 degrees, at any roll.
std::vector<TagInScene> some_tags(Random& random) {
  std::vector<TagInScene> tags;
  for (int i = 0; i < 12; ++i) {
    const double depth = 600 * kTagSizeM / random.uniform(24, 80);
    const double about = random.uniform(0, 2 * std::numbers::pi);
    const double tilt = random.uniform(0, 60) * std::numbers::pi / 180;
    const SO3 turn = SO3::exp({tilt * std::cos(about), tilt * std::sin(about), 0}) *
                     SO3::exp({0, 0, random.uniform(0, 2 * std::numbers::pi)});
    const Eigen::Vector3d ray((i % 4 - 1.5) * 0.25, (i / 4 - 1) * 0.25, 1);
    tags.push_back({{FamilyId::Tag36h11, i}, SE3(turn, ray * depth), kTagSizeM});
  }
  return tags;
}

/// Errors of corners against the truth of the same geometry.
struct Corners {
  int tags = 0;
  double squares = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();

  void add(const Detector& detector, const Image& image, const CameraModel& model,
           const std::vector<TagInScene>& scene) {
    const std::vector<TagDetection> detections = detector.detect(image).value();
    for (const TagDetection& seen : detections) {
      if (seen.tag.number >= static_cast<int>(scene.size())) continue;
      const TagInScene& tag = scene[static_cast<std::size_t>(seen.tag.number)];
      const double h = tag.size_m / 2;
      const double signs[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
      for (std::size_t i = 0; i < 4; ++i) {
        const Eigen::Vector3d corner(signs[i][0] * h, signs[i][1] * h, 0);
        const Eigen::Vector2d error = seen.corners_px[i] - model.project(tag.cam_T_tag * corner).value();
        squares += error.squaredNorm() / 8;
        sum += error / 4;
      }
      ++tags;
    }
  }
  [[nodiscard]] double rmse_px() const { return std::sqrt(squares / tags); }
  [[nodiscard]] Eigen::Vector2d bias_px() const { return sum / tags; }
};

Scene scene_of_tags(const std::vector<TagInScene>& tags, double sky_reflectance) {
  Scene scene{.surfaces = {}, .sky_reflectance = sky_reflectance};
  for (const TagInScene& tag : tags)
    scene.surfaces.push_back(tag_surface(tag.tag, tag.cam_T_tag, tag.size_m));
  return scene;
}

TEST(SceneCameraImages, AreEquivalentToExactPhotographsForADetector) {
  const CameraModel model = camera();
  const double white = 200;
  PhotographOptions photo{.blur_sigma_px = 0.6,
                          .black_level_dn = white * kReflectanceOfInk,
                          .white_level_dn = white,
                          .read_noise_dn = 0.5,
                          .shot_noise_dn = 255.0 / 12000,
                          .background = "flat",
                          .background_level_dn = 90,
                          .illumination_gradient = 0};
  const SceneCameraOptions scene_options{.exposure_ms = 0,
                                         .lens_sigma_px = 0.6,
                                         .white_level_dn = white,
                                         .full_well_electrons = 12000,
                                         .read_noise_electrons = 0.5 * 12000 / 255,
                                         .ambient = 1};
  auto takes = SceneCamera::make({}, model, scene_options).value();
  const auto detector = make_apriltag_detector({}).value();
  Random random(11);
  Corners of_photographs;
  Corners of_scenes;
  constexpr int kImages = 15;
  for (int i = 0; i < kImages; ++i) {
    const std::vector<TagInScene> tags = some_tags(random);
    ASSERT_TRUE(takes.set_scene(scene_of_tags(tags, 90 / white)));
    const auto seed = static_cast<std::uint64_t>(i);
    const Image rendered = takes.render([](double) { return SE3(); }, SensorTime(), seed).value().image;
    of_scenes.add(*detector, rendered, model, tags);
    of_photographs.add(
        *detector, photograph(model, {.tags = tags, .sheets = {}}, photo, random).value().image, model, tags);
  }
  std::printf(
      "photographs: %d tags, RMSE %.4f px, bias %.4f %.4f; scene camera: %d tags, RMSE %.4f px, bias %.4f "
      "%.4f\n",
      of_photographs.tags, of_photographs.rmse_px(), of_photographs.bias_px().x(),
      of_photographs.bias_px().y(), of_scenes.tags, of_scenes.rmse_px(), of_scenes.bias_px().x(),
      of_scenes.bias_px().y());
  EXPECT_GT(of_scenes.tags, 0.9 * 12 * kImages);
  EXPECT_NEAR(of_scenes.tags, of_photographs.tags, 0.03 * 12 * kImages);
  EXPECT_NEAR(of_scenes.rmse_px() / of_photographs.rmse_px(), 1, 0.1);
  EXPECT_LT((of_scenes.bias_px() - of_photographs.bias_px()).norm(), 0.01);
}

}  // namespace
}  // namespace waymark
