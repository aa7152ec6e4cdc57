#include "waymark/simulation/scene_light.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::photo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const CameraModel kStraight =
    CameraModel::make(PinholeRadtan{.fx = 300, .fy = 310, .cx = 101, .cy = 79}, 200, 160).value();
const CameraModel kBent =
    CameraModel::make(
        PinholeRadtan{
            .fx = 150, .fy = 152, .cx = 101, .cy = 79, .k = {-0.2, 0.03, 0.002, -0.001}, .coefficients = 4},
        200, 160)
        .value();
const CameraModel kFisheye =
    CameraModel::make(Equidistant{.fx = 80, .fy = 80, .cx = 100, .cy = 80, .k = {0.02, -0.005, 0, 0}}, 200,
                      160)
        .value();

/// A square of ink with a side of 1 m, no paper.
PlanarPattern square(const SE3& cam_T_plane, std::uint8_t level = 0) {
  return {.x_lines_m = {-0.5, 0.5},
          .y_lines_m = {-0.5, 0.5},
          .levels = Image(1, 1, level),
          .cam_T_plane = cam_T_plane};
}

PlanarPattern checkerboard(int cells, const SE3& cam_T_plane) {
  PlanarPattern pattern{
      .x_lines_m = {}, .y_lines_m = {}, .levels = Image(cells, cells), .cam_T_plane = cam_T_plane};
  for (int i = 0; i <= cells; ++i) pattern.x_lines_m.push_back((i - cells / 2.0) / cells);
  pattern.y_lines_m = pattern.x_lines_m;
  for (int y = 0; y < cells; ++y) {
    for (int x = 0; x < cells; ++x) pattern.levels.row(y)[x] = (x + y) % 2 == 0 ? 255 : 30;
  }
  return pattern;
}

SE3 random_view(Random& random, double max_tilt = 1.1) {
  const double x = random.uniform(-0.3, 0.3);
  const double y = random.uniform(-0.3, 0.3);
  const Vector3d place(x, y, random.uniform(2.2, 4));
  const double yaw = random.uniform(-3, 3);
  const double pitch = random.uniform(-max_tilt, max_tilt);
  return {SO3::from_rpy(random.uniform(-max_tilt, max_tilt), pitch, yaw), place};
}

SceneLight light_of(const CameraModel& camera, const std::vector<PlanarPattern>& patterns, double sigma_px) {
  std::vector<ProjectedPattern> projected;
  for (const PlanarPattern& pattern : patterns) projected.push_back(project_pattern(camera, pattern));
  return gather_light(projected, camera.width_px(), camera.height_px(), point_spread(sigma_px));
}

/// Area and centroid of a polygon.
std::pair<double, Vector2d> moments(const std::vector<Vector2d>& polygon) {
  double area = 0;
  Vector2d sum = Vector2d::Zero();
  const Vector2d origin = polygon.front();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d a = polygon[i] - origin;
    const Vector2d b = polygon[(i + 1) % polygon.size()] - origin;
    const double cross = a.x() * b.y() - a.y() * b.x();
    area += cross / 2;
    sum += cross / 6 * (a + b);
  }
  return {area, origin + sum / area};
}

/// The outline of the 1 m square in the picture, through many points of each side.
std::vector<Vector2d> fine_outline(const CameraModel& camera, const SE3& cam_T_plane) {
  constexpr int kPoints = 2000;
  const auto corners = tag_corners(1);
  std::vector<Vector2d> outline;
  for (std::size_t i = 0; i < 4; ++i) {
    for (int k = 0; k < kPoints; ++k) {
      const Vector3d p =
          corners[i] + (corners[(i + 1) % 4] - corners[i]) * (static_cast<double>(k) / kPoints);
      outline.push_back(camera.project(cam_T_plane * p).value());
    }
  }
  return outline;
}

/// A view of the square that leaves room for the lens around it.
SE3 wholly_visible_view(const CameraModel& camera, Random& random) {
  constexpr double kRoomPx = 12;
  while (true) {
    const SE3 cam_T_plane = random_view(random);
    const auto outline = fine_outline(camera, cam_T_plane);
    const bool inside = std::all_of(outline.begin(), outline.end(), [&](const Vector2d& p) {
      return camera.contains(p - Vector2d(kRoomPx, kRoomPx)) &&
             camera.contains(p + Vector2d(kRoomPx, kRoomPx));
    });
    if (inside) return cam_T_plane;
  }
}

TEST(SceneLight, AreaAndCentroidOfASquareAreExact) {
  Random random(1);
  for (const CameraModel* camera : {&kStraight, &kBent, &kFisheye}) {
    for (const double sigma : {0.0, 0.6, 1.0, 1.7}) {
      for (int i = 0; i < 4; ++i) {
        const SE3 cam_T_plane = wholly_visible_view(*camera, random);
        const auto [area, centroid] = moments(fine_outline(*camera, cam_T_plane));
        const SceneLight light = light_of(*camera, {square(cam_T_plane)}, sigma);
        double sum = 0;
        Vector2d first = Vector2d::Zero();
        for (int y = 0; y < light.height; ++y) {
          for (int x = 0; x < light.width; ++x) {
            const double covered = static_cast<double>(light.covered[light.index(x, y)]);
            sum += covered;
            first += covered * Vector2d(x + 0.5, y + 0.5);
          }
        }
        // Perimeter times 1e-4 px is what the chords may lose.
        EXPECT_NEAR(sum, area, 1e-4 * 4 * std::sqrt(area) + 1e-3);
        // Pixels are samples: their centroid is that of the scene where the lens leaves nothing to alias.
        if (sigma >= 1) {
          EXPECT_NEAR((first / sum - centroid).norm(), 0, 1e-4);
        }
      }
    }
  }
}

/// The oracle: rays through n x n points of a pixel, met with the plane one by one.
double by_rays(const CameraModel& camera, const PlanarPattern& pattern, int x, int y, int n) {
  const SE3 plane_T_cam = pattern.cam_T_plane.inverse();
  const auto cell = [](const std::vector<double>& lines, double at) {
    return static_cast<int>(std::upper_bound(lines.begin(), lines.end(), at) - lines.begin()) - 1;
  };
  double sum = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const auto ray = camera.unproject({x + (i + 0.5) / n, y + (j + 0.5) / n});
      if (!ray) continue;
      const Vector3d eye = plane_T_cam.translation();
      const Vector3d along = plane_T_cam.rotation() * *ray;
      const double reach = -eye.z() / along.z();
      const Vector3d hit = eye + reach * along;
      const int column = cell(pattern.x_lines_m, hit.x());
      const int row = cell(pattern.y_lines_m, hit.y());
      const bool inside = reach > 0 && column >= 0 && row >= 0 && column < pattern.levels.width() &&
                          row < pattern.levels.height();
      if (inside) sum += pattern.levels.row(row)[column];
    }
  }
  return sum / (n * n);
}

TEST(SceneLight, AgreesWithRaysThroughThePixel) {
  Random random(2);
  for (const CameraModel* camera : {&kStraight, &kBent, &kFisheye}) {
    const PlanarPattern pattern = checkerboard(7, random_view(random));
    const SceneLight light = light_of(*camera, {pattern}, 0);
    double largest = 0;
    double mean = 0;
    constexpr int kPixels = 300;
    for (int i = 0; i < kPixels; ++i) {
      const int x = static_cast<int>(60 + random.index(80));
      const int y = static_cast<int>(40 + random.index(80));
      const double difference =
          static_cast<double>(light.level[light.index(x, y)]) - by_rays(*camera, pattern, x, y, 48);
      largest = std::max(largest, std::abs(difference));
      mean += difference / kPixels;
    }
    // 48 x 48 points resolve an edge to about 1/48 px at worst, 225 levels high; on average far better.
    EXPECT_LT(largest, 225.0 / 48);
    EXPECT_NEAR(mean, 0, 0.05);
  }
}

TEST(SceneLight, NearerPaperHidesWhatLiesBehind) {
  const SE3 far(SO3(), {0, 0, 3});
  const SE3 near(SO3(), {0.1, 0, 2});
  const SceneLight both = light_of(kStraight, {square(far, 200), square(near, 50)}, 0.6);
  const SceneLight alone = light_of(kStraight, {square(near, 50)}, 0.6);
  const Vector2d middle = kStraight.project(near.translation()).value();
  const std::size_t in_near = both.index(static_cast<int>(middle.x()), static_cast<int>(middle.y()));
  EXPECT_NEAR(both.level[in_near], 50, 1e-4);
  EXPECT_EQ(both.level[in_near], alone.level[in_near]);
}

TEST(SceneLight, BehindTheCameraThereIsNothing) {
  const SceneLight light = light_of(kStraight, {square(SE3(SO3(), {0, 0, -2}))}, 0.6);
  EXPECT_EQ(*std::max_element(light.covered.begin(), light.covered.end()), 0.0F);
}

TEST(SceneLight, AFloorThatReachesBehindTheCameraFillsThePictureBelowTheHorizon) {
  // 40 m x 40 m, 1 m below the camera, printed side up; the horizon is at cy.
  const SE3 cam_T_floor(SO3::from_rpy(-std::numbers::pi / 2, 0, 0), {0, 1, 0});
  for (const CameraModel* camera : {&kStraight, &kBent}) {
    PlanarPattern floor = square(cam_T_floor, 77);
    floor.x_lines_m = floor.y_lines_m = {-20, 20};
    ASSERT_TRUE(floor.faces_camera());
    const SceneLight light = light_of(*camera, {floor}, 0.6);
    for (const int x : {0, 100, 199}) {
      EXPECT_NEAR(light.covered[light.index(x, 159)], 1, 1e-5);
      EXPECT_NEAR(light.level[light.index(x, 130)], 77, 1e-3);
      EXPECT_EQ(light.covered[light.index(x, 40)], 0);
    }
  }
}

TEST(SceneLight, FromBehindAPatternIsBlankPaper) {
  const SE3 away(SO3::from_rpy(0, std::numbers::pi, 0), {0, 0, 2});
  ASSERT_FALSE(square(away).faces_camera());
  const SceneLight light = light_of(kStraight, {square(away)}, 0);
  EXPECT_NEAR(light.level[light.index(101, 79)], 255, 1e-3);
  EXPECT_NEAR(light.covered[light.index(101, 79)], 1, 1e-6);
}

TEST(MergedCells, TileThePattern) {
  Random random(3);
  PlanarPattern pattern{.x_lines_m = {0}, .y_lines_m = {0}, .levels = Image(12, 9), .cam_T_plane = {}};
  for (int i = 0; i < 12; ++i) pattern.x_lines_m.push_back(pattern.x_lines_m.back() + random.uniform(0.1, 1));
  for (int i = 0; i < 9; ++i) pattern.y_lines_m.push_back(pattern.y_lines_m.back() + random.uniform(0.1, 1));
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 12; ++x)
      pattern.levels.row(y)[x] = y % 3 == 1 ? 9 : static_cast<std::uint8_t>(random.index(2));
  }
  const std::vector<PatternRect> rects = merged_cells(pattern);
  EXPECT_LT(rects.size(), 90U);  // of 108 cells
  for (int y = 0; y < 9; ++y) {
    for (int x = 0; x < 12; ++x) {
      const auto i = static_cast<std::size_t>(x);
      const auto j = static_cast<std::size_t>(y);
      const double at_x = (pattern.x_lines_m[i] + pattern.x_lines_m[i + 1]) / 2;
      const double at_y = (pattern.y_lines_m[j] + pattern.y_lines_m[j + 1]) / 2;
      int holding = 0;
      for (const PatternRect& rect : rects) {
        if (at_x < rect.left || at_x >= rect.right || at_y < rect.top || at_y >= rect.bottom) continue;
        ++holding;
        EXPECT_EQ(rect.level, pattern.levels.row(y)[x]);
      }
      EXPECT_EQ(holding, 1);
    }
  }
}

}  // namespace
}  // namespace waymark::photo
