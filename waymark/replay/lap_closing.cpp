#include "waymark/replay/lap_closing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace waymark {
namespace {

double angle_between(double from, double to) {
  return std::abs(std::remainder(to - from, 2 * std::numbers::pi));
}

/// The direction driven about each point, over a distance that the noise of single points does not turn.
std::vector<double> directions(const std::vector<Eigen::Vector2d>& line, double step_m) {
  constexpr double kReachMetres = 0.25;
  const auto reach = static_cast<std::size_t>(std::max(1L, std::lround(kReachMetres / step_m)));
  std::vector<double> angles(line.size());
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d d = line[std::min(i + reach, line.size() - 1)] - line[i - std::min(i, reach)];
    angles[i] = std::atan2(d.y(), d.x());
  }
  return angles;
}

/// An even line with the directions of its points.
class DrivenLine {
 public:
  DrivenLine(const std::vector<Eigen::Vector2d>& line, double step_m, const LapClosing& closing)
      : line_(line), angles_(directions(line, step_m)), closing_(closing) {
    window_ = 1 + static_cast<std::size_t>(std::ceil(closing.distance_m / step_m));
  }

  /// Per visit of the start, in the direction of the start, the point nearest to it. The line leaves the
  /// start between two visits.
  [[nodiscard]] std::vector<std::size_t> returns() const {
    std::vector<std::size_t> all;
    bool left = false;
    double nearest_m = closing_.distance_m;
    for (std::size_t i = 1; i < line_.size(); ++i) {
      const double distance_m = (line_[i] - line_[0]).norm();
      if (distance_m > 2 * closing_.distance_m) {
        left = true;
        nearest_m = closing_.distance_m;
      }
      if (distance_m >= nearest_m || !same_direction(0, i)) continue;
      if (left)
        all.push_back(i);
      else if (!all.empty())
        all.back() = i;
      else
        continue;
      left = false;
      nearest_m = distance_m;
    }
    return all;
  }

  /// Whether the line from point `loop` on follows the points before it, from the first one. Departures that
  /// are shorter than the closing distance are noise, such as that of a trajectory by single tags.
  [[nodiscard]] bool rest_repeats(std::size_t loop) const {
    std::size_t at = 0;
    std::size_t departed = 0;  // points
    for (std::size_t i = loop; i < line_.size(); ++i) {
      const auto next = nearest_ahead(i, at, loop);
      departed = next ? 0 : departed + 1;
      if (departed > window_) return false;
      at = next ? *next : (at + 1) % loop;
    }
    return true;
  }

 private:
  [[nodiscard]] bool same_direction(std::size_t i, std::size_t j) const {
    return angle_between(angles_[i], angles_[j]) < closing_.angle_rad;
  }

  /// The point of the loop, from `at` on, that is nearest to point `i` and has its direction.
  [[nodiscard]] std::optional<std::size_t> nearest_ahead(std::size_t i, std::size_t at,
                                                         std::size_t loop) const {
    std::optional<std::size_t> nearest;
    double nearest_m = closing_.distance_m;
    for (std::size_t k = 0; k < std::min(window_, loop); ++k) {
      const std::size_t j = (at + k) % loop;
      const double distance_m = (line_[i] - line_[j]).norm();
      if (distance_m >= nearest_m || !same_direction(i, j)) continue;
      nearest = j;
      nearest_m = distance_m;
    }
    return nearest;
  }

  const std::vector<Eigen::Vector2d>& line_;
  std::vector<double> angles_;
  LapClosing closing_;
  std::size_t window_ = 0;  ///< points
};

}  // namespace

EvenLine even_steps(const std::vector<Eigen::Vector2d>& points, double step_m) {
  EvenLine even;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (even.points.empty()) {
      even.points.push_back(points[i]);
      even.sources.push_back(i);
    }
    while ((points[i] - even.points.back()).norm() >= step_m) {
      const Eigen::Vector2d last = even.points.back();
      even.points.emplace_back(last + (points[i] - last).normalized() * step_m);
      even.sources.push_back(i);
    }
  }
  return even;
}

std::optional<std::size_t> points_of_first_loop(const std::vector<Eigen::Vector2d>& even, double step_m,
                                                const LapClosing& closing) {
  if (even.size() < 2) return std::nullopt;
  const DrivenLine line(even, step_m, closing);
  for (const std::size_t loop : line.returns())
    if (line.rest_repeats(loop)) return loop;
  return std::nullopt;
}

}  // namespace waymark
