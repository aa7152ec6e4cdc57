#include "waymark/evaluation/motion_blur.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Dense>

#include "waymark/base/order_statistics.hpp"
#include "waymark/image/image.hpp"

namespace waymark {
namespace {

constexpr double kLeastCell_px = 5;
constexpr double kMaxReach_px = 8;
constexpr double kReachOfCell = 0.85;  // excludes the data bits and the area beyond the paper
constexpr double kStep_px = 0.5;
constexpr double kLeastContrast = 30;
constexpr double kSaturated = 250;  // a clipped step would appear steeper than it is
// Variance added by sampling between pixels, averaged over subpixel positions: 1/12 from the pixel area and
// 1/6 from linear interpolation.
constexpr double kSampling_px2 = 1.0 / 12 + 1.0 / 6;

const TagDetection* find(const TagFrame& frame, const TagId& tag) {
  const auto it = std::ranges::find(frame.detections, tag, &TagDetection::tag);
  return it == frame.detections.end() ? nullptr : &*it;
}

/// Grey levels across the edge, from `reach` inside to `reach` outside, averaged along the central part of
/// the edge.
std::vector<double> profile_across(const ImageView& image, const Eigen::Vector2d& from,
                                   const Eigen::Vector2d& to, const Eigen::Vector2d& outward,
                                   double reach_px) {
  const auto across = static_cast<std::size_t>(std::lround(2 * reach_px / kStep_px)) + 1;
  const int along = std::max(4, static_cast<int>(0.6 * (to - from).norm()));
  std::vector<double> levels(across, 0.0);
  for (int i = 0; i < along; ++i) {
    const Eigen::Vector2d middle = from + (0.2 + 0.6 * (i + 0.5) / along) * (to - from);
    for (std::size_t k = 0; k < across; ++k) {
      const Eigen::Vector2d at = middle + (static_cast<double>(k) * kStep_px - reach_px) * outward;
      levels[k] += sample_bilinear(image, at.x(), at.y()) / along;
    }
  }
  return levels;
}

/// Second central moment of the step, taken as a density over the distance from the edge. `nullopt` if there
/// is no step or it is outside the central part.
std::optional<double> variance_of_step(const std::vector<double>& levels, double reach_px) {
  const std::size_t n = levels.size();
  const double inside = (levels[0] + levels[1] + levels[2]) / 3;
  const double outside = (levels[n - 1] + levels[n - 2] + levels[n - 3]) / 3;
  if (outside - inside < kLeastContrast || std::ranges::max(levels) > kSaturated) return std::nullopt;
  double area = 0;
  double moment = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double d = static_cast<double>(k) * kStep_px - reach_px;
    const double weight = (k == 0 || k + 1 == n) ? kStep_px / 2 : kStep_px;  // trapezoidal rule
    const double share = (levels[k] - inside) / (outside - inside);
    area += weight * share;
    moment += weight * d * share;
  }
  // Integrals of d and d^2 times the slope, using integration by parts.
  const double mean = reach_px - area;
  const double variance = reach_px * reach_px - 2 * moment - mean * mean;
  const double most = reach_px / 2.2;  // wider steps are truncated
  if (std::abs(mean) > 1.5 || variance <= 0 || variance > most * most) return std::nullopt;
  return variance;
}

bool inside(const ImageView& image, const TagDetection& tag, double margin_px) {
  return std::ranges::all_of(tag.corners_px, [&](const Eigen::Vector2d& c) {
    return c.x() > margin_px && c.y() > margin_px && c.x() < image.width - margin_px &&
           c.y() < image.height - margin_px;
  });
}

}  // namespace

std::vector<EdgeBlur> edge_blurs(const ImageView& image, const TagFrame& before, const TagFrame& frame,
                                 const TagFrame& after) {
  std::vector<EdgeBlur> edges;
  const double apart_s = to_seconds(after.stamp - before.stamp);
  if (image.empty() || apart_s <= 0) return edges;
  for (const TagDetection& tag : frame.detections) {
    const TagDetection* first = find(before, tag.tag);
    const TagDetection* last = find(after, tag.tag);
    if (first == nullptr || last == nullptr || !tag.corners_px[0].allFinite()) continue;
    if (!usable_corners(*first) || !usable_corners(tag) || !usable_corners(*last)) continue;
    const Eigen::Vector2d centre =
        (tag.corners_px[0] + tag.corners_px[1] + tag.corners_px[2] + tag.corners_px[3]) / 4;
    for (std::size_t k = 0; k < 4; ++k) {
      const Eigen::Vector2d& from = tag.corners_px[k];
      const Eigen::Vector2d& to = tag.corners_px[(k + 1) % 4];
      const Eigen::Vector2d& beside = tag.corners_px[(k + 3) % 4];
      const double cell_px =
          std::min((to - from).norm(), (beside - from).norm()) / family(tag.tag.family).width_at_border;
      if (cell_px < kLeastCell_px) continue;
      const double reach_px =  // a multiple of the step, so that both ends are sampled in the same way
          kStep_px * std::floor(std::min(kReachOfCell * cell_px, kMaxReach_px) / kStep_px);
      if (!inside(image, tag, reach_px + 1)) continue;
      Eigen::Vector2d outward = Eigen::Vector2d(to.y() - from.y(), from.x() - to.x()).normalized();
      if (outward.dot((from + to) / 2 - centre) < 0) outward = -outward;
      const auto variance = variance_of_step(profile_across(image, from, to, outward, reach_px), reach_px);
      if (!variance) continue;
      const Eigen::Vector2d moved = (last->corners_px[k] + last->corners_px[(k + 1) % 4] -
                                     first->corners_px[k] - first->corners_px[(k + 1) % 4]) /
                                    2;
      edges.push_back({*variance, std::abs(moved.dot(outward)) / apart_s});
    }
  }
  return edges;
}

std::optional<BlurFit> fit_exposure(std::vector<EdgeBlur> edges) {
  constexpr std::size_t kClasses = 8;
  constexpr std::size_t kMinEdges = 200;
  constexpr double kLeastSmear_px2 = 0.02;
  if (edges.size() < kMinEdges) return std::nullopt;
  std::ranges::sort(edges, {}, &EdgeBlur::speed_px_s);
  std::array<double, kClasses> x{};  // v^2
  std::array<double, kClasses> y{};
  for (std::size_t c = 0; c < kClasses; ++c) {
    std::vector<double> squares;
    std::vector<double> variances;
    for (std::size_t i = c * edges.size() / kClasses; i < (c + 1) * edges.size() / kClasses; ++i) {
      squares.push_back(edges[i].speed_px_s * edges[i].speed_px_s);
      variances.push_back(edges[i].variance_px2);
    }
    x[c] = median(std::move(squares));
    y[c] = median(std::move(variances));
  }
  const auto mean = [](const std::array<double, kClasses>& values) {
    double sum = 0;
    for (const double value : values) sum += value / kClasses;
    return sum;
  };
  const double mean_x = mean(x);
  const double mean_y = mean(y);
  double xx = 0;
  double xy = 0;
  for (std::size_t c = 0; c < kClasses; ++c) {
    xx += (x[c] - mean_x) * (x[c] - mean_x);
    xy += (x[c] - mean_x) * (y[c] - mean_y);
  }
  const double slope = xx > 0 ? xy / xx : 0;
  if (slope * (x.back() - x.front()) < kLeastSmear_px2) return std::nullopt;
  const double still_px2 = mean_y - slope * mean_x - kSampling_px2;
  return BlurFit{.exposure_s = std::sqrt(12 * slope),
                 .still_sigma_px = std::sqrt(std::max(0.0, still_px2)),
                 .edges = static_cast<int>(edges.size())};
}

}  // namespace waymark
