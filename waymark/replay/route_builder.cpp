#include "waymark/replay/route_builder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>
#include <Eigen/SparseCholesky>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

double angle_between(double from, double to) {
  return std::abs(std::remainder(to - from, 2 * std::numbers::pi));
}

/// Driving direction at each point, taken over a distance long enough to average out the noise of single
/// points.
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

/// An evenly spaced line and its directions.
class DrivenLine {
 public:
  DrivenLine(const std::vector<Eigen::Vector2d>& line, double step_m, const LapClosing& closing)
      : line_(line), angles_(directions(line, step_m)), closing_(closing) {
    window_ = 1 + static_cast<std::size_t>(std::ceil(closing.distance_m / step_m));
  }

  /// For each time the line comes back to its start in the original direction, the point nearest to the
  /// start. The line moves away from the start in between.
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

  /// Whether the line from point `loop` onwards follows the points from the first one onwards. Deviations
  /// shorter than the closing distance are treated as noise, for example in a trajectory from single tags.
  [[nodiscard]] bool rest_repeats(std::size_t loop) const {
    std::size_t at = 0;
    std::size_t departed = 0;  // in points
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

  /// The point on the loop, from `at` onwards, that is nearest to point `i` and has the same direction.
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
  std::size_t window_ = 0;  ///< in points
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

namespace waymark::internal {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

/// Adds weight * |difference of `row` at point i|^2 to the normal equations.
template <std::size_t N>
void add_rows(Triplets& triplets, const std::array<double, N>& row, std::ptrdiff_t n, bool closed,
              const std::vector<double>& weight) {
  const auto width = static_cast<std::ptrdiff_t>(N);
  for (std::ptrdiff_t i = 0; i < (closed ? n : n - width + 1); ++i) {
    for (std::ptrdiff_t a = 0; a < width; ++a) {
      for (std::ptrdiff_t b = 0; b < width; ++b) {
        triplets.emplace_back((i + a) % n, (i + b) % n,
                              weight[static_cast<std::size_t>(i)] * row[static_cast<std::size_t>(a)] *
                                  row[static_cast<std::size_t>(b)]);
      }
    }
  }
}

Line solve(const Line& line, bool closed, const std::vector<double>& third,
           const std::vector<double>& second) {
  const auto n = static_cast<std::ptrdiff_t>(line.size());
  Triplets triplets;
  triplets.reserve(line.size() * 26);
  Eigen::MatrixX2d b(n, 2);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    // The ends of an open line are where the robot was deliberately placed, so they have ten times the weight
    // of other points.
    const double weight = !closed && (i == 0 || i + 1 == n) ? 10.0 : 1.0;
    triplets.emplace_back(i, i, weight);
    b.row(i) = weight * line[static_cast<std::size_t>(i)].transpose();
  }
  add_rows(triplets, std::array<double, 4>{-1, 3, -3, 1}, n, closed, third);
  add_rows(triplets, std::array<double, 3>{1, -2, 1}, n, closed, second);
  Sparse A(n, n);
  A.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::SimplicialLDLT<Sparse> factors(A);
  const Eigen::MatrixX2d x = factors.solve(b);
  Line result(line.size());
  for (std::ptrdiff_t i = 0; i < n; ++i) result[static_cast<std::size_t>(i)] = x.row(i).transpose();
  return result;
}

}  // namespace

std::vector<double> curvatures(const Line& line, bool closed) {
  const std::size_t n = line.size();
  std::vector<double> all(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    if (!closed && (i == 0 || i + 1 == n)) continue;
    const Eigen::Vector2d a = line[i] - line[(i + n - 1) % n];
    const Eigen::Vector2d b = line[(i + 1) % n] - line[i];
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    all[i] = turn / std::max((a.norm() + b.norm()) / 2, 1e-9);
  }
  if (!closed && n > 2) {
    all.front() = all[1];
    all.back() = all[n - 2];
  }
  return all;
}

Line smooth_line(const Line& line, bool closed, double step_m, double wave_m, double max_curvature_1_m) {
  constexpr int kRounds = 25;
  if (line.size() < 8 || wave_m < 2 * step_m) return line;
  const double third = std::pow(wave_m / (2 * std::numbers::pi * step_m), 6);
  const std::vector<double> thirds(line.size(), third);
  std::vector<double> seconds(line.size(), 0);
  Line result = solve(line, closed, thirds, seconds);
  if (max_curvature_1_m <= 0) return result;
  const std::size_t n = line.size();
  for (int round = 0; round < kRounds; ++round) {
    bool straight_enough = true;
    const std::vector<double> bent = curvatures(result, closed);
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(bent[i]) <= max_curvature_1_m * 0.99) continue;
      straight_enough = straight_enough && std::abs(bent[i]) <= max_curvature_1_m;
      const std::size_t row = (i + n - 1) % n;  // the row centred on this point
      seconds[row] = std::max(1.0, 1.5 * seconds[row]);
    }
    if (straight_enough) break;
    result = solve(line, closed, thirds, seconds);
  }
  return result;
}

}  // namespace waymark::internal

namespace waymark {
namespace {

using internal::Line;

double heading(const Line& line, std::size_t i, bool closed) {
  const std::size_t n = line.size();
  const std::size_t before = i > 0 ? i - 1 : (closed ? n - 1 : 0);
  const std::size_t after = i + 1 < n ? i + 1 : (closed ? 0 : n - 1);
  const Eigen::Vector2d d = line[after] - line[before];
  return std::atan2(d.y(), d.x());
}

Eigen::Vector2d sideways_gap(const Line& line) {
  const Eigen::Vector2d along = (line[1] - line[0]).normalized();
  const Eigen::Vector2d gap = line.front() - line.back();
  return gap - gap.dot(along) * along;
}

/// Closes the sideways gap between the end and the start of a lap gradually over one metre, so that the route
/// closes without a step. If the lap continued beyond its start, the correction is spread over the overlap,
/// since both passes were taught. Otherwise the end of the lap is moved. Along the route, only the length of
/// the last segment changes.
void close_gap(Line& line, double step_m, std::size_t overlap) {
  constexpr std::size_t kLeastOverlap = 4;
  if ((line.front() - line.back()).norm() < step_m / 3) line.pop_back();
  const Eigen::Vector2d sideways = sideways_gap(line);
  auto spread = std::min<std::size_t>(line.size() / 2, static_cast<std::size_t>(std::lround(1.0 / step_m)));
  const bool overlaps = overlap >= kLeastOverlap;
  if (overlaps) spread = std::min(spread, overlap);
  for (std::size_t k = 0; k < spread; ++k) {
    const double along = static_cast<double>(k) / static_cast<double>(spread);
    const double share = 0.5 * (1 + std::cos(std::numbers::pi * along));
    if (overlaps)
      line[k] -= share * sideways;
    else
      line[line.size() - 1 - k] += share * sideways;
  }
}

/// Moves every point on the line to the mean of the nearest driven points, so that all of them contribute,
/// not only those at the end of a step. Points are matched in order, so a line may cross itself.
Line average_onto(const Line& line, const Line& driven) {
  Line sum(line.size(), Eigen::Vector2d::Zero());
  std::vector<double> count(line.size(), 0);
  std::size_t i = 0;
  for (const auto& point : driven) {
    while (i + 1 < line.size() && (line[i + 1] - point).norm() < (line[i] - point).norm()) ++i;
    sum[i] += point;
    count[i] += 1;
  }
  for (std::size_t k = 0; k < line.size(); ++k)
    sum[k] = count[k] > 0 ? Eigen::Vector2d(sum[k] / count[k]) : line[k];
  return sum;
}

/// A part of the drive in which the direction does not change.
struct Leg {
  std::vector<SE2> driven{};
  bool backwards = false;
};

Line positions(const std::vector<SE2>& poses) {
  Line line;
  line.reserve(poses.size());
  for (const SE2& pose : poses) line.push_back(pose.translation());
  return line;
}

/// Displacement of the robot in its own frame since the first pose, x forward and y left, at every pose.
Line motion_in_base(const std::vector<SE2>& driven) {
  Line moved(driven.size(), Eigen::Vector2d::Zero());
  for (std::size_t k = 1; k < driven.size(); ++k) {
    const SE2 step = driven[k - 1].inverse() * driven[k];
    moved[k] =
        moved[k - 1] + SO2(-step.yaw() / 2) * step.translation();  // the frame halfway through the step
  }
  return moved;
}

/// How far a robot moved from one pose to another. `turned_m` is how far it moves in such a turn on a circle
/// of the largest radius that counts as a turn on the spot.
struct MovedAndTurned {
  double moved_m = 0;
  double turned_m = 0;

  MovedAndTurned(const SE2& from, const SE2& to) {
    constexpr double kTurnRadius_m = 0.25;
    const SE2 step = from.inverse() * to;
    moved_m = step.translation().norm();
    turned_m = std::abs(step.yaw()) * kTurnRadius_m;
  }
};

/// The first poses of parts in which the robot moved or turned noticeably, and the last pose.
std::vector<std::size_t> parts_of(const std::vector<SE2>& driven) {
  constexpr double kPart_m = 0.03;  // longer than the noise of poses
  std::vector<std::size_t> parts{0};
  for (std::size_t k = 1; k < driven.size(); ++k) {
    const MovedAndTurned part(driven[parts.back()], driven[k]);
    if (std::max(part.moved_m, part.turned_m) >= kPart_m || k + 1 == driven.size()) parts.push_back(k);
  }
  return parts;
}

/// The displacement of motion_in_base() without turns on the spot. If the centre of rotation is not the base
/// origin, such a turn moves the base sideways. Each part is judged together with its neighbours.
Line motion_without_turns(const std::vector<SE2>& driven) {
  const Line moved = motion_in_base(driven);
  const std::vector<std::size_t> parts = parts_of(driven);
  Line without = moved;
  for (std::size_t p = 0; p + 1 < parts.size(); ++p) {
    const MovedAndTurned around(driven[parts[p > 0 ? p - 1 : p]],
                                driven[parts[std::min(p + 2, parts.size() - 1)]]);
    const double share = around.turned_m > around.moved_m ? 0 : 1;
    for (std::size_t k = parts[p] + 1; k <= parts[p + 1]; ++k)
      without[k] = without[k - 1] + share * (moved[k] - moved[k - 1]);
  }
  return without;
}

/// Whether the robot moved more to the side than back or forth from one pose on.
bool moved_sideways(const std::vector<SE2>& driven, std::size_t from) {
  const std::vector<SE2> part(driven.begin() + static_cast<std::ptrdiff_t>(from), driven.end());
  return std::abs(motion_without_turns(part).back().y()) > std::abs(motion_in_base(part).back().x());
}

/// Splits the drive where the robot reversed. A few centimetres in the opposite direction are taken to be
/// unintentional.
std::vector<Leg> legs_of(const Trajectory& trajectory) {
  constexpr double kReversedMetres = 0.10;
  std::vector<Leg> legs(1);
  double reversed_m = 0;
  std::size_t reversed_from = 0;  // index at which the current leg began to move in the opposite direction
  bool known = false;
  for (const StampedPose& pose : trajectory) {
    const SE2 map_T_base = project_to_plane(pose.map_T_base);
    Leg& leg = legs.back();
    if (!leg.driven.empty()) {
      const double moved = motion_in_base({leg.driven.back(), map_T_base}).back().x();
      if (reversed_m <= 0) reversed_from = leg.driven.size() - 1;
      reversed_m = std::max(0.0, reversed_m + (leg.backwards ? moved : -moved));
    }
    leg.driven.push_back(map_T_base);
    if (reversed_m < kReversedMetres) continue;
    reversed_m = 0;
    // A leg that moves sideways is not cut, but no backward leg leads forwards (a route file must not).
    if (!leg.backwards && moved_sideways(leg.driven, reversed_from)) continue;
    const bool backwards = !leg.backwards;
    if (!known && legs.size() == 1 && reversed_from == 0) {
      leg.backwards = backwards;
    } else {
      Leg next{.driven = {leg.driven.begin() + static_cast<std::ptrdiff_t>(reversed_from), leg.driven.end()},
               .backwards = backwards};
      leg.driven.resize(reversed_from + 1);
      legs.push_back(std::move(next));
    }
    known = true;
  }
  return legs;
}

/// The step length that half of the distance is covered with; standstills and jumps hardly affect it.
double usual_step_m(std::vector<double> steps_m) {
  std::ranges::sort(steps_m);
  double left_m = std::accumulate(steps_m.begin(), steps_m.end(), 0.0) / 2;
  for (const double step_m : steps_m) {
    left_m -= step_m;
    if (left_m <= 0) return step_m;
  }
  return 0;
}

/// Removes jumps of the trajectory, which are not motion of the robot, and parts without poses, in which the
/// direction of motion relative to the robot is unknown. A faster part consists of several long steps.
Line without_jumps(const Line& moved) {
  constexpr double kMaxOfUsualStep = 4;
  std::vector<double> steps_m;
  for (std::size_t k = 1; k < moved.size(); ++k) steps_m.push_back((moved[k] - moved[k - 1]).norm());
  const double usual_m = usual_step_m(steps_m);
  Line kept = moved;
  for (std::size_t k = 1; k < moved.size(); ++k) {
    const double before_m = k > 1 ? steps_m[k - 2] : 0;
    const double after_m = k < steps_m.size() ? steps_m[k] : 0;
    const bool jumped = steps_m[k - 1] > kMaxOfUsualStep * std::max({usual_m, before_m, after_m});
    kept[k] = jumped ? kept[k - 1] : Eigen::Vector2d(kept[k - 1] + moved[k] - moved[k - 1]);
  }
  return kept;
}

/// The taught heading relative to a robot that follows the line without moving sideways, at each point of the
/// line: the angle of the motion in the base frame over a distance long enough to average out noise.
std::vector<double> taught_angles(const Leg& leg, const EvenLine& even, double step_m) {
  constexpr double kReach_m = 0.25;
  constexpr double kMinMoved_m = 0.1;  // a shorter displacement has no certain direction
  const auto reach = static_cast<std::size_t>(std::max(1L, std::lround(kReach_m / step_m)));
  const Line moved = without_jumps(motion_without_turns(leg.driven));
  const std::size_t n = even.sources.size();
  std::vector<double> angles(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t from = even.sources[i - std::min(i, reach)];
    const std::size_t to = even.sources[std::min(i + reach, n - 1)];
    Eigen::Vector2d d = (leg.backwards ? -1 : 1) * (moved[to] - moved[from]);
    if (leg.backwards) d.x() = std::max(d.x(), 0.0);  // a few unintentional centimetres; see legs_of()
    if (d.norm() >= kMinMoved_m) angles[i] = -std::atan2(d.y(), d.x());
  }
  return angles;
}

/// Appends a leg to the points of the route. `angles` are those of taught_angles().
void append(Route& route, const Line& line, const std::vector<double>& angles, bool closed,
            double signed_speed_m_s) {
  const bool backwards = signed_speed_m_s < 0;
  const std::vector<double> bent = internal::curvatures(line, closed);
  const double begin = route.points.empty() ? 0 : route.points.back().arc_length_m;
  double arc = begin;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Eigen::Vector2d before =
        i > 0 ? line[i - 1] : (route.points.empty() ? line[0] : route.points.back().map_T_base.translation());
    arc += (line[i] - before).norm();
    const double yaw = heading(line, i, closed) + (backwards ? std::numbers::pi : 0.0) + angles[i];
    route.points.push_back({.map_T_base = SE2(line[i].x(), line[i].y(), yaw),
                            .arc_length_m = arc,
                            .curvature_1_m = bent[i],
                            .speed_m_s = signed_speed_m_s});
  }
  route.length_m = closed ? arc + (line.front() - line.back()).norm() : arc;
}

}  // namespace

Result<BuiltRoute> build_route(const Trajectory& trajectory, const RouteOptions& options) {
  if (Status status = check_ranges(options); !status) return tl::unexpected(status.error());
  const std::vector<Leg> legs = legs_of(trajectory);
  const LapClosing closing{options.closing_distance_m, options.closing_angle_rad};
  BuiltRoute route;
  double driven_m = 0;
  for (const Leg& leg : legs) {
    const Line driven = positions(leg.driven);
    const EvenLine even = even_steps(driven, options.step_m);
    driven_m += static_cast<double>(even.points.size()) * options.step_m;
    if (even.points.size() < 3) continue;
    Line line = average_onto(even.points, driven);
    std::vector<double> angles = taught_angles(leg, even, options.step_m);
    const auto loop = legs.size() == 1 ? points_of_first_loop(line, options.step_m, closing) : std::nullopt;
    if (loop) {
      const std::size_t overlap = line.size() - *loop;
      route.repeated_m = static_cast<double>(overlap) * options.step_m;
      line.resize(*loop);
      close_gap(line, options.step_m, overlap);
    }
    route.closed = loop.has_value();
    line = internal::smooth_line(line, route.closed, options.step_m, options.smoothing_m,
                                 options.max_curvature_1_m);
    // A leg begins at the end of the previous one, so its first point already exists.
    if (!route.points.empty()) {
      line.erase(line.begin());
      angles.erase(angles.begin());
    }
    append(route, line, angles, route.closed, leg.backwards ? -options.speed_m_s : options.speed_m_s);
  }
  if (driven_m < 0.5 || route.points.size() < 2) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the lap of {:.2f} m is too short for a route", driven_m), {},
                "Drive at least 0.5 m.");
  }
  return route;
}

double longest_without_tags_m(const Trajectory& lap, const std::vector<TagFrame>& frames, const TagMap& map) {
  const auto sees_tag = [&](SensorTime stamp) {
    const auto at_once = std::ranges::equal_range(frames, stamp, {}, &TagFrame::stamp);
    return std::ranges::any_of(at_once, [&](const TagFrame& frame) {
      return std::ranges::any_of(frame.detections, [&](const TagDetection& seen) {
        return usable_corners(seen) && map.find(seen.tag) != nullptr;
      });
    });
  };
  double longest = 0;
  double since = 0;
  for (std::size_t i = 1; i < lap.size(); ++i) {
    since += (lap[i].map_T_base.translation() - lap[i - 1].map_T_base.translation()).norm();
    longest = std::max(longest, since);
    if (sees_tag(lap[i].stamp)) since = 0;
  }
  return longest;
}

double longest_without_tags_m(const Route& route, const TagMap& map,
                              const std::vector<MountedCamera>& cameras) {
  double longest = 0;
  double seen_at = 0;
  const SE3 map_T_level = map_T_floor(map.floor);
  for (const RoutePoint& point : route.points) {
    longest = std::max(longest, point.arc_length_m - seen_at);
    const SE3 map_T_base = map_T_level * lift(point.map_T_base);
    const bool seen = std::ranges::any_of(cameras, [&](const MountedCamera& each) {
      return !visible_tags(map, each.camera, map_T_base * each.base_T_cam).empty();
    });
    if (seen) seen_at = point.arc_length_m;
  }
  return std::max(longest, route.length_m - seen_at);
}

}  // namespace waymark
