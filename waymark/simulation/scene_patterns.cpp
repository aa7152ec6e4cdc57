#include "waymark/simulation/scene_patterns.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "waymark/samples/visibility.hpp"

namespace waymark::photo {
namespace {

constexpr std::uint8_t kPaper = 255;
constexpr std::uint8_t kOpenCell = 128;

/// Lines of `count` cells around the origin, and a margin on both sides.
std::vector<double> lines(int count, double cell_m, double margin_m) {
  std::vector<double> all;
  const double half = count / 2.0;
  if (margin_m > 0) all.push_back(-half * cell_m - margin_m);
  for (int i = 0; i <= count; ++i) all.push_back((i - half) * cell_m);
  if (margin_m > 0) all.push_back(half * cell_m + margin_m);
  return all;
}

double distance(const PlanarPattern& pattern) { return pattern.cam_T_plane.translation().norm(); }

/// Whether the line of sight to a point meets the paper of a pattern in front of the camera.
bool is_in_the_way(const PlanarPattern& pattern, const SE3& plane_T_cam, const Eigen::Vector3d& cam_p) {
  const Eigen::Vector3d& eye = plane_T_cam.translation();
  const Eigen::Vector3d along = plane_T_cam.rotation() * cam_p;
  if (along.z() == 0) return false;
  const double reach = -eye.z() / along.z();
  if (reach <= 0) return false;
  const Eigen::Vector3d hit = eye + reach * along;
  return hit.x() >= pattern.x_lines_m.front() && hit.x() <= pattern.x_lines_m.back() &&
         hit.y() >= pattern.y_lines_m.front() && hit.y() <= pattern.y_lines_m.back();
}

/// The patterns drawn over that of a tag.
struct Cover {
  const PlanarPattern* pattern = nullptr;
  SE3 plane_T_cam;
};

std::vector<Cover> covers_of(const TagInScene& tag, const std::vector<PlanarPattern>& patterns) {
  const auto own = std::find_if(patterns.begin(), patterns.end(), [&](const PlanarPattern& pattern) {
    return pattern.cam_T_plane == tag.cam_T_tag;
  });
  std::vector<Cover> covers;
  if (own == patterns.end()) return covers;
  for (auto nearer = std::next(own); nearer != patterns.end(); ++nearer) {
    covers.push_back({&*nearer, nearer->cam_T_plane.inverse()});
  }
  return covers;
}

double visible_fraction(const CameraModel& camera, const TagInScene& tag,
                        const std::vector<PlanarPattern>& patterns) {
  constexpr int kPoints = 33;
  const std::vector<Cover> covers = covers_of(tag, patterns);
  int visible = 0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d tag_p(i / (kPoints - 1.0) - 0.5, j / (kPoints - 1.0) - 0.5, 0);
      const Eigen::Vector3d cam_p = tag.cam_T_tag * (tag.size_m * tag_p);
      const auto px = camera.project(cam_p);
      const bool covered = std::any_of(covers.begin(), covers.end(), [&](const Cover& cover) {
        return is_in_the_way(*cover.pattern, cover.plane_T_cam, cam_p);
      });
      if (px && camera.contains(*px) && !covered) ++visible;
    }
  }
  return visible / static_cast<double>(kPoints * kPoints);
}

}  // namespace

PlanarPattern tag_pattern(const TagInScene& tag) {
  const Family& tags = family(tag.tag.family);
  const std::vector<std::uint8_t> cells = bitmap(tag.tag);
  const double cell_m = tag.size_m / tags.width_at_border;
  const int margin = tag.margin_cells > 0 ? 1 : 0;
  PlanarPattern pattern;
  pattern.x_lines_m = lines(tags.total_width, cell_m, tag.margin_cells * cell_m);
  pattern.y_lines_m = pattern.x_lines_m;
  pattern.levels = Image(tags.total_width + 2 * margin, tags.total_width + 2 * margin, kPaper);
  auto cell = cells.begin();
  for (int y = 0; y < tags.total_width; ++y) {
    for (int x = 0; x < tags.total_width; ++x) {
      pattern.levels.row(y + margin)[x + margin] = *cell == kOpenCell ? kPaper : *cell;
      ++cell;
    }
  }
  pattern.cam_T_plane = tag.cam_T_tag;
  return pattern;
}

PlanarPattern sheet_pattern(const SheetInScene& sheet) {
  return {.x_lines_m = lines(sheet.raster.width(), sheet.metres_per_pixel, 0),
          .y_lines_m = lines(sheet.raster.height(), sheet.metres_per_pixel, 0),
          .levels = sheet.raster,
          .cam_T_plane = sheet.cam_T_sheet};
}

std::vector<PlanarPattern> patterns_from_far_to_near(const PhotographScene& scene) {
  std::vector<PlanarPattern> patterns;
  patterns.reserve(scene.tags.size() + scene.sheets.size());
  for (const TagInScene& tag : scene.tags) patterns.push_back(tag_pattern(tag));
  for (const SheetInScene& sheet : scene.sheets) patterns.push_back(sheet_pattern(sheet));
  std::stable_sort(patterns.begin(), patterns.end(),
                   [](const PlanarPattern& a, const PlanarPattern& b) { return distance(a) > distance(b); });
  return patterns;
}

std::optional<TagTruth> tag_truth(const CameraModel& camera, const TagInScene& tag,
                                  const std::vector<PlanarPattern>& patterns) {
  TagTruth truth{.tag = tag.tag, .cam_T_tag = tag.cam_T_tag, .size_m = tag.size_m};
  const auto corners = tag_corners(tag.size_m);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto px = camera.project(tag.cam_T_tag * corners[i]);
    if (!px) return std::nullopt;
    truth.corners_px[i] = *px;
  }
  Matrix23 J_px_p;
  const Eigen::Vector3d& centre = tag.cam_T_tag.translation();
  if (!camera.project(centre, &J_px_p)) return std::nullopt;
  // Moving along the line of sight moves no pixel: what is left of the Jacobian is that of a plane facing the
  // camera.
  truth.size_px = tag.size_m * std::pow((J_px_p * J_px_p.transpose()).determinant(), 0.25);
  const Eigen::Vector3d into_tag = tag.cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  truth.tilt_rad = std::atan2(into_tag.cross(centre).norm(), into_tag.dot(centre));
  const bool front = tag.cam_T_tag.inverse().translation().z() < 0;
  truth.visible_fraction = front ? visible_fraction(camera, tag, patterns) : 0;
  return truth;
}

}  // namespace waymark::photo
