#include "waymark/simulation/render/scene_exposure.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

/// Tests that edges in the noiseless image are at their geometric positions for every lens, size and tilt.
namespace waymark {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kSide = 480;  ///< side length of the image

struct Lens {
  const char* name;
  CameraModel model;
  double px_per_rad;
};

std::vector<Lens> lenses() {
  const PinholeRadtan none{.fx = 400, .fy = 400, .cx = 240, .cy = 240};
  const PinholeRadtan barrel{
      .fx = 300, .fy = 306, .cx = 242, .cy = 237, .k = {-0.25, 0.05, 0.001, 0.002}, .coefficients = 4};
  const Equidistant fisheye{.fx = 240, .fy = 241, .cx = 238, .cy = 242, .k = {-0.02, 0.004, -0.003, 0.001}};
  return {{"pinhole", CameraModel::make(none, kSide, kSide).value(), 400},
          {"radtan", CameraModel::make(barrel, kSide, kSide).value(), 300},
          {"equidistant", CameraModel::make(fisheye, kSide, kSide).value(), 240}};
}

/// Measures the radiance of the pixels before lens blur, noise and rounding.
class RadianceMeter {
 public:
  explicit RadianceMeter(const CameraModel& model)
      : camera_(SceneCamera::make({}, model, {.exposure_ms = 0, .ambient = 1}).value()) {}

  const std::vector<float>& radiance(const Scene& scene) {
    EXPECT_TRUE(camera_.set_scene(scene));
    const auto exposure = camera_.begin([](double) { return SE3(); }, SensorTime(), 1).value();
    for (int band = 0; band < camera_.bands(); ++band) camera_.expose(*exposure, band);
    radiance_ = exposure->radiance;
    return radiance_;
  }
  [[nodiscard]] const CameraModel& model() const { return camera_.model(); }

 private:
  SceneCamera camera_;
  std::vector<float> radiance_;
};

double at(const std::vector<float>& radiance, int x, int y) {
  return static_cast<double>(radiance[static_cast<std::size_t>(y * kSide + x)]);
}

/// Many image points on one side of a white rectangle against black.
std::vector<Vector2d> side_points(const CameraModel& model, const SE3& cam_T, const Vector3d& a,
                                  const Vector3d& b) {
  constexpr int kPoints = 4000;
  std::vector<Vector2d> points;
  for (int i = 0; i <= kPoints; ++i)
    points.push_back(model.project(cam_T * (a + (b - a) * i / kPoints)).value());
  return points;
}

/// Mean of the transverse coordinate of a curve over the strip [k, k + 1) of the longitudinal one.
double mean_crossing(const std::vector<Vector2d>& points, int along, double low) {
  double sum = 0;
  constexpr int kSteps = 50;
  for (int i = 0; i < kSteps; ++i) {
    const double t = low + (i + 0.5) / kSteps;
    const bool up = points.front()[along] < points.back()[along];
    const auto above = std::partition_point(points.begin(), points.end(),
                                            [&](const Vector2d& p) { return (p[along] < t) == up; });
    const Vector2d& q = *above;
    const Vector2d& p = *std::prev(above);
    sum += p[1 - along] + (q[1 - along] - p[1 - along]) * (t - p[along]) / (q[along] - p[along]);
  }
  return sum / kSteps;
}

/// Outward displacement of a side, linear along its length: the offsets at its first and last point [px].
struct SideError {
  double first = 0, last = 0;
  int strips = 0;
};

/// For each strip of pixels, sums the radiance across the side and subtracts the true white length, then fits
/// a line.
SideError side_error(const std::vector<float>& radiance, const std::vector<Vector2d>& side,
                     const Vector2d& inside) {
  constexpr int kReach = 2;
  const Vector2d way = side.back() - side.front();
  const int along = std::abs(way.x()) > std::abs(way.y()) ? 0 : 1;
  const double low = std::min(side.front()[along], side.back()[along]);
  const double high = std::max(side.front()[along], side.back()[along]);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Vector2d right = Vector2d::Zero();
  const Vector2d left(way.y(), -way.x());
  const Vector2d inwards = left.dot(inside - side.front()) > 0 ? left : Vector2d(-left);
  const bool white_below = inwards[1 - along] < 0;
  SideError error;
  for (int k = static_cast<int>(std::ceil(low)); k + 1 <= high; ++k) {
    const double truth = mean_crossing(side, along, k);
    const int begin = static_cast<int>(std::floor(truth)) - kReach;
    const auto value = [&](int i) { return along == 1 ? at(radiance, i, k) : at(radiance, k, i); };
    const double ends = std::abs(value(begin) - value(begin + 2 * kReach));
    if (ends < 1 - 1e-5) continue;  // too close to another side
    double white = 0;
    for (int i = begin; i < begin + 2 * kReach + 1; ++i) white += value(i);
    const double found = white_below ? begin + white : begin + 2 * kReach + 1 - white;
    const Vector2d unit = way.normalized();
    const double outwards = (white_below ? found - truth : truth - found) * std::abs(unit[along]);
    const double s = (k + 0.5 - side.front()[along]) / way[along];
    const Vector2d row(1 - s, s);
    normal += row * row.transpose();
    right += row * outwards;
    ++error.strips;
  }
  if (error.strips < 3) return error;
  const Vector2d fitted = normal.inverse() * right;
  error.first = fitted.x();
  error.last = fitted.y();
  return error;
}

/// Largest distance between the intersections of the rendered sides and the true corners.
double corner_error_px(RadianceMeter& meter, const SE3& cam_T, double size_m) {
  Scene scene{.surfaces = {plain_surface(cam_T, size_m, size_m, {.reflectance = 1})}, .sky_reflectance = 0};
  const std::vector<float>& radiance = meter.radiance(scene);
  const CameraModel& model = meter.model();
  const auto corners = tag_corners(size_m);
  const Vector2d middle = model.project(cam_T.translation()).value();
  std::array<SideError, 4> errors;
  std::array<Vector2d, 4> ways;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto side = side_points(model, cam_T, corners[i], corners[(i + 1) % 4]);
    errors[i] = side_error(radiance, side, middle);
    ways[i] = (side.back() - side.front()).normalized();
    EXPECT_GE(errors[i].strips, 3);
  }
  double worst = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t before = (i + 3) % 4;
    const Eigen::Matrix2d normals =
        (Eigen::Matrix2d() << ways[before].y(), -ways[before].x(), ways[i].y(), -ways[i].x()).finished();
    const Vector2d error = normals.inverse() * Vector2d(errors[before].last, errors[i].first);
    worst = std::max(worst, error.norm());
  }
  return worst;
}

/// Pose of a rectangle in the image whose side would be `size_px` long if it faced the camera.
SE3 some_pose(double size_px, double px_per_rad, double tilt_rad, int turn, Random& random) {
  const double room = std::max(0.0, (kSide - 1.5 * size_px) / 2 - 8) / px_per_rad;
  const double roll = turn == 0 ? 0 : random.uniform(-3, 3);  // vertical sides are hardest to sample
  const Vector3d ray(random.uniform(-room, room), random.uniform(-room, room), 1);
  const SO3 towards = SO3::from_rpy(-std::atan(ray.y()), std::atan(ray.x()), 0);
  return {towards * SO3::from_rpy(0, 0, roll) * SO3::from_rpy(tilt_rad, 0, 0), ray};
}

TEST(SceneCameraEdges, MeetAtTheTrueCornersWithinFiveThousandthsOfAPixel) {
  Random random(7);
  std::printf("worst distance of a corner from the truth [px], by lens, size and tilt\n");
  std::printf("%-12s %7s %8s %8s %8s %8s %8s\n", "", "size_px", "0 deg", "20 deg", "40 deg", "60 deg",
              "70 deg");
  for (const Lens& lens : lenses()) {
    RadianceMeter meter(lens.model);
    for (const double size_px : {30.0, 60.0, 120.0, 200.0}) {
      std::printf("%-12s %7.0f", lens.name, size_px);
      for (const double tilt_deg : {0.0, 20.0, 40.0, 60.0, 70.0}) {
        double worst = 0;
        for (int turn = 0; turn < 6; ++turn) {
          const SE3 pose = some_pose(size_px, lens.px_per_rad, to_radians(tilt_deg), turn, random);
          worst = std::max(worst, corner_error_px(meter, pose, size_px / lens.px_per_rad));
        }
        std::printf(" %8.5f", worst);
        EXPECT_LT(worst, 0.005) << lens.name << ", " << size_px << " px, " << tilt_deg << " deg";
      }
      std::printf("\n");
    }
  }
}

/// Value of a tag pixel computed from many rays, exact to within their spacing. Only the camera model is
/// shared with the renderer.
double by_many_rays(const CameraModel& model, const TagId& tag, const SE3& cam_T_tag, double cell_m, int x,
                    int y) {
  constexpr int kRays = 16;
  const Family& tags = family(tag.family);
  const std::vector<std::uint8_t> cells = bitmap(tag);
  const SE3 tag_T_cam = cam_T_tag.inverse();
  double sum = 0;
  for (int j = 0; j < kRays; ++j) {
    for (int i = 0; i < kRays; ++i) {
      const auto ray = model.unproject({x + (i + 0.5) / kRays, y + (j + 0.5) / kRays});
      if (!ray) continue;
      const Vector3d along = tag_T_cam.rotation() * *ray;
      const Vector3d hit = tag_T_cam.translation() - along * (tag_T_cam.translation().z() / along.z());
      const int column = static_cast<int>(std::floor(hit.x() / cell_m + tags.total_width / 2.0));
      const int row = static_cast<int>(std::floor(hit.y() / cell_m + tags.total_width / 2.0));
      if (along.z() <= 0 || column < -1 || row < -1 || column > tags.total_width || row > tags.total_width)
        continue;
      const bool margin = column < 0 || row < 0 || column == tags.total_width || row == tags.total_width;
      const bool ink = !margin && cells[static_cast<std::size_t>(row * tags.total_width + column)] == 0;
      sum += ink ? 0.06 : 1.0;
    }
  }
  return sum / (kRays * kRays);
}

TEST(SceneCameraEdges, EveryPixelOfATagMatchesManyRays) {
  Random random(3);
  for (const Lens& lens : lenses()) {
    RadianceMeter meter(lens.model);
    double worst = 0;
    double sum = 0;
    int pixels = 0;
    for (const double size_px : {9.0, 24.0, 50.0}) {  // cells of 1, 3 and 6 px
      const TagId tag{FamilyId::Tag36h11, static_cast<int>(random.index(587))};
      const double size_m = size_px / lens.px_per_rad;
      const SE3 pose = some_pose(size_px, lens.px_per_rad, random.uniform(0, 1.2), 1, random);
      const std::vector<float>& radiance =
          meter.radiance({.surfaces = {tag_surface(tag, pose, size_m, 1)}, .sky_reflectance = 0});
      const Vector2d middle = lens.model.project(pose.translation()).value();
      const int reach = static_cast<int>(size_px * 0.9) + 2;
      for (int y = static_cast<int>(middle.y()) - reach; y <= static_cast<int>(middle.y()) + reach; ++y) {
        for (int x = static_cast<int>(middle.x()) - reach; x <= static_cast<int>(middle.x()) + reach; ++x) {
          if (x < 0 || y < 0 || x >= kSide || y >= kSide) continue;
          const double error = at(radiance, x, y) - by_many_rays(lens.model, tag, pose, size_m / 8, x, y);
          worst = std::max(worst, std::abs(error));
          sum += error;
          ++pixels;
        }
      }
    }
    std::printf("%-12s %d pixels: worst difference %.4f, mean %.6f\n", lens.name, pixels, worst,
                sum / pixels);
    EXPECT_LT(worst, 0.06);  // an edge may be missed by a column of 16 rays
    EXPECT_LT(std::abs(sum / pixels), 1e-4);
  }
}

}  // namespace
}  // namespace waymark
