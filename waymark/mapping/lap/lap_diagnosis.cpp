#include "waymark/mapping/lap/lap_diagnosis.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/dense.hpp"

namespace waymark::internal {

void check_regions(const BundleMap& map, std::vector<std::string>& words) {
  constexpr std::array<const char*, 9> kNames = {
      "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};
  constexpr int kEnough = 40;
  constexpr double kWorthSaying_px = 0.25;
  std::size_t worst = kNames.size();
  double farthest = kWorthSaying_px;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    const ResidualRegion& region = map.regions[i];
    const double off = region.mean_px.norm();
    if (region.corners < kEnough || off < farthest || off < 0.5 * region.rms_px) continue;
    worst = i;
    farthest = off;
  }
  constexpr double kFarWorse = 3;
  if (worst == kNames.size() && map.noise_ratio > kFarWorse)
    words.push_back(
        fmt::format("corners are {:.0f} times less exact than the detector says: is the calibration this "
                    "camera's, and are the tags flat? `waymark calibrate camera` measures it",
                    map.noise_ratio));
  if (worst == kNames.size()) return;
  const ResidualRegion& region = map.regions[worst];
  words.push_back(
      fmt::format("corners in the {} of the picture are all off by ({:+.2f}, {:+.2f}) px: is the calibration "
                  "this camera's? `waymark calibrate camera` measures it",
                  kNames[worst], -region.mean_px.x(), -region.mean_px.y()));
}

void check_line(const BundleMap& map, std::vector<std::string>& words) {
  constexpr double kNarrow = 0.03;
  if (map.map.tags.size() < 3) return;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& [id, tag] : map.map.tags)
    mean += tag.map_T_tag.translation() / static_cast<double>(map.map.tags.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& [id, tag] : map.map.tags) {
    const Eigen::Vector3d off = tag.map_T_tag.translation() - mean;
    scatter += off * off.transpose();
  }
  const Eigen::Vector3d spread = symmetric_eigenvalues<3>(scatter).cwiseMax(0.0).cwiseSqrt();
  if (spread[1] > kNarrow * spread[2]) return;
  words.emplace_back(
      "all tags stand on one line: the map may turn about it, and what lies across it is known badly; put "
      "one "
      "tag well aside");
}

void check_blindness(const LapInput& lap, const BundleMap& map, std::vector<std::string>& words) {
  constexpr double kLong_s = 2.0;
  std::set<std::pair<SensorTime, TagId>> rejected;
  for (const RejectedObservation& observation : map.rejected)
    rejected.insert({observation.stamp, observation.tag});
  std::optional<SensorTime> last;
  double longest = kLong_s;
  SensorTime from{};
  for (const TagFrame& frame : lap.frames) {
    const bool sees = std::ranges::any_of(frame.detections, [&](const TagDetection& seen) {
      return map.map.find(seen.tag) != nullptr && !rejected.contains({frame.stamp, seen.tag});
    });
    if (!sees) continue;
    if (last && to_seconds(frame.stamp - *last) > longest) {
      longest = to_seconds(frame.stamp - *last);
      from = *last;
    }
    last = frame.stamp;
  }
  if (longest <= kLong_s) return;
  words.push_back(
      fmt::format("no mapped tag was seen for {:.1f} s from {:.1f} s on: only the wheels say what is beyond; "
                  "was the camera "
                  "covered? Otherwise put a tag there",
                  longest, to_seconds(from - lap.frames.front().stamp)));
}

namespace {

/// "-12 mm forward (+- 4), ...": what of a mounting is off by more than chance and than what is printed.
std::vector<std::string> what_is_off(const MountingEstimate& mounting) {
  struct Number {
    double unit;
    int digits;
    const char* name;
  };
  constexpr double kDegrees = 180 / std::numbers::pi;
  constexpr std::array<Number, 6> kPrinted = {{{1000, 0, " mm forward"},
                                               {1000, 0, " mm to the left"},
                                               {1000, 0, " mm up"},
                                               {kDegrees, 1, " deg about the axis ahead"},
                                               {kDegrees, 1, " deg downwards"},
                                               {kDegrees, 1, " deg to the left"}}};
  std::vector<std::string> words;
  for (std::size_t i = 0; i < kPrinted.size(); ++i) {
    const Number& number = kPrinted[i];
    const double off = number.unit * mounting.off[static_cast<Eigen::Index>(i)];
    const double range = 2 * number.unit * mounting.sigma[static_cast<Eigen::Index>(i)];
    const double least = std::max(range, 1.5 * std::pow(10.0, -number.digits));
    if (mounting.untold[i] || std::abs(off) < least) continue;
    words.push_back(
        fmt::format("{:+.{}f}{} (+- {:.{}f})", off, number.digits, number.name, range, number.digits));
  }
  return words;
}

}  // namespace

void check_mounting(const BundleMap& map, std::vector<std::string>& words) {
  if (!map.mounting || !(map.mounting->stands_out() || map.mounting_used)) return;
  const std::vector<std::string> off = what_is_off(*map.mounting);
  if (!off.empty())
    words.push_back(fmt::format(
        "the camera seems to sit elsewhere than the robot's file says: {}{}", fmt::join(off, ", "),
        map.mounting_used ? ": taken into account, here and in the robot.yaml beside the map"
                          : "; it was not taken into account, `waymark calibrate robot` measures it"));
  if (!map.mounting_used) return;
  constexpr std::array<const char*, 6> kNames = {"how far forward", "how far to the left", "how high",
                                                 "its roll",        "its pitch",           "its yaw"};
  std::vector<const char*> untold;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if (map.mounting->untold[i]) untold.push_back(kNames[i]);
  }
  words.push_back(fmt::format(
      "of where the camera sits the lap does not tell {}: there the robot's file is trusted. Bends to both "
      "sides at two speeds tell all but the height",
      fmt::join(untold, ", ")));
}

}  // namespace waymark::internal
