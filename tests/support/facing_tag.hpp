#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "waymark/base/random.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark::testing {

using Corners = std::array<Eigen::Vector2d, 4>;
using Vector8 = Eigen::Matrix<double, 8, 1>;

/// A frontal tag with a Gaussian lens blur: exact up to the sampling of the pixel's square.
struct Print {
  TagId tag = {FamilyId::Tag36h11, 7};
  Eigen::Vector2d center_px = {60.3, 59.6};
  double side_px = 40;  ///< of the border square
  double roll_rad = 0.3;
  double lens_px = 0.6;  ///< standard deviation of the lens
  double black = 40;
  double white = 200;
  double behind = 110;  ///< level of the background behind the paper
  double noise = 0;
  double margin_cells = 0;  ///< paper beyond the tag's own total width
  int image_px = 120;
};

inline Corners corners_of(const Print& print) {
  const Eigen::Rotation2Dd turn(print.roll_rad);
  const double half = print.side_px / 2;
  return {print.center_px + turn * Eigen::Vector2d(-half, -half),
          print.center_px + turn * Eigen::Vector2d(half, -half),
          print.center_px + turn * Eigen::Vector2d(half, half),
          print.center_px + turn * Eigen::Vector2d(-half, half)};
}

inline double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Shares of a blurred point in the cells [begin, end) along one axis; in every other cell the share is below
/// 1e-18.
struct CellShares {
  static constexpr int kMaxCells = 16;  ///< no family is wider
  int begin = 0;
  int end = 0;
  std::array<double, kMaxCells> of{};
};

/// For `count` cells, of which the first begins at `first`.
inline CellShares cell_shares(double at, double first, int count, double sigma) {
  constexpr double kReach = 9;  // standard deviations
  const auto most = static_cast<double>(count);
  const double from = std::clamp(std::floor(at - first - kReach * sigma), 0.0, most);
  const double to = std::clamp(std::ceil(at - first + kReach * sigma), 0.0, most);
  CellShares shares{.begin = static_cast<int>(from), .end = static_cast<int>(to)};
  double below = normal_cdf((first + shares.begin - at) / sigma);
  for (int i = shares.begin; i < shares.end; ++i) {
    const double upto = normal_cdf((first + i + 1 - at) / sigma);
    shares.of.at(static_cast<std::size_t>(i)) = upto - below;
    below = upto;
  }
  return shares;
}

class Renderer {
 public:
  explicit Renderer(const Print& print)
      : print_(print), family_(family(print.tag.family)), cells_(bitmap(print.tag)) {
    cell_px_ = print.side_px / family_.width_at_border;
    ring_ = (family_.total_width - family_.width_at_border) / 2;
  }

  [[nodiscard]] double at(const Eigen::Vector2d& px) const {
    const Eigen::Vector2d local = Eigen::Rotation2Dd(-print_.roll_rad) * (px - print_.center_px) / cell_px_ +
                                  Eigen::Vector2d::Constant(family_.width_at_border / 2.0);
    const double sigma = print_.lens_px / cell_px_;
    const int width = family_.total_width;
    const CellShares x = cell_shares(local.x(), -ring_, width, sigma);
    const CellShares y = cell_shares(local.y(), -ring_, width, sigma);
    const double paper = paper_share(local.x(), sigma) * paper_share(local.y(), sigma);
    double level = print_.behind + paper * (print_.white - print_.behind);
    for (int row = y.begin; row < y.end; ++row) {
      for (int column = x.begin; column < x.end; ++column) {
        const bool ink = cells_[static_cast<std::size_t>(row * width + column)] == 0;
        if (ink)
          level += x.of[static_cast<std::size_t>(column)] * y.of[static_cast<std::size_t>(row)] *
                   (print_.black - print_.white);
      }
    }
    return level;
  }

 private:
  [[nodiscard]] double paper_share(double at, double sigma) const {
    const double first = -ring_ - print_.margin_cells;
    const double last = family_.width_at_border - first;
    return normal_cdf((last - at) / sigma) - normal_cdf((first - at) / sigma);
  }

  Print print_;
  const Family& family_;
  std::vector<std::uint8_t> cells_;
  double cell_px_ = 1;
  double ring_ = 1;
};

inline Image render(const Print& print, std::uint64_t seed = 1) {
  const Renderer renderer(print);
  Random random(seed);
  Image image(print.image_px, print.image_px);
  constexpr int kSamples = 3;  // Gauss-Legendre nodes of the unit interval
  constexpr std::array<double, kSamples> kNodes = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr std::array<double, kSamples> kWeights = {5.0 / 18, 8.0 / 18, 5.0 / 18};
  for (int y = 0; y < print.image_px; ++y) {
    for (int x = 0; x < print.image_px; ++x) {
      double level = 0;
      for (std::size_t i = 0; i < kSamples; ++i) {
        for (std::size_t j = 0; j < kSamples; ++j) {
          level += kWeights.at(i) * kWeights.at(j) * renderer.at({x + kNodes.at(i), y + kNodes.at(j)});
        }
      }
      level += print.noise * random.normal();
      image.row(y)[x] = static_cast<std::uint8_t>(std::clamp(std::floor(level + 0.5), 0.0, 255.0));
    }
  }
  return image;
}

inline TagDetection detection_at(const Print& print, double error_px, Random& random) {
  TagDetection detection;
  detection.tag = print.tag;
  detection.corners_px = corners_of(print);
  for (auto& corner : detection.corners_px)
    corner += error_px * Eigen::Vector2d(random.normal(), random.normal());
  return detection;
}

inline double worst_error(const Corners& found, const Print& print) {
  const Corners truth = corners_of(print);
  double worst = 0;
  for (std::size_t k = 0; k < 4; ++k) worst = std::max(worst, (found[k] - truth[k]).norm());
  return worst;
}

/// Normalised error squared of all four corners; 8 on average if the covariance is consistent.
inline double nees(const Corners& found, const CornerCovariance& covariance, const Print& print) {
  const Corners truth = corners_of(print);
  Vector8 error;
  for (std::size_t k = 0; k < 4; ++k)
    error.segment<2>(2 * static_cast<Eigen::Index>(k)) = found[k] - truth[k];
  return error.dot(covariance.llt().solve(error));
}

}  // namespace waymark::testing
