// Refined corners in simulated photographs, with other blurs, noises, contrasts and lenses than in the
// calibration.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numbers>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/corner_table.hpp"
#include "waymark/simulation/render/photograph.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"

namespace waymark {
namespace {

using testing::CornerLine;

struct Condition {
  std::string name;
  PhotographOptions camera = {};
  double smallest_px = 16;
  double largest_px = 90;
  double k1 = 0;
};

CameraModel camera_of(const Condition& condition) {
  PinholeRadtan lens{.fx = 900, .fy = 900, .cx = 640, .cy = 360};
  lens.k[0] = condition.k1;
  lens.coefficients = condition.k1 == 0 ? 0 : 4;
  return CameraModel::make(lens, 1280, 720).value();
}

/// Tags on a grid of 8 x 4, with log-uniform sizes, tilted up to 65 degrees, at any roll.
PhotographScene scene_of(const Condition& condition, const CameraModel& camera, Random& random) {
  PhotographScene scene;
  for (int i = 0; i < 32; ++i) {
    const Eigen::Vector2d px(80 + 160 * (i % 8) + random.uniform(-8, 8),
                             90 + 180 * (i / 8) + random.uniform(-8, 8));
    const double size_px =
        condition.smallest_px * std::pow(condition.largest_px / condition.smallest_px, random.uniform());
    const auto ray = camera.normalize(px).value();
    const double depth = 900 * 0.15 / size_px;
    const double about = random.uniform(0, 2 * std::numbers::pi);
    const double tilt = random.uniform(0, 65 * std::numbers::pi / 180);
    const SO3 turn = SO3::exp({tilt * std::cos(about), tilt * std::sin(about), 0}) *
                     SO3::exp({0, 0, random.uniform(0, 2 * std::numbers::pi)});
    scene.tags.push_back({{FamilyId::Tag36h11, static_cast<int>(random.index(587))},
                          SE3(turn, Eigen::Vector3d(ray.x(), ray.y(), 1.0) * depth),
                          0.15});
  }
  return scene;
}

struct Outcome {
  CornerLine line;
  int tags = 0;
};

/// Starts from corners with errors of 0.12 px per coordinate, typical of a detector.
Outcome measure(const Condition& condition, const RefinementOptions& options, bool use_camera) {
  const CameraModel camera = camera_of(condition);
  Random random(42);
  Outcome outcome;
  const int images = std::getenv("WAYMARK_FULL") != nullptr ? 12 : 2;
  for (int i = 0; i < images; ++i) {
    const auto photo = photograph(camera, scene_of(condition, camera, random), condition.camera, random);
    EXPECT_TRUE(photo) << to_string(photo.error());
    for (const TagTruth& tag : photo->tags) {
      if (tag.visible_fraction < 1) continue;
      TagDetection detection;
      detection.tag = tag.tag;
      detection.corners_px = tag.corners_px;
      for (auto& corner : detection.corners_px)
        corner += 0.12 * Eigen::Vector2d(random.normal(), random.normal());
      const auto result = refine_corners(photo->image, detection, options, use_camera ? &camera : nullptr);
      ++outcome.tags;
      if (!result.refined()) continue;
      outcome.line.add(tag.corners_px, detection.corners_px, result.corners_px, result.covariance_px2);
    }
  }
  outcome.line.print(condition.name);
  return outcome;
}

PhotographOptions blurred(double sigma_px) {
  PhotographOptions options;
  options.blur_sigma_px = sigma_px;
  return options;
}

PhotographOptions noisy(double read_dn, double shot_dn) {
  PhotographOptions options;
  options.read_noise_dn = read_dn;
  options.shot_noise_dn = shot_dn;
  return options;
}

PhotographOptions lit(double black, double white, double gradient) {
  PhotographOptions options;
  options.black_level_dn = black;
  options.white_level_dn = white;
  options.illumination_gradient = gradient;
  return options;
}

RefinementOptions straight() {
  RefinementOptions options;
  options.curvature_per_px = 0;
  return options;
}

TEST(RefinementOnPhotographs, IsConsistentUnderBlurNoiseAndIllumination) {
  const std::array<Condition, 9> conditions = {
      Condition{"blur 0.3 px", blurred(0.3)},         Condition{"blur 0.6 px", blurred(0.6)},
      Condition{"blur 1.0 px", blurred(1.0), 24},     Condition{"blur 1.5 px", blurred(1.5), 36},
      Condition{"noise 4 DN", noisy(4, 0)},           Condition{"noise 10 DN", noisy(10, 0), 24},
      Condition{"shot noise", noisy(1, 0.2)},         Condition{"contrast 40 DN", lit(90, 130, 0.2), 20},
      Condition{"slanting light", lit(40, 150, 1.0)},
  };
  CornerLine::print_header();
  for (const Condition& condition : conditions) {
    const Outcome outcome = measure(condition, straight(), false);
    EXPECT_GT(outcome.line.tags(), 0.9 * outcome.tags) << condition.name;
    // 60 tags: the mean has a standard deviation of 6 %. The allowance for other blurs is not needed here,
    // and among blurred cells the illumination is not observable, so its uncertainty remains.
    EXPECT_GT(outcome.line.nees_tag(), 0.6) << condition.name;
    EXPECT_LT(outcome.line.nees_tag(), 1.2) << condition.name;
    EXPECT_LT(outcome.line.rmse_px(), outcome.line.rmse_before_px()) << condition.name;
    EXPECT_LT(outcome.line.bias_px().cwiseAbs().maxCoeff(), 0.01) << condition.name;
  }
}

TEST(RefinementOnPhotographs, UsesAKnownLensAndToleratesAnUnknownOne) {
  CornerLine::print_header();
  Condition condition{"k1 -0.25, known", blurred(0.6), 16, 110, -0.25};
  const Outcome known = measure(condition, {}, true);
  condition.smallest_px = 24;  // edges of smaller tags are not curved
  condition.name = "k1 -0.25, bend";
  const Outcome unknown = measure(condition, {}, false);
  condition.name = "k1 -0.25, ignored";
  const Outcome ignored = measure(condition, straight(), false);
  EXPECT_LT(known.line.nees_tag(), 1.2);
  EXPECT_GT(known.line.nees_tag(), 0.7);
  EXPECT_LT(known.line.rmse_px(), 0.5 * known.line.rmse_before_px());
  EXPECT_LT(unknown.line.rmse_px(),
            ignored.line.rmse_px());  // many of the latter are followed as bent sheets
  EXPECT_LT(unknown.line.nees_tag(), 1.2);
  EXPECT_GT(unknown.line.nees_tag(), 0.7);
}

}  // namespace
}  // namespace waymark
