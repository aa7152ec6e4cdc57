#include "waymark/tags/straight_view.hpp"

#include <array>
#include <optional>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using Eigen::Vector2d;
using Quad = std::array<Vector2d, 4>;

CameraModel fisheye() {
  return CameraModel::make(Equidistant{.fx = 300, .fy = 310, .cx = 320, .cy = 240, .k = {0.03, -0.01, 0, 0}},
                           640, 480)
      .value();
}

Quad square(const Vector2d& center_px, double side_px) {
  const double half = side_px / 2;
  return {center_px + Vector2d(-half, -half), center_px + Vector2d(half, -half),
          center_px + Vector2d(half, half), center_px + Vector2d(-half, half)};
}

TEST(StraightView, PointsMapToTheCameraAndBack) {
  Random random(3);
  const CameraModel camera = fisheye();
  for (int i = 0; i < 50; ++i) {
    const Quad quad = square({random.uniform(80, 560), random.uniform(80, 400)}, random.uniform(20, 120));
    const auto view = StraightView::around(Image(640, 480), camera, quad);
    ASSERT_TRUE(view);
    for (const Vector2d& corner : quad) {
      const auto there = view->from_camera(corner);
      ASSERT_TRUE(there);
      EXPECT_GT(there->x(), 0);
      EXPECT_LT(there->x(), view->image().width());
      Eigen::Matrix2d J;
      const auto back = view->to_camera(*there, &J);
      ASSERT_TRUE(back);
      EXPECT_LT((*back - corner).norm(), 1e-8);
      constexpr double kStep = 1e-4;
      for (Eigen::Index axis = 0; axis < 2; ++axis) {
        const Vector2d step = kStep * Vector2d::Unit(axis);
        const Vector2d slope =
            (*view->to_camera(*there + step) - *view->to_camera(*there - step)) / (2 * kStep);
        EXPECT_LT((slope - J.col(axis)).norm(), 1e-5);
      }
    }
  }
}

TEST(StraightView, LinesInTheWorldAreStraight) {
  const CameraModel camera = fisheye();
  const Eigen::Vector3d from(0.5, -0.4, 1);
  const Eigen::Vector3d to(0.9, 0.3, 0.8);
  const Vector2d a = camera.project(from).value();
  const Vector2d c = camera.project(to).value();
  const auto view = StraightView::around(Image(640, 480), camera, square(0.5 * (a + c), 60));
  ASSERT_TRUE(view);
  const Vector2d start = view->from_camera(a).value();
  const Vector2d along = (view->from_camera(c).value() - start).normalized();
  for (const double t : {0.2, 0.5, 0.8}) {
    const Vector2d off = view->from_camera(camera.project(from + t * (to - from)).value()).value() - start;
    EXPECT_NEAR(along.x() * off.y() - along.y() * off.x(), 0, 1e-8);
  }
}

TEST(StraightView, KeepsTheGreyLevels) {
  const CameraModel camera = fisheye();
  Image image(640, 480);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) image.row(y)[x] = static_cast<std::uint8_t>(x / 4 + y / 8);
  const auto view = StraightView::around(image, camera, square({500, 150}, 80));
  ASSERT_TRUE(view);
  for (int y = 1; y < view->image().height(); y += 7) {
    for (int x = 1; x < view->image().width(); x += 7) {
      const auto px = view->to_camera({x + 0.5, y + 0.5});
      if (!px || px->x() < 1 || px->x() > 639 || px->y() < 1 || px->y() > 479) continue;
      EXPECT_NEAR(view->image().row(y)[x], sample_bilinear(image, px->x(), px->y()), 0.6);
    }
  }
}

TEST(StraightView, NeedsAQuadInsideTheImageAndTheDomain) {
  const CameraModel camera = fisheye();
  EXPECT_FALSE(StraightView::around(Image(640, 480), camera, square({10, 240}, 60)));
  const auto folding = CameraModel::make(
      PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240, .k = {-0.8}, .coefficients = 4}, 640, 480);
  ASSERT_TRUE(folding);
  EXPECT_FALSE(StraightView::around(Image(640, 480), *folding, square({590, 430}, 60)));
  EXPECT_FALSE(edge_bulge_px(*folding, square({590, 430}, 60)));
}

TEST(EdgeBulge, IsZeroWithoutDistortionAndGrowsWithTheSizeOfTheTag) {
  const auto plain = CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480);
  EXPECT_NEAR(edge_bulge_px(*plain, square({500, 150}, 80)).value(), 0, 1e-9);
  const CameraModel camera = fisheye();
  EXPECT_GT(edge_bulge_px(camera, square({500, 150}, 80)).value(), 1);
  EXPECT_LT(edge_bulge_px(camera, square({500, 150}, 10)).value(), 0.1);
}

}  // namespace
}  // namespace waymark
