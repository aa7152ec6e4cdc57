#include "waymark/runtime/commission_lines.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "waymark/runtime/commission_class.hpp"

namespace waymark {
namespace {

using V = CommissionVerdict;
using Lines = std::vector<CommissionLine>;

constexpr double kSettle_s = 0.6;

/// The words of one axis of the commands.
struct Axis {
  const char* command;  ///< key of the command
  const char* unit;
  const char* does;  ///< what was commanded
  double asked;
};

bool still(const MotionReading& reading) { return classify(reading).kind == ReadingClass::Kind::Still; }

/// Noise and drift are less, whatever was commanded.
bool hardly(const MotionReading& reading) {
  constexpr double kHardly = 0.1;
  return std::abs(reading.ratio) < kHardly;
}

bool all_still(const std::vector<MotionReading>& readings) {
  return !readings.empty() && std::ranges::all_of(readings, still);
}

std::string mend_of(const MotionReading& reading) {
  if (reading.origin == "tags") return "camera_mounting, camera_info and --tag-size-m";
  if (reading.origin == "wheels")
    return "wheels.radius_m, wheels.track_m, or left_rad and right_rad of the messages";
  return reading.key + " of the robot's messages";
}

CommissionLine line_of(const MotionReading& reading, const Axis& axis, const ReadingVerdict& all,
                       bool command_right) {
  const ReadingClass found = classify(reading);
  const std::string measured = fmt::format("{:.3g} {}", reading.measured, axis.unit);
  CommissionLine line{.key = reading.key, .words = measured};
  if (all.command_wrong && !command_right) return line;
  if (!found.right()) {
    line.verdict = V::Fail;
    line.words = fmt::format("{} {}: {} while {} {} were commanded", reading.key, words_of(found), measured,
                             axis.asked, axis.unit);
    line.mend = mend_of(reading);
    if (all.either && !command_right)
      line.words +=
          fmt::format("; or {} is, as nothing else measured it: see which way it went", axis.command);
    return line;
  }
  const double off = reading.ratio / all.size - 1;
  constexpr double kFar = 0.15;
  const bool skids = reading.origin == "wheels" && axis.asked != 0 && std::string_view(axis.unit) == "rad/s";
  if (std::abs(off) > kFar && !skids) {
    line.verdict = V::Warn;
    line.words += fmt::format(", {:+.0f} % from the others", 100 * off);
    line.mend = reading.origin == "odometry" ? "waymark calibrate robot" : mend_of(reading);
  }
  return line;
}

CommissionLine command_line(const std::vector<MotionReading>& readings, const Axis& axis,
                            const ReadingVerdict& all, Seen seen) {
  CommissionLine line{.key = axis.command, .words = fmt::format("{} as commanded", axis.does)};
  if (readings.empty())
    return {axis.command, V::Warn, "nothing measured it", "odometry of the robot's messages"};
  const bool wrong = seen ? !*seen : all.command_wrong;
  if (wrong) {
    const std::string said = words_of(classify(readings.front()));
    line.verdict = V::Fail;
    line.words = fmt::format(
        "{} {}: {} {} were commanded, and {}", axis.command, said.empty() ? "is wrong" : said, axis.asked,
        axis.unit, seen ? "a person saw another motion" : "all that measures agrees in another motion");
    line.mend = std::string(axis.command) + " where the robot's program obeys it";
    return line;
  }
  constexpr double kFar = 0.1;
  if (std::abs(all.size - 1) <= kFar) return line;
  line.verdict = V::Warn;
  line.words = fmt::format("{} by {:.2f} of what was commanded", axis.does, all.size);
  line.mend = std::string(axis.command) + " where the robot's program obeys it";
  if (std::string_view(axis.command) == "command.yaw_rate_rad_s")
    line.mend += "; a replay learns this factor";
  return line;
}

/// Command and readings of one axis.
Lines judge_axis(const std::vector<MotionReading>& readings, const Axis& axis, Seen seen) {
  const ReadingVerdict all = compare(readings);
  Lines lines = {command_line(readings, axis, all, seen)};
  for (const MotionReading& reading : readings) lines.push_back(line_of(reading, axis, all, seen && *seen));
  return lines;
}

/// Whether the other axis moved where this one stands still: the two are swapped, in the command where all
/// agree, else in the odometry.
void find_swap(const std::vector<MotionReading>& asked, const std::vector<MotionReading>& other,
               const Axis& axis, Lines& lines) {
  const auto moved = [&](const char* key) {
    return std::ranges::any_of(other,
                               [&](const MotionReading& r) { return r.key.starts_with(key) && !hardly(r); });
  };
  if (!asked.empty() && std::ranges::all_of(asked, hardly) && moved("")) {
    lines.front().verdict = V::Fail;
    lines.front().words = fmt::format(
        "command.speed_m_s and command.yaw_rate_rad_s are swapped: {} was commanded, and the robot did the "
        "other",
        axis.command);
    lines.front().mend = std::string(axis.command) + " where the robot's program obeys it";
    lines.resize(1);  // what is said of the sensors follows from it
    return;
  }
  for (CommissionLine& line : lines) {
    const bool twist = line.key == "odometry.speed_m_s" || line.key == "odometry.yaw_rate_rad_s";
    const char* partner = line.key == "odometry.speed_m_s" ? "odometry.yaw_rate_rad_s" : "odometry.speed_m_s";
    const bool stood =
        std::ranges::any_of(asked, [&](const MotionReading& r) { return r.key == line.key && hardly(r); });
    if (twist && stood && moved(partner)) line.words += fmt::format("; it and {} are swapped", partner);
  }
}

std::vector<MotionReading> without(std::vector<MotionReading> readings, std::string_view origin) {
  std::erase_if(readings, [&](const MotionReading& r) { return r.origin == origin; });
  return readings;
}

/// The same readings against another number.
std::vector<MotionReading> relative_to(std::vector<MotionReading> readings, double asked) {
  for (MotionReading& reading : readings) reading.ratio = reading.measured / asked;
  return readings;
}

std::vector<MotionReading> counted(std::vector<MotionReading> readings, Ground ground) {
  return ground == Ground::Floor ? readings : without(without(std::move(readings), "tags"), "imu");
}

/// A robot that measures itself alone cannot be wrong by its own word.
void miss_tags(const std::vector<MotionReading>& readings, Ground ground, Lines& lines) {
  if (ground == Ground::Lifted || without(readings, "tags").size() < readings.size()) return;
  lines.push_back({"tags", V::Warn,
                   "no tag was in view all the while: there is no source but what the robot measures itself",
                   "a tag ahead of the robot, and --tag-size-m"});
}

/// In a straight motion both sides turn forward.
void judge_sides(const MotionTrace& steady, const RobotModel& model, Lines& lines) {
  const auto rates = wheel_rates(steady);
  if (!rates) return;
  const Eigen::Vector2d ratios = *rates * model.wheel_radius_m / steady.commanded.speed_m_s;
  for (const auto& [key, ratio, other] : {std::tuple{"wheels.left_rad", ratios.x(), ratios.y()},
                                          {"wheels.right_rad", ratios.y(), ratios.x()}}) {
    if (ratio >= 0 || other <= 0) continue;
    std::erase_if(lines, [](const CommissionLine& line) { return line.key == "wheels"; });
    lines.push_back({key, V::Fail,
                     fmt::format("{} is reversed: it turns backward while the robot drives forward", key),
                     std::string(key) + " of the robot's messages"});
  }
}

/// A turn is about z.
void judge_gyro_axes(const MotionTrace& steady, const MotionTrace& standing, Lines& lines) {
  const auto gyro = rotation_by_gyro(steady, standing);
  constexpr double kShare = 0.2;
  if (!gyro) return;
  for (const auto& [name, rate] : {std::pair{"x", gyro->x()}, {"y", gyro->y()}}) {
    if (std::abs(rate) < kShare * std::abs(steady.commanded.yaw_rate_rad_s) ||
        std::abs(rate) < 2 * std::abs(gyro->z()))
      continue;
    for (CommissionLine& line : lines) {
      if (line.key == "imu.angular_velocity_rad_s")
        line = {line.key, V::Fail,
                fmt::format(
                    "imu.angular_velocity_rad_s has its axes swapped: a turn about z is measured about {} "
                    "({:.3g} rad/s)",
                    name, rate),
                "imu.angular_velocity_rad_s of the robot's messages (base axes: x forward, y left, z up)"};
    }
  }
}

}  // namespace

const char* to_string(CommissionVerdict verdict) {
  if (verdict == V::Ok) return "ok";
  return verdict == V::Warn ? "warn" : "fail";
}

std::vector<CommissionLine> judge_forward(const MotionTrace& trace, const RobotModel& model, Ground ground,
                                          Seen seen) {
  const MotionTrace steady = steady_part(trace, kSettle_s);
  const Axis axis{"command.speed_m_s", "m/s", "drives forward", trace.commanded.speed_m_s};
  const auto readings = counted(forward_readings(steady, model), ground);
  Lines lines = judge_axis(readings, axis, seen);
  const auto turned =
      relative_to(counted(turn_readings(steady, standing_part(trace), model), ground), axis.asked);
  find_swap(readings, turned, axis, lines);
  miss_tags(readings, ground, lines);
  judge_sides(steady, model, lines);
  return lines;
}

std::vector<CommissionLine> judge_turn(const MotionTrace& trace, const RobotModel& model, Ground ground,
                                       Seen seen) {
  const MotionTrace steady = steady_part(trace, kSettle_s);
  const MotionTrace standing = standing_part(trace);
  const Axis axis{"command.yaw_rate_rad_s", "rad/s", "turns left", trace.commanded.yaw_rate_rad_s};
  auto readings = counted(turn_readings(steady, standing, model), ground);
  Lines later;
  if (ground == Ground::Lifted && all_still(without(readings, "wheels")) && !all_still(readings)) {
    readings = without(std::move(readings), "odometry");
    later.push_back(
        {"odometry.yaw_rad", V::Warn,
         "the odometry does not turn while the wheels do: from a gyro? The drive on the floor shows it", ""});
  }
  Lines lines = judge_axis(readings, axis, seen);
  const auto driven = relative_to(counted(forward_readings(steady, model), ground), axis.asked);
  find_swap(readings, without(driven, "tags"), axis, lines);
  judge_gyro_axes(steady, standing, lines);
  miss_tags(readings, ground, lines);
  for (CommissionLine& line : lines) {
    if (line.key == "wheels" && line.verdict == V::Fail)
      line.words += "; left and right are swapped, unless both are reversed";
  }
  lines.insert(lines.end(), later.begin(), later.end());
  return lines;
}

bool all_pass(const std::vector<CommissionLine>& lines) {
  return std::ranges::none_of(lines, [](const CommissionLine& line) { return line.verdict == V::Fail; });
}

}  // namespace waymark
