#include "waymark/simulation/render/pattern_radiance.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::photo {
namespace {

using Eigen::Vector2d;
using Polygon = std::vector<Vector2d>;

/// Positive if the corners are clockwise in the image (y down).
double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

/// The part of the polygon where sign * (coordinate - limit) >= 0 (Sutherland and Hodgman).
Polygon clip(const Polygon& polygon, int axis, double limit, double sign) {
  Polygon kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector2d& a = polygon[i];
    const Vector2d& b = polygon[(i + 1) % polygon.size()];
    const double da = sign * (a[axis] - limit);
    const double db = sign * (b[axis] - limit);
    if (da >= 0) kept.push_back(a);
    if ((da < 0) != (db < 0)) kept.emplace_back(a + (b - a) * (da / (da - db)));
  }
  return kept;
}

/// Oracle that clips the polygon to the cell.
double area_in_cell(const Polygon& polygon, int x, int y) {
  return area(clip(clip(clip(clip(polygon, 0, x, 1), 0, x + 1, -1), 1, y, 1), 1, y + 1, -1));
}

/// A random convex polygon with clockwise corners.
Polygon random_polygon(Random& random, double reach) {
  const Vector2d centre(random.uniform(-reach, 20 + reach), random.uniform(-reach, 15 + reach));
  const double radius = random.uniform(0.05, 12);
  const auto corners = 3 + random.index(6);
  Polygon polygon;
  double angle = random.uniform(0, 6);
  for (std::uint64_t i = 0; i < corners; ++i) {
    polygon.emplace_back(centre + radius * Vector2d(std::cos(angle), std::sin(angle)));
    angle += 2 * 3.14159265358979 / static_cast<double>(corners);
  }
  return polygon;
}

TEST(Coverage, IsTheClippedAreaInEveryCell) {
  Random random(1);
  Coverage coverage;
  for (int i = 0; i < 300; ++i) {
    const Polygon polygon = random_polygon(random, 10);
    coverage.reset(20, 15);
    coverage.add(polygon, 3);
    for (int y = 0; y < 15; ++y) {
      const auto row = coverage.finish_row(y);
      for (int x = 0; x < 20; ++x) {
        const double expected = area_in_cell(polygon, x, y);
        ASSERT_NEAR(row[static_cast<std::size_t>(x)].covered, expected, 1e-12);
        ASSERT_NEAR(row[static_cast<std::size_t>(x)].value, 3 * expected, 1e-11);
      }
    }
  }
}

TEST(Coverage, HandlesVerticalSidesOnCellLimitsAndOutside) {
  for (const auto& [left, right] :
       {std::pair{0.0, 4.0}, {-3.0, 2.5}, {1.25, 9.0}, {-5.0, 50.0}, {-5.0, -1.0}, {4.0, 6.0}}) {
    const Polygon box = {{left, -2}, {right, -2}, {right, 2.25}, {left, 2.25}};
    Coverage coverage;
    coverage.reset(4, 3);
    coverage.add(box, 1);
    for (int y = 0; y < 3; ++y) {
      const auto row = coverage.finish_row(y);
      for (int x = 0; x < 4; ++x)
        EXPECT_NEAR(row[static_cast<std::size_t>(x)].covered, area_in_cell(box, x, y), 1e-15);
    }
  }
}

TEST(Coverage, DistantCornersKeepPrecision) {
  // A half-plane whose boundary crosses the grid, spanned by corners a million cells away.
  const Polygon half = {{-1e6, -1e6 + 3}, {1e6, 1e6 + 3}, {-1e6, 1e6 + 3}};
  Coverage coverage;
  coverage.reset(8, 8);
  coverage.add(half, 1);
  for (int y = 0; y < 8; ++y) {
    const auto row = coverage.finish_row(y);
    for (int x = 0; x < 8; ++x) {
      const double expected = y > x + 3 ? 1.0 : (y == x + 3 ? 0.5 : 0.0);  // below y = x + 3
      EXPECT_NEAR(row[static_cast<std::size_t>(x)].covered, expected, 1e-9) << x << ", " << y;
    }
  }
}

TEST(Coverage, PiecesThatTileAddUpToOne) {
  Random random(2);
  Coverage coverage;
  coverage.reset(10, 10);
  const std::array<Vector2d, 4> box = {Vector2d(-1, -1), Vector2d(11, -1), Vector2d(11, 11),
                                       Vector2d(-1, 11)};
  const Vector2d middle(random.uniform(2, 8), random.uniform(2, 8));
  for (std::size_t i = 0; i < 4; ++i) coverage.add(Polygon{box[i], box[(i + 1) % 4], middle}, 5);
  for (int y = 0; y < 10; ++y) {
    for (const Coverage::Cell& cell : coverage.finish_row(y)) {
      EXPECT_NEAR(cell.covered, 1, 1e-13);
      EXPECT_NEAR(cell.value, 5, 1e-12);
    }
  }
}

TEST(Coverage, AnticlockwisePolygonsAreSubtracted) {
  const Polygon triangle = {{1, 1}, {6, 2}, {3, 5}};
  const Polygon reversed(triangle.rbegin(), triangle.rend());
  Coverage coverage;
  coverage.reset(8, 8);
  coverage.add(triangle, 1);
  coverage.add(reversed, 1);
  for (int y = 0; y < 8; ++y) {
    for (const Coverage::Cell& cell : coverage.finish_row(y)) EXPECT_NEAR(cell.covered, 0, 1e-15);
  }
}

constexpr double kSigmas[] = {0.05, 0.1, 0.3, 0.6, 1.0, 2.5, 8.0};

/// Centre of weight k relative to the middle of the pixel [px].
double position(const PointSpread& spread, std::size_t k) {
  return (static_cast<double>(k) + 0.5) / spread.cells_per_px - 0.5 - spread.reach_px;
}

TEST(PointSpread, SumsToOneAndIsSymmetric) {
  for (const double sigma : kSigmas) {
    const PointSpread spread = point_spread(sigma);
    const std::size_t count = spread.weights.size();
    ASSERT_EQ(count, static_cast<std::size_t>(spread.cells_per_px * (1 + 2 * spread.reach_px)));
    EXPECT_NEAR(std::accumulate(spread.weights.begin(), spread.weights.end(), 0.0), 1, 1e-14);
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_EQ(spread.weights[k], spread.weights[count - 1 - k]);
      EXPECT_GE(spread.weights[k], 0);
    }
  }
}

TEST(PointSpread, HasTheVarianceOfBoxAndGaussian) {
  for (const double sigma : kSigmas) {
    const PointSpread spread = point_spread(sigma);
    double variance = 1.0 / (12.0 * spread.cells_per_px * spread.cells_per_px);  // variance of a cell
    for (std::size_t k = 0; k < spread.weights.size(); ++k) {
      variance += spread.weights[k] * position(spread, k) * position(spread, k);
    }
    EXPECT_NEAR(variance, sigma * sigma + 1.0 / 12, 2e-5 * (1 + sigma * sigma)) << sigma;
  }
}

TEST(PointSpread, WithoutLensIsThePixelAlone) {
  EXPECT_EQ(point_spread(0), (PointSpread{1, 0, {1.0}}));
  EXPECT_EQ(point_spread(0.049), point_spread(0));
}

/// Mean over a pixel at u of a step at 0 blurred by a Gaussian, which is the exact response.
double exact_step(double u, double sigma) {
  const auto integral = [&](double x) {
    return x * 0.5 * std::erfc(-x / sigma / std::numbers::sqrt2) +
           sigma * std::exp(-x * x / sigma / sigma / 2) / std::sqrt(2 * std::numbers::pi);
  };
  return integral(u + 0.5) - integral(u - 0.5);
}

TEST(PointSpread, StepResponseMatchesTheExactIntegral) {
  for (const double sigma : {0.3, 0.6, 1.0, 2.5}) {
    const PointSpread spread = point_spread(sigma);
    const double half = 0.5 / spread.cells_per_px;
    for (double u = -4; u <= 4; u += 0.0371) {  // the step is at -u
      double response = 0;
      for (std::size_t k = 0; k < spread.weights.size(); ++k) {
        response += spread.weights[k] * std::clamp((position(spread, k) + half + u) / (2 * half), 0.0, 1.0);
      }
      EXPECT_NEAR(response, exact_step(u, sigma), 1e-3) << sigma << " at " << u;
    }
  }
}

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

/// An ink square with 1 m sides and no paper around it.
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

SceneRadiance radiance_of(const CameraModel& camera, const std::vector<PlanarPattern>& patterns,
                          double sigma_px) {
  std::vector<ProjectedPattern> projected;
  for (const PlanarPattern& pattern : patterns) projected.push_back(project_pattern(camera, pattern));
  return gather_radiance(projected, camera.width_px(), camera.height_px(), point_spread(sigma_px));
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

/// The outline of the 1 m square in the image, computed from many points on each side.
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

/// A view of the square that leaves space for the lens blur around it.
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

TEST(SceneRadiance, AreaAndCentroidOfASquareAreExact) {
  Random random(1);
  for (const CameraModel* camera : {&kStraight, &kBent, &kFisheye}) {
    for (const double sigma : {0.0, 0.6, 1.0, 1.7}) {
      for (int i = 0; i < 4; ++i) {
        const SE3 cam_T_plane = wholly_visible_view(*camera, random);
        const auto [area, centroid] = moments(fine_outline(*camera, cam_T_plane));
        const SceneRadiance radiance = radiance_of(*camera, {square(cam_T_plane)}, sigma);
        double sum = 0;
        Vector2d first = Vector2d::Zero();
        for (int y = 0; y < radiance.height; ++y) {
          for (int x = 0; x < radiance.width; ++x) {
            const double covered = static_cast<double>(radiance.covered[radiance.index(x, y)]);
            sum += covered;
            first += covered * Vector2d(x + 0.5, y + 0.5);
          }
        }
        // The chords may change the area by the perimeter times 1e-4 px.
        EXPECT_NEAR(sum, area, 1e-4 * 4 * std::sqrt(area) + 1e-3);
        // Pixels are samples, so their centroid equals that of the scene if the lens leaves no aliasing.
        if (sigma >= 1) {
          EXPECT_NEAR((first / sum - centroid).norm(), 0, 1e-4);
        }
      }
    }
  }
}

/// Oracle that casts rays through n x n points of a pixel and intersects each with the plane.
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

TEST(SceneRadiance, AgreesWithRaysThroughThePixel) {
  Random random(2);
  for (const CameraModel* camera : {&kStraight, &kBent, &kFisheye}) {
    const PlanarPattern pattern = checkerboard(7, random_view(random));
    const SceneRadiance radiance = radiance_of(*camera, {pattern}, 0);
    double largest = 0;
    double mean = 0;
    constexpr int kPixels = 300;
    for (int i = 0; i < kPixels; ++i) {
      const int x = static_cast<int>(60 + random.index(80));
      const int y = static_cast<int>(40 + random.index(80));
      const double difference =
          static_cast<double>(radiance.level[radiance.index(x, y)]) - by_rays(*camera, pattern, x, y, 48);
      largest = std::max(largest, std::abs(difference));
      mean += difference / kPixels;
    }
    // 48 x 48 points resolve an edge that is 225 levels high to about 1/48 px at worst, and far better on
    // average.
    EXPECT_LT(largest, 225.0 / 48);
    EXPECT_NEAR(mean, 0, 0.05);
  }
}

TEST(SceneRadiance, NearerPaperHidesFartherPaper) {
  const SE3 far(SO3(), {0, 0, 3});
  const SE3 near(SO3(), {0.1, 0, 2});
  const SceneRadiance both = radiance_of(kStraight, {square(far, 200), square(near, 50)}, 0.6);
  const SceneRadiance alone = radiance_of(kStraight, {square(near, 50)}, 0.6);
  const Vector2d middle = kStraight.project(near.translation()).value();
  const std::size_t in_near = both.index(static_cast<int>(middle.x()), static_cast<int>(middle.y()));
  EXPECT_NEAR(both.level[in_near], 50, 1e-4);
  EXPECT_EQ(both.level[in_near], alone.level[in_near]);
}

TEST(SceneRadiance, PatternsBehindTheCameraAreOmitted) {
  const SceneRadiance radiance = radiance_of(kStraight, {square(SE3(SO3(), {0, 0, -2}))}, 0.6);
  EXPECT_EQ(*std::max_element(radiance.covered.begin(), radiance.covered.end()), 0.0F);
}

TEST(SceneRadiance, AFloorBehindTheCameraFillsTheImageBelowTheHorizon) {
  // 40 m x 40 m, 1 m below the camera, with the printed side up; the horizon is at cy.
  const SE3 cam_T_floor(SO3::from_rpy(-std::numbers::pi / 2, 0, 0), {0, 1, 0});
  for (const CameraModel* camera : {&kStraight, &kBent}) {
    PlanarPattern floor = square(cam_T_floor, 77);
    floor.x_lines_m = floor.y_lines_m = {-20, 20};
    ASSERT_TRUE(floor.faces_camera());
    const SceneRadiance radiance = radiance_of(*camera, {floor}, 0.6);
    for (const int x : {0, 100, 199}) {
      EXPECT_NEAR(radiance.covered[radiance.index(x, 159)], 1, 1e-5);
      EXPECT_NEAR(radiance.level[radiance.index(x, 130)], 77, 1e-3);
      EXPECT_EQ(radiance.covered[radiance.index(x, 40)], 0);
    }
  }
}

TEST(SceneRadiance, APatternSeenFromBehindIsBlankPaper) {
  const SE3 away(SO3::from_rpy(0, std::numbers::pi, 0), {0, 0, 2});
  ASSERT_FALSE(square(away).faces_camera());
  const SceneRadiance radiance = radiance_of(kStraight, {square(away)}, 0);
  EXPECT_NEAR(radiance.level[radiance.index(101, 79)], 255, 1e-3);
  EXPECT_NEAR(radiance.covered[radiance.index(101, 79)], 1, 1e-6);
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
  EXPECT_LT(rects.size(), 90U);  // merged from 108 cells
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
