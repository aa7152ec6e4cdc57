// Rate and size of errors of single-tag poses by size and tilt, for Waymark, OpenCV and libapriltag on the
// same corners. Prints CSV; docs/concepts/pose.md shows its table.
#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "benchmarks/pose_peers.hpp"
#include "tests/support/tag_views.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/plot/figure.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/pose/square_pose.hpp"
#include "waymark/pose/tag_pose.hpp"

namespace waymark {
namespace {

using testing::kTagSize;

constexpr const char* kUsage =
    "usage: pose_monte_carlo [VIEWS [SIGMA_PX [FIGURE.svg]]]\n"
    "Poses of one tag from corners with normal noise of SIGMA_PX (default 0.1), VIEWS (default 1000) random "
    "views for each\n"
    "size and tilt. One line of CSV for each size, tilt and method; the flip rates also as a figure:\n"
    "  flip_rate            part of the views where the chosen pose is nearer to the mirrored one than to "
    "the truth\n"
    "  rotation_rmse_deg    of the chosen pose\n"
    "  branch_rmse_deg      of the solution nearest to the truth, where a method gives both\n"
    "  depth_bias_percent, depth_rmse_percent   of the distance along the optical axis, chosen pose\n"
    "  tilt_bias_deg        mean of chosen tilt minus true tilt\n"
    "  branch_nees          mean of the squared error over its covariance (6 when the covariance is true), "
    "nearest solution\n";

struct Found {
  SE3 chosen{};
  std::vector<SE3> both{};  ///< if the method returns them
  std::vector<PoseCovariance> covariances{};
};

struct Method {
  const char* name;
  std::function<Found(const CameraModel&, const TagDetection&)> find;
};

struct Sums {
  double flips = 0, rotation = 0, branch = 0, depth = 0, depth_squared = 0, tilt = 0, nees = 0;
};

double angle(const SE3& a, const SE3& b) { return (a.rotation().inverse() * b.rotation()).angle(); }

double tilt_rad(const SE3& cam_T_tag) {
  const Eigen::Vector3d z = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  return std::acos(std::clamp(z.dot(cam_T_tag.translation().normalized()), -1.0, 1.0));
}

/// The pose that is confused with the true one: the other closed-form solution of its exact image.
SE3 mirrored(const SE3& cam_T_tag) {
  std::array<Eigen::Vector3d, 4> bearings;
  for (std::size_t i = 0; i < 4; ++i) bearings[i] = (cam_T_tag * testing::tag_corners()[i]).normalized();
  return square_poses(bearings, kTagSize).cam_T_tag[1];
}

void add(Sums& sums, const SE3& truth, const Found& found) {
  const double rotation = angle(truth, found.chosen);
  sums.flips += angle(mirrored(truth), found.chosen) < rotation ? 1 : 0;
  sums.rotation += rotation * rotation;
  const double depth = found.chosen.translation().z() / truth.translation().z() - 1;
  sums.depth += depth;
  sums.depth_squared += depth * depth;
  sums.tilt += tilt_rad(found.chosen) - tilt_rad(truth);
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < found.both.size(); ++i) {
    if (angle(truth, found.both[i]) < angle(truth, found.both[nearest])) nearest = i;
  }
  if (found.both.empty()) return;
  sums.branch += std::pow(angle(truth, found.both[nearest]), 2);
  if (found.covariances.empty()) return;
  const SE3::Tangent error = minus(truth, found.both[nearest]);
  sums.nees += error.dot(Eigen::LLT<PoseCovariance>(found.covariances[nearest]).solve(error));
}

std::vector<Method> methods(double sigma_px) {
  const auto ours = [sigma_px](const CameraModel& camera, const TagDetection& seen) {
    const TagPose pose = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = sigma_px}).value();
    Found found{
        .chosen = pose.best.cam_T_tag, .both = {pose.best.cam_T_tag}, .covariances = {pose.best.covariance}};
    if (pose.other) {
      found.both.push_back(pose.other->cam_T_tag);
      found.covariances.push_back(pose.other->covariance);
    }
    return found;
  };
  const auto opencv = [](const CameraModel& camera, const TagDetection& seen) {
    const auto both = peers::OpenCv(std::get<PinholeRadtan>(camera.projection()), seen, kTagSize).both();
    return Found{.chosen = both.at(0), .both = both};
  };
  const auto apriltag = [](const CameraModel& camera, const TagDetection& seen) {
    return Found{.chosen =
                     peers::Libapriltag(std::get<PinholeRadtan>(camera.projection()), seen, kTagSize).pose()};
  };
  return {{"waymark", ours}, {"opencv_ippe_square", opencv}, {"libapriltag", apriltag}};
}

void print(double size_px, double tilt_deg, const Method& method, const Sums& s, int views) {
  const double n = views;
  const double deg = 180 / std::numbers::pi;
  std::printf("%.0f,%.0f,%s,%.4f,%.3f,", size_px, tilt_deg, method.name, s.flips / n,
              std::sqrt(s.rotation / n) * deg);
  std::printf(s.branch > 0 ? "%.3f," : ",", std::sqrt(s.branch / n) * deg);
  std::printf("%.4f,%.4f,%.3f,", 100 * s.depth / n, 100 * std::sqrt(s.depth_squared / n), s.tilt / n * deg);
  std::printf(s.nees > 0 ? "%.2f\n" : "\n", s.nees / n);
}

/// Flip rate over tilt for one size and method.
plot::Series flip_series(double size_px, std::size_t method, const Method& what, plot::Color color) {
  using Style = plot::Series::Style;
  constexpr std::array<Style, 3> kStyles = {Style::Line, Style::Points, Style::LineAndPoints};
  return {
      .name = fmt::format("{:.0f} px, {}", size_px, what.name), .style = kStyles.at(method), .color = color};
}

bool write_figure(std::vector<plot::Series> series, double sigma_px, const char* path) {
  const auto drawing = plot::draw_figure(
      {.title = fmt::format("The mirrored pose fits better: corners with {} px of noise", sigma_px),
       .x = {.label = "tilt", .unit = "deg"},
       .y = {.label = "views with the mirrored pose", .low = 0, .high = 0.6},
       .series = std::move(series)});
  if (!drawing) return false;
  const auto svg = plot::render_svg(*drawing);
  if (!svg) return false;
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(svg->data()), static_cast<std::streamsize>(svg->size()));
  return file.good();
}

/// The flip rates, as series of a figure.
std::vector<plot::Series> run(int views, double sigma_px) {
  std::vector<plot::Series> figure;
  std::printf(
      "size_px,tilt_deg,method,flip_rate,rotation_rmse_deg,branch_rmse_deg,depth_bias_percent,depth_rmse_"
      "percent,"
      "tilt_bias_deg,branch_nees\n");
  const CameraModel camera = testing::plain_camera();
  const std::vector<Method> all = methods(sigma_px);
  std::size_t colors = 0;
  for (const double size_px : {10.0, 15.0, 20.0, 30.0, 40.0, 80.0}) {
    const std::size_t first = figure.size();
    const bool drawn = size_px == 10.0 || size_px == 20.0 || size_px == 40.0;
    for (std::size_t m = 0; drawn && m < all.size(); ++m)
      figure.push_back(flip_series(size_px, m, all[m], plot::kPalette[colors]));
    colors += drawn ? 1 : 0;
    for (const double tilt_deg : {0.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0}) {
      Random random(static_cast<std::uint64_t>(1000 * size_px + tilt_deg));
      std::vector<Sums> sums(all.size());
      for (int i = 0; i < views; ++i) {
        const SE3 truth = testing::random_view(random, {size_px, size_px, tilt_deg, tilt_deg});
        const TagDetection seen =
            testing::with_noise(testing::see_tag(camera, truth).value(), sigma_px, random);
        for (std::size_t m = 0; m < all.size(); ++m) add(sums[m], truth, all[m].find(camera, seen));
      }
      for (std::size_t m = 0; m < all.size(); ++m) print(size_px, tilt_deg, all[m], sums[m], views);
      for (std::size_t m = 0; drawn && m < all.size(); ++m) {
        figure[first + m].x.push_back(tilt_deg);
        figure[first + m].y.push_back(sums[m].flips / views);
      }
    }
  }
  return figure;
}

}  // namespace
}  // namespace waymark

int main(int argc, char** argv) {
  const int views = argc > 1 ? std::atoi(argv[1]) : 1000;
  const double sigma_px = argc > 2 ? std::atof(argv[2]) : 0.1;
  if (argc > 4 || views <= 0 || !(sigma_px > 0)) {
    std::fputs(waymark::kUsage, stderr);
    return 2;
  }
  const auto figure = waymark::run(views, sigma_px);
  return argc < 4 || waymark::write_figure(figure, sigma_px, argv[3]) ? 0 : 1;
}
