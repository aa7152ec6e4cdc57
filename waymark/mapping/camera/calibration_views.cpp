#include "waymark/mapping/camera/calibration_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

/// Blur at a pixel, computed from the contrast and the steepest slope around it [px]; empty at the image
/// border.
std::optional<double> width_at(const ImageView& image, const Eigen::Vector2d& px) {
  constexpr int kReach = 5;
  const int x0 = static_cast<int>(px.x());
  const int y0 = static_cast<int>(px.y());
  if (x0 < kReach + 1 || y0 < kReach + 1 || x0 + kReach + 1 >= image.width || y0 + kReach + 1 >= image.height)
    return std::nullopt;
  int darkest = 255;
  int brightest = 0;
  double steepest = 0;
  for (int y = y0 - kReach; y <= y0 + kReach; ++y) {
    for (int x = x0 - kReach; x <= x0 + kReach; ++x) {
      const int value = image.at(x, y);
      darkest = std::min(darkest, value);
      brightest = std::max(brightest, value);
      const double dx = 0.5 * (image.at(x + 1, y) - image.at(x - 1, y));
      const double dy = 0.5 * (image.at(x, y + 1) - image.at(x, y - 1));
      steepest = std::max(steepest, std::hypot(dx, dy));
    }
  }
  constexpr int kMinContrast = 20;
  if (brightest - darkest < kMinContrast) return std::nullopt;
  return (brightest - darkest) / (steepest * std::sqrt(2 * std::numbers::pi));
}

std::size_t corners_of(const TargetMarks& marks) {
  std::size_t corners = 0;
  for (const TargetMark& mark : marks) corners += mark.seen_px.size();
  return corners;
}

}  // namespace

std::string_view to_string(CaptureVerdict verdict) {
  switch (verdict) {
    case CaptureVerdict::NoTarget:
      return "no board in view";
    case CaptureVerdict::TooFew:
      return "too little of the board in view";
    case CaptureVerdict::Moving:
      return "hold still";
    case CaptureVerdict::Blurred:
      return "the image is blurred: add light or adjust the focus";
    case CaptureVerdict::Known:
      return "move the board: this view was already taken";
    case CaptureVerdict::New:
      return "taken";
  }
  return "";
}

std::optional<double> edge_width_px(const ImageView& image, const TargetMarks& marks) {
  std::vector<double> widths;
  for (const TargetMark& mark : marks)
    for (const Eigen::Vector2d& px : mark.seen_px)
      if (const auto width = width_at(image, px)) widths.push_back(*width);
  if (widths.empty()) return std::nullopt;
  return median(std::move(widths));
}

bool ViewCapture::still(SensorTime stamp, const TargetMarks& marks) {
  constexpr int kMinStillImages = 2;
  const double dt_s = std::max(to_seconds(stamp - last_stamp_), 1e-6);
  const bool slow = !last_.empty() && apart_px(last_, marks) <= options_.still_px_s * dt_s;
  last_ = marks;
  last_stamp_ = stamp;
  still_times_ = slow ? still_times_ + 1 : 0;
  return still_times_ >= kMinStillImages;
}

CaptureVerdict ViewCapture::take(SensorTime stamp, const ImageView& image, const TargetMarks& marks) {
  const bool is_still = still(stamp, marks);
  if (marks.empty()) return CaptureVerdict::NoTarget;
  if (corners_of(marks) < static_cast<std::size_t>(options_.fewest_corners)) return CaptureVerdict::TooFew;
  const double far_px = options_.new_share * std::hypot(image.width, image.height);
  const bool is_new =
      std::ranges::all_of(views_, [&](const TargetMarks& view) { return apart_px(view, marks) > far_px; });
  if (!is_new) return CaptureVerdict::Known;
  if (!is_still) return CaptureVerdict::Moving;
  const auto width = edge_width_px(image, marks);
  if (!width || *width > options_.widest_edge_px) return CaptureVerdict::Blurred;
  views_.push_back(marks);
  return CaptureVerdict::New;
}

namespace {

int& count_of(ViewCoverage& coverage, BoardTilt tilt) {
  return coverage.tilts.at(static_cast<std::size_t>(tilt));
}
int count_of(const ViewCoverage& coverage, BoardTilt tilt) {
  return coverage.tilts.at(static_cast<std::size_t>(tilt));
}

std::size_t third_of(double share) { return static_cast<std::size_t>(std::clamp(3 * share, 0.0, 2.0)); }

/// Joins words as in "left, upper or lower".
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

BoardTilt board_tilt(const SE3& target_T_cam, double min_tilt_deg) {
  const Eigen::Vector3d normal = target_T_cam.rotation().inverse() * Eigen::Vector3d::UnitZ();
  const double tilt_deg = to_degrees(std::acos(std::clamp(normal.z(), -1.0, 1.0)));
  if (tilt_deg < min_tilt_deg) return BoardTilt::Frontal;
  // On the board, dz/dx = -n_x / n_z, so its left side is nearer if n_x < 0.
  if (std::abs(normal.x()) > std::abs(normal.y()))
    return normal.x() < 0 ? BoardTilt::LeftNearer : BoardTilt::RightNearer;
  return normal.y() < 0 ? BoardTilt::UpperNearer : BoardTilt::LowerNearer;
}

std::array<int, 9> corners_by_part(const TargetMarks& marks, int width_px, int height_px) {
  std::array<int, 9> corners{};
  for (const TargetMark& mark : marks)
    for (const Eigen::Vector2d& px : mark.seen_px)
      ++corners.at(3 * third_of(px.y() / height_px) + third_of(px.x() / width_px));
  return corners;
}

void add_view(ViewCoverage& coverage, const TargetMarks& marks, const SE3& target_T_cam, int width_px,
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
    missing.push_back(
        fmt::format("tilt the board so that its {} edge is nearer to the camera", joined_by_or(edges)));
  std::vector<std::string> empty;
  for (std::size_t i = 0; i < coverage.corners.size(); ++i)
    if (coverage.corners.at(i) < options.corners_each_part) empty.emplace_back(image_part_names().at(i));
  if (!empty.empty())
    missing.push_back(fmt::format("hold the board in these parts of the image: {}", fmt::join(empty, ", ")));
  if (coverage.views < options.views)
    missing.push_back(
        fmt::format("take {} more views, nearer and further away", options.views - coverage.views));
  return missing;
}

}  // namespace waymark
