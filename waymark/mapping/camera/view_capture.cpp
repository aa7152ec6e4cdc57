#include "waymark/mapping/camera/view_capture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/order_statistics.hpp"

namespace waymark {
namespace {

/// Contrast and steepest slope in the surroundings of a pixel; nothing at the border.
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
  constexpr int kFaint = 20;
  if (brightest - darkest < kFaint) return std::nullopt;
  return (brightest - darkest) / (steepest * std::sqrt(2 * std::numbers::pi));
}

std::size_t corners_of(const TargetPicture& marks) {
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
      return "the picture is blurred: more light, or focus";
    case CaptureVerdict::Known:
      return "move on: this view is there";
    case CaptureVerdict::New:
      return "taken";
  }
  return "";
}

std::optional<double> edge_width_px(const ImageView& image, const TargetPicture& marks) {
  std::vector<double> widths;
  for (const TargetMark& mark : marks)
    for (const Eigen::Vector2d& px : mark.seen_px)
      if (const auto width = width_at(image, px)) widths.push_back(*width);
  if (widths.empty()) return std::nullopt;
  return median(std::move(widths));
}

bool ViewCapture::still(SensorTime stamp, const TargetPicture& marks) {
  constexpr int kTimes = 2;
  const double dt_s = std::max(to_seconds(stamp - last_stamp_), 1e-6);
  const bool slow = !last_.empty() && apart_px(last_, marks) <= options_.still_px_s * dt_s;
  last_ = marks;
  last_stamp_ = stamp;
  still_times_ = slow ? still_times_ + 1 : 0;
  return still_times_ >= kTimes;
}

CaptureVerdict ViewCapture::take(SensorTime stamp, const ImageView& image, const TargetPicture& marks) {
  const bool stands = still(stamp, marks);
  if (marks.empty()) return CaptureVerdict::NoTarget;
  if (corners_of(marks) < static_cast<std::size_t>(options_.fewest_corners)) return CaptureVerdict::TooFew;
  const double far_px = options_.new_share * std::hypot(image.width, image.height);
  const bool is_new =
      std::ranges::all_of(views_, [&](const TargetPicture& view) { return apart_px(view, marks) > far_px; });
  if (!is_new) return CaptureVerdict::Known;
  if (!stands) return CaptureVerdict::Moving;
  const auto width = edge_width_px(image, marks);
  if (!width || *width > options_.widest_edge_px) return CaptureVerdict::Blurred;
  views_.push_back(marks);
  return CaptureVerdict::New;
}

}  // namespace waymark
