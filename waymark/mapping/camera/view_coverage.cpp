#include "waymark/mapping/camera/view_coverage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

int& count_of(ViewCoverage& coverage, BoardTilt tilt) {
  return coverage.tilts.at(static_cast<std::size_t>(tilt));
}
int count_of(const ViewCoverage& coverage, BoardTilt tilt) {
  return coverage.tilts.at(static_cast<std::size_t>(tilt));
}

std::size_t third_of(double share) { return static_cast<std::size_t>(std::clamp(3 * share, 0.0, 2.0)); }

/// "left, upper or lower".
std::string joined_by_or(const std::vector<std::string>& words) {
  if (words.size() < 2) return words.empty() ? "" : words.front();
  return fmt::format("{} or {}", fmt::join(words.begin(), words.end() - 1, ", "), words.back());
}

}  // namespace

const std::array<std::pair<BoardTilt, const char*>, 4>& tilts_with_edges() {
  static constexpr std::array<std::pair<BoardTilt, const char*>, 4> kTilts = {
      {{BoardTilt::LeftNearer, "left"},
       {BoardTilt::RightNearer, "right"},
       {BoardTilt::UpperNearer, "upper"},
       {BoardTilt::LowerNearer, "lower"}}};
  return kTilts;
}

const std::array<const char*, 9>& image_part_names() {
  static constexpr std::array<const char*, 9> kNames = {
      "top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"};
  return kNames;
}

BoardTilt board_tilt(const SE3& target_T_cam, double least_deg) {
  const Eigen::Vector3d normal = target_T_cam.rotation().inverse() * Eigen::Vector3d::UnitZ();
  const double tilt_deg = to_degrees(std::acos(std::clamp(normal.z(), -1.0, 1.0)));
  if (tilt_deg < least_deg) return BoardTilt::Frontal;
  // On the board dz/dx = -n_x / n_z: with n_x below 0 its left side is nearer.
  if (std::abs(normal.x()) > std::abs(normal.y()))
    return normal.x() < 0 ? BoardTilt::LeftNearer : BoardTilt::RightNearer;
  return normal.y() < 0 ? BoardTilt::UpperNearer : BoardTilt::LowerNearer;
}

std::array<int, 9> corners_by_part(const TargetPicture& marks, int width_px, int height_px) {
  std::array<int, 9> corners{};
  for (const TargetMark& mark : marks)
    for (const Eigen::Vector2d& px : mark.seen_px)
      ++corners.at(3 * third_of(px.y() / height_px) + third_of(px.x() / width_px));
  return corners;
}

void add_view(ViewCoverage& coverage, const TargetPicture& marks, const SE3& target_T_cam, int width_px,
              int height_px) {
  ++coverage.views;
  ++count_of(coverage, board_tilt(target_T_cam));
  const std::array<int, 9> corners = corners_by_part(marks, width_px, height_px);
  for (std::size_t i = 0; i < corners.size(); ++i) coverage.corners.at(i) += corners.at(i);
}

std::vector<std::string> missing_views(const ViewCoverage& coverage, const CoverageOptions& options) {
  std::vector<std::string> missing;
  std::vector<std::string> edges;
  for (const auto& [tilt, edge] : tilts_with_edges())
    if (count_of(coverage, tilt) < options.views_each_tilt) edges.emplace_back(edge);
  if (!edges.empty())
    missing.push_back(fmt::format("tilt the board, its {} edge nearer to the camera", joined_by_or(edges)));
  std::vector<std::string> empty;
  for (std::size_t i = 0; i < coverage.corners.size(); ++i)
    if (coverage.corners.at(i) < options.corners_each_part) empty.emplace_back(image_part_names().at(i));
  if (!empty.empty())
    missing.push_back(fmt::format("hold it where it was not yet: {}", fmt::join(empty, ", ")));
  if (coverage.views < options.views)
    missing.push_back(fmt::format("{} more views, nearer and further away", options.views - coverage.views));
  return missing;
}

}  // namespace waymark
