#include "waymark/runtime/commission_lines.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/geometry/se2.hpp"

namespace waymark {
namespace {

double seconds_between(SensorTime from, SensorTime to) { return to_seconds(to - from); }

/// Whether a list has at least two samples that are separated in time.
template <class T>
bool spans(const std::vector<T>& samples) {
  return samples.size() >= 2 && samples.back().stamp > samples.front().stamp;
}

template <class T, class Value>
double median_of(const std::vector<T>& samples, const Value& value) {
  std::vector<double> values;
  values.reserve(samples.size());
  for (const T& sample : samples) values.push_back(std::invoke(value, sample));
  return median(std::move(values));
}

/// The tag that was visible for the longest time, with its first and last observation.
std::optional<std::pair<TagPlace, TagPlace>> longest_view(const std::vector<TagPlace>& places) {
  std::map<TagId, std::pair<TagPlace, TagPlace>> views;
  for (const TagPlace& place : places)
    views.try_emplace(place.tag, place, place).first->second.second = place;
  std::optional<std::pair<TagPlace, TagPlace>> longest;
  for (const auto& [tag, view] : views) {
    const bool longer =
        !longest || view.second.stamp - view.first.stamp > longest->second.stamp - longest->first.stamp;
    if (longer) longest = view;
  }
  constexpr double kLeast_s = 0.3;
  if (longest && seconds_between(longest->first.stamp, longest->second.stamp) < kLeast_s) return std::nullopt;
  return longest;
}

/// The sum of the heading changes between samples, each of less than half a turn.
double turned_rad(const std::vector<Odometry>& odometry) {
  double sum = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    sum += (odometry[i - 1].odom_T_base.inverse() * odometry[i].odom_T_base).yaw();
  return sum;
}

/// The distance along yaw or, for motion in another direction (which judge_axes() reports), its length.
double ahead_m(const OdometryLeg& leg) {
  const double ahead = leg.moved_m.dot(Eigen::Vector2d(std::cos(leg.yaw_rad), std::sin(leg.yaw_rad)));
  const double length = leg.moved_m.norm();
  return std::abs(ahead) > length / 2 ? std::copysign(length, ahead) : length;
}

double bearing_rad(const TagPlace& place) {
  return std::atan2(place.base_p_tag_m.y(), place.base_p_tag_m.x());
}

Eigen::Vector3d mean_rotation(const std::vector<ImuSample>& imu) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : imu) sum += sample.angular_velocity_rad_s;
  return imu.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(imu.size()));
}

}  // namespace

std::optional<Eigen::Vector3d> rotation_by_gyro(const MotionTrace& steady, const MotionTrace& standing) {
  if (steady.imu.size() < 2) return std::nullopt;
  return mean_rotation(steady.imu) - mean_rotation(standing.imu);
}

std::optional<Eigen::Vector2d> wheel_rates(const MotionTrace& steady) {
  if (!spans(steady.wheels)) return std::nullopt;
  const WheelTicks& first = steady.wheels.front();
  const WheelTicks& last = steady.wheels.back();
  return Eigen::Vector2d(last.left_rad - first.left_rad, last.right_rad - first.right_rad) /
         seconds_between(first.stamp, last.stamp);
}

std::optional<OdometryLeg> odometry_leg(const MotionTrace& steady) {
  if (!spans(steady.odometry)) return std::nullopt;
  const std::vector<Odometry>& all = steady.odometry;
  return OdometryLeg{.yaw_rad = all[all.size() / 2].odom_T_base.yaw(),
                     .moved_m = all.back().odom_T_base.translation() - all.front().odom_T_base.translation()};
}

std::vector<MotionReading> forward_readings(const MotionTrace& steady, const RobotModel& model) {
  std::vector<MotionReading> readings;
  const double asked = steady.commanded.speed_m_s;
  const auto add = [&](std::string key, std::string origin, double measured) {
    readings.push_back({std::move(key), std::move(origin), ReadingUnit::Length, measured, measured / asked});
  };
  if (spans(steady.odometry)) {
    const double took_s = seconds_between(steady.odometry.front().stamp, steady.odometry.back().stamp);
    add("odometry.speed_m_s", "odometry", median_of(steady.odometry, &Odometry::speed_m_s));
    add("odometry.position", "odometry", ahead_m(*odometry_leg(steady)) / took_s);
  }
  if (const auto wheels = wheel_rates(steady)) {
    const double rate_rad_s = wheels->mean();
    add("wheels", "wheels", rate_rad_s * model.wheel_radius_m);
    readings.back().unit = ReadingUnit::Angle;
  }
  if (const auto view = longest_view(steady.tags)) {
    const double nearer_m = view->first.base_p_tag_m.x() - view->second.base_p_tag_m.x();
    add("camera_mounting", "tags", nearer_m / seconds_between(view->first.stamp, view->second.stamp));
  }
  return readings;
}

std::vector<MotionReading> turn_readings(const MotionTrace& steady, const MotionTrace& standing,
                                         const RobotModel& model) {
  std::vector<MotionReading> readings;
  const double asked = steady.commanded.yaw_rate_rad_s;
  const auto add = [&](std::string key, std::string origin, double measured) {
    readings.push_back({std::move(key), std::move(origin), ReadingUnit::Angle, measured, measured / asked});
  };
  if (spans(steady.odometry)) {
    const double took_s = seconds_between(steady.odometry.front().stamp, steady.odometry.back().stamp);
    add("odometry.yaw_rate_rad_s", "odometry", median_of(steady.odometry, &Odometry::yaw_rate_rad_s));
    add("odometry.yaw_rad", "odometry", turned_rad(steady.odometry) / took_s);
  }
  if (const auto wheels = wheel_rates(steady))
    add("wheels", "wheels", (wheels->y() - wheels->x()) * model.wheel_radius_m / model.track_m);
  if (const auto gyro = rotation_by_gyro(steady, standing))
    add("imu.angular_velocity_rad_s", "imu", gyro->z());
  if (const auto view = longest_view(steady.tags)) {
    const double to_the_right =
        std::remainder(bearing_rad(view->first) - bearing_rad(view->second), 2 * M_PI);
    add("camera_mounting", "tags", to_the_right / seconds_between(view->first.stamp, view->second.stamp));
  }
  return readings;
}

namespace {

/// Result of comparing one reading with the command.
struct ReadingClass {
  enum class Kind : std::uint8_t { Fits, OtherUnit, OtherSize, Still };
  Kind kind = Kind::Fits;
  bool reversed = false;
  double factor = 1;      ///< conversion factor if the reading is in a different unit
  const char* unit = "";  ///< such as "degrees instead of radians"

  [[nodiscard]] bool right() const { return kind == Kind::Fits && !reversed; }
  friend bool operator==(const ReadingClass& a, const ReadingClass& b) {
    return a.kind == b.kind && a.reversed == b.reversed && a.factor == b.factor;
  }
};

/// Result of comparing all readings with the command.
struct ReadingVerdict {
  bool command_wrong = false;  ///< whether all readings agree and come from at least two sources
  bool either = false;         ///< whether the only source contradicts the command, so that either may be
                               ///< wrong
  double size = 1;             ///< ratio of actual to commanded motion, measured with tags if possible
};

constexpr double kMinRatio = 0.2;
constexpr double kMaxRatio = 3;
constexpr double kStill = 0.004;

struct Factor {
  double factor;
  const char* unit;
};

const Factor kLengths[] = {{1000, "millimetres instead of metres"}, {100, "centimetres instead of metres"}};
const Factor kAngles[] = {{180 / M_PI, "degrees instead of radians"},
                          {M_PI / 180, "a 57th: radians taken for degrees"}};

std::span<const Factor> factors_of(ReadingUnit unit) {
  return unit == ReadingUnit::Length ? std::span<const Factor>(kLengths) : std::span<const Factor>(kAngles);
}

bool fits(double ratio) { return ratio >= kMinRatio && ratio <= kMaxRatio; }

/// Ratios from 0.2 to 3 are accepted, because a skidding robot may turn only a third as much as commanded.
/// The same bounds apply when units are recognised; if two conversion factors fit, the nearer one is used.
ReadingClass classify(const MotionReading& reading) {
  using Kind = ReadingClass::Kind;
  const double size = std::abs(reading.ratio);
  ReadingClass found{.reversed = reading.ratio < 0};
  if (!(size >= kStill)) return {.kind = Kind::Still};
  if (fits(size)) return found;
  found.kind = Kind::OtherSize;
  double nearest = std::log(kMaxRatio) * 2;
  for (const Factor& one : factors_of(reading.unit)) {
    const double away = std::abs(std::log(size / one.factor));
    if (!fits(size / one.factor) || away >= nearest) continue;
    nearest = away;
    found = {.kind = Kind::OtherUnit, .reversed = found.reversed, .factor = one.factor, .unit = one.unit};
  }
  return found;
}

/// Returns a text such as "is reversed, in degrees instead of radians"; empty if the reading is right.
std::string describe(const ReadingClass& reading) {
  using Kind = ReadingClass::Kind;
  std::string text;
  if (reading.kind == Kind::Still) return "does not move";
  if (reading.reversed) text = "is reversed";
  if (reading.kind == Kind::OtherUnit)
    text += (text.empty() ? "is in " : ", and in ") + std::string(reading.unit);
  if (reading.kind == Kind::OtherSize)
    text += (text.empty() ? "" : ", and ") + std::string("has an implausible size");
  return text;
}

ReadingVerdict compare(const std::vector<MotionReading>& readings) {
  ReadingVerdict verdict;
  std::set<std::string> origins;
  std::vector<double> sizes;
  std::vector<ReadingClass> classes;
  for (const MotionReading& reading : readings) {
    origins.insert(reading.origin);
    classes.push_back(classify(reading));
    if (!classes.back().right()) continue;
    sizes.push_back(reading.ratio);
    if (reading.origin == "tags") verdict.size = reading.ratio;
  }
  if (!sizes.empty()) {
    if (verdict.size == 1) verdict.size = median(sizes);
    return verdict;
  }
  if (classes.empty()) return verdict;
  const bool agree =
      std::ranges::all_of(classes, [&](const ReadingClass& c) { return c == classes.front(); });
  verdict.command_wrong = agree && origins.size() > 1;
  verdict.either = agree && origins.size() == 1;
  return verdict;
}

using V = CommissionVerdict;
using Lines = std::vector<CommissionLine>;

constexpr double kSettle_s = 0.6;

/// Describes one axis of the commands.
struct Axis {
  const char* command;  ///< key of the command
  const char* unit;
  const char* does;  ///< description of the commanded motion
  double asked;
};

bool still(const MotionReading& reading) { return classify(reading).kind == ReadingClass::Kind::Still; }

/// Whether a reading is small enough relative to the command to be noise or drift.
bool is_noise(const MotionReading& reading) {
  constexpr double kNoiseShare = 0.1;
  return std::abs(reading.ratio) < kNoiseShare;
}

bool all_still(const std::vector<MotionReading>& readings) {
  return !readings.empty() && std::ranges::all_of(readings, still);
}

std::string remedy_for(const MotionReading& reading) {
  if (reading.origin == "tags") return "camera_mounting, camera_info and `tag_size_m`";
  if (reading.origin == "wheels")
    return "wheels.radius_m, wheels.track_m, or left_rad and right_rad of the messages";
  return reading.key + " of the robot's messages";
}

CommissionLine line_of(const MotionReading& reading, const Axis& axis, const ReadingVerdict& all,
                       bool command_right) {
  const ReadingClass found = classify(reading);
  const std::string measured = fmt::format("{:.3g} {}", reading.measured, axis.unit);
  CommissionLine line{.key = reading.key, .message = measured};
  if (all.command_wrong && !command_right) return line;
  if (!found.right()) {
    line.verdict = V::Fail;
    line.message = fmt::format("{} {}: measured {}, commanded {} {}", reading.key, describe(found), measured,
                               axis.asked, axis.unit);
    line.remedy = remedy_for(reading);
    if (all.either && !command_right)
      line.message += fmt::format(
          "; or {} is wrong, because no other source measured the motion. Check in which direction the robot "
          "moved",
          axis.command);
    return line;
  }
  const double off = reading.ratio / all.size - 1;
  constexpr double kMaxDeviation = 0.15;
  const bool skids = reading.origin == "wheels" && axis.asked != 0 && std::string_view(axis.unit) == "rad/s";
  if (std::abs(off) > kMaxDeviation && !skids) {
    line.verdict = V::Warn;
    line.message += fmt::format(", {:+.0f} % relative to the other sources", 100 * off);
    line.remedy = reading.origin == "odometry" ? "waymark calibrate robot" : remedy_for(reading);
  }
  return line;
}

CommissionLine command_line(const std::vector<MotionReading>& readings, const Axis& axis,
                            const ReadingVerdict& all, Seen seen) {
  CommissionLine line{.key = axis.command, .message = fmt::format("{} as commanded", axis.does)};
  if (readings.empty()) return {axis.command, V::Warn, "not measured", "odometry of the robot's messages"};
  const bool wrong = seen ? !*seen : all.command_wrong;
  if (wrong) {
    const std::string description = describe(classify(readings.front()));
    line.verdict = V::Fail;
    line.message = fmt::format("{} {}: commanded {} {}, but {}", axis.command,
                               description.empty() ? "is wrong" : description, axis.asked, axis.unit,
                               seen ? "a person saw another motion" : "all sources agree on another motion");
    line.remedy = std::string(axis.command) + " in the robot's program";
    return line;
  }
  constexpr double kMaxError = 0.1;
  if (std::abs(all.size - 1) <= kMaxError) return line;
  line.verdict = V::Warn;
  line.message = fmt::format("{} by {:.2f} of the command", axis.does, all.size);
  line.remedy = std::string(axis.command) + " in the robot's program";
  if (std::string_view(axis.command) == "command.yaw_rate_rad_s")
    line.remedy += "; a replay learns this factor";
  return line;
}

/// Evaluates the command and the readings of one axis.
Lines judge_axis(const std::vector<MotionReading>& readings, const Axis& axis, Seen seen) {
  const ReadingVerdict all = compare(readings);
  Lines lines = {command_line(readings, axis, all, seen)};
  for (const MotionReading& reading : readings) lines.push_back(line_of(reading, axis, all, seen && *seen));
  return lines;
}

/// Detects swapped axes, where the robot moved along the axis that was not commanded. If all sources agree,
/// the command is swapped; otherwise the odometry is.
void find_swap(const std::vector<MotionReading>& asked, const std::vector<MotionReading>& other,
               const Axis& axis, Lines& lines) {
  const auto moved = [&](const char* key) {
    return std::ranges::any_of(
        other, [&](const MotionReading& r) { return r.key.starts_with(key) && !is_noise(r); });
  };
  if (!asked.empty() && std::ranges::all_of(asked, is_noise) && moved("")) {
    lines.front().verdict = V::Fail;
    lines.front().message = fmt::format(
        "command.speed_m_s and command.yaw_rate_rad_s are swapped: {} was commanded, and the robot performed "
        "the "
        "other motion",
        axis.command);
    lines.front().remedy = std::string(axis.command) + " in the robot's program";
    lines.resize(1);  // the sensor lines are only consequences of this
    return;
  }
  for (CommissionLine& line : lines) {
    const bool twist = line.key == "odometry.speed_m_s" || line.key == "odometry.yaw_rate_rad_s";
    const char* partner = line.key == "odometry.speed_m_s" ? "odometry.yaw_rate_rad_s" : "odometry.speed_m_s";
    const bool unmoved =
        std::ranges::any_of(asked, [&](const MotionReading& r) { return r.key == line.key && is_noise(r); });
    if (twist && unmoved && moved(partner)) line.message += fmt::format("; it and {} are swapped", partner);
  }
}

std::vector<MotionReading> without(std::vector<MotionReading> readings, std::string_view origin) {
  std::erase_if(readings, [&](const MotionReading& r) { return r.origin == origin; });
  return readings;
}

/// The readings divided by a different reference value.
std::vector<MotionReading> relative_to(std::vector<MotionReading> readings, double asked) {
  for (MotionReading& reading : readings) reading.ratio = reading.measured / asked;
  return readings;
}

std::vector<MotionReading> counted(std::vector<MotionReading> readings, Ground ground) {
  return ground == Ground::Floor ? readings : without(without(std::move(readings), "tags"), "imu");
}

/// The robot's own sensors cannot reveal an error that they all share.
void miss_tags(const std::vector<MotionReading>& readings, Ground ground, Lines& lines) {
  if (ground == Ground::Lifted || without(readings, "tags").size() < readings.size()) return;
  lines.push_back({"tags", V::Warn,
                   "no tag was in view throughout, so the robot's own sensors are the only sources",
                   "a tag ahead of the robot, and `tag_size_m`"});
}

/// In a straight motion, the wheels on both sides turn forwards.
void judge_sides(const MotionTrace& steady, const RobotModel& model, Lines& lines) {
  const auto rates = wheel_rates(steady);
  if (!rates) return;
  const Eigen::Vector2d ratios = *rates * model.wheel_radius_m / steady.commanded.speed_m_s;
  for (const auto& [key, ratio, other] : {std::tuple{"wheels.left_rad", ratios.x(), ratios.y()},
                                          {"wheels.right_rad", ratios.y(), ratios.x()}}) {
    if (ratio >= 0 || other <= 0) continue;
    std::erase_if(lines, [](const CommissionLine& line) { return line.key == "wheels"; });
    lines.push_back({key, V::Fail,
                     fmt::format("{} is reversed: it turns backwards while the robot drives forwards", key),
                     std::string(key) + " of the robot's messages"});
  }
}

/// A turn is a rotation about z.
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
    later.push_back({"odometry.yaw_rad", V::Warn,
                     "the odometry does not turn although the wheels do. If its heading is from a gyro, the "
                     "drive on the floor shows it",
                     ""});
  }
  Lines lines = judge_axis(readings, axis, seen);
  const auto driven = relative_to(counted(forward_readings(steady, model), ground), axis.asked);
  find_swap(readings, without(driven, "tags"), axis, lines);
  judge_gyro_axes(steady, standing, lines);
  miss_tags(readings, ground, lines);
  for (CommissionLine& line : lines) {
    if (line.key == "wheels" && line.verdict == V::Fail)
      line.message += "; left and right are swapped, unless both are reversed";
  }
  lines.insert(lines.end(), later.begin(), later.end());
  return lines;
}

bool all_pass(const std::vector<CommissionLine>& lines) {
  return std::ranges::none_of(lines, [](const CommissionLine& line) { return line.verdict == V::Fail; });
}

namespace {

/// Speed of the outer edge of the robot: forward speed plus yaw rate times 0.2 m, in any unit.
double pace_of(const Odometry& odometry) {
  constexpr double kEdge_m = 0.2;
  return std::abs(odometry.speed_m_s) + kEdge_m * std::abs(odometry.yaw_rate_rad_s);
}

/// Reversed or swapped axes of the position.
struct AxesFault {
  Eigen::Matrix2d sent_R_right;
  const char* message;
};

std::array<AxesFault, 8> axes_faults() {
  const auto m = [](double a, double b, double c, double d) {
    Eigen::Matrix2d made;
    made << a, b, c, d;
    return made;
  };
  return {{{m(1, 0, 0, 1), ""},
           {m(1, 0, 0, -1), "odometry.y_m is reversed: left must be positive"},
           {m(-1, 0, 0, 1), "odometry.x_m is reversed: forward must be positive"},
           {m(-1, 0, 0, -1), ""},  // driven backwards; judge_forward() decides whether this is wrong
           {m(0, 1, 1, 0), "odometry.x_m and odometry.y_m are swapped"},
           {m(0, 1, -1, 0), "odometry.x_m and odometry.y_m are swapped, and y_m is reversed"},
           {m(0, -1, 1, 0), "odometry.x_m and odometry.y_m are swapped, and x_m is reversed"},
           {m(0, -1, -1, 0), "odometry.x_m and odometry.y_m are swapped and reversed"}}};
}

bool explains(const AxesFault& fault, const OdometryLeg& leg) {
  constexpr double kNear = 0.9;  // cosine of the largest angle between directions that are considered equal
  const Eigen::Vector2d ahead(std::cos(leg.yaw_rad), std::sin(leg.yaw_rad));
  return (fault.sent_R_right * ahead).dot(leg.moved_m.normalized()) > kNear;
}

}  // namespace

std::vector<CommissionLine> judge_axes(const std::vector<OdometryLeg>& legs) {
  std::vector<OdometryLeg> ways;
  for (const OdometryLeg& leg : legs) {
    if (leg.moved_m.norm() > 0) ways.push_back(leg);
  }
  if (ways.empty()) return {};
  for (const AxesFault& fault : axes_faults()) {
    if (!std::ranges::all_of(ways, [&](const OdometryLeg& leg) { return explains(fault, leg); })) continue;
    if (*fault.message == '\0') return {{"odometry.axes", V::Ok, "the position moves along yaw", ""}};
    return {
        {"odometry.axes", V::Fail, fault.message, "odometry.x_m and odometry.y_m of the robot's messages"}};
  }
  return {{"odometry.axes", V::Fail, "the position does not move along yaw",
           "odometry.x_m, odometry.y_m and odometry.yaw_rad of the robot's messages"}};
}

std::vector<CommissionLine> judge_standing(const MotionTrace& standing) {
  if (standing.imu.empty()) return {};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d turning = Eigen::Vector3d::Zero();
  for (const ImuSample& sample : standing.imu) {
    sum += sample.linear_acceleration_m_s2;
    turning += sample.angular_velocity_rad_s;
  }
  const auto count = static_cast<double>(standing.imu.size());
  const Eigen::Vector3d force = sum / count;
  constexpr double kGravity = 9.81;
  constexpr const char* kRemedy = "imu.linear_acceleration_m_s2 of the robot's messages";
  const std::string measured =
      fmt::format("({:.2f}, {:.2f}, {:.2f}) m/s2 at standstill", force.x(), force.y(), force.z());
  std::vector<CommissionLine> lines = {{"imu.linear_acceleration_m_s2", V::Ok, measured, ""}};
  CommissionLine& line = lines.back();
  if (force.norm() < 1e-3) {
    line = {line.key, V::Warn, "is zero: not sent, or from a simulator without gravity", kRemedy};
  } else if (std::abs(force.norm() - 1) < 0.2) {
    line = {line.key, V::Fail, "is in g instead of m/s2: " + measured, kRemedy};
  } else if (std::abs(force.norm() / kGravity - 1) > 0.2) {
    line = {line.key, V::Fail, "is not 9.81 m/s2: " + measured, kRemedy};
  } else if (force.z() < 0.9 * force.norm()) {
    line = {line.key, V::Fail, "does not point up along z (base axes: x forward, y left, z up): " + measured,
            kRemedy};
  }
  constexpr double kMaxBias_rad_s = 0.05;
  if (turning.norm() / count > kMaxBias_rad_s)
    lines.push_back({"imu.bias", V::Warn,
                     fmt::format("the gyro measures {:.3f} rad/s at standstill", turning.norm() / count),
                     "a calibration of the IMU by its driver"});
  return lines;
}

MotionTiming timing_of(const MotionTrace& trace) {
  MotionTiming timing;
  if (!trace.began || !trace.ceased) return timing;
  std::vector<double> paces;
  for (const Odometry& odometry : steady_part(trace, 0.6).odometry) paces.push_back(pace_of(odometry));
  const double steady = median(paces);
  const Odometry* at_end = nullptr;
  constexpr double kStanding = 0.15;  // fraction of the previous speed, chosen above the noise of a twist
  if (!(steady > 0)) return timing;
  for (const Odometry& odometry : trace.odometry) {
    const double pace = pace_of(odometry);
    if (odometry.stamp >= *trace.began && pace >= steady / 2 && !timing.response_s)
      timing.response_s = to_seconds(odometry.stamp - *trace.began);
    if (odometry.stamp < *trace.ceased) {
      at_end = &odometry;
      continue;
    }
    timing.watched_s = to_seconds(odometry.stamp - *trace.ceased);
    if (pace > kStanding * steady) {
      timing.stopping_s.reset();
      if (at_end != nullptr)
        timing.stopping_m = (odometry.odom_T_base.translation() - at_end->odom_T_base.translation()).norm();
    } else if (!timing.stopping_s) {
      timing.stopping_s = timing.watched_s;
      if (at_end != nullptr)
        timing.stopping_m = (odometry.odom_T_base.translation() - at_end->odom_T_base.translation()).norm();
    }
  }
  return timing;
}

CommissionLine judge_stop(const std::string& key, const MotionTiming& timing, double allowed_s) {
  constexpr double kWarn_s = 0.6;
  constexpr double kFail_s = 1;
  constexpr const char* kRemedy = "the robot's program, which must obey zero at once";
  if (!timing.response_s)
    return {key, V::Fail, "cannot be judged: the robot did not move before it",
            "odometry of the robot's messages"};
  if (!timing.stopping_s)
    return {key, V::Fail, fmt::format("the robot did not stop within {:.2f} s", timing.watched_s), kRemedy};
  CommissionLine line{
      key, V::Ok, fmt::format("stopped after {:.2f} s and {:.3f} m", *timing.stopping_s, timing.stopping_m),
      ""};
  if (*timing.stopping_s > kWarn_s + allowed_s) line.verdict = V::Warn;
  if (*timing.stopping_s > kFail_s + allowed_s) line.verdict = V::Fail;
  if (line.verdict != V::Ok) line.remedy = kRemedy;
  return line;
}

CommissionLine judge_response(const MotionTiming& timing) {
  constexpr double kWarn_s = 0.4;
  constexpr double kFail_s = 1;
  if (!timing.response_s)
    return {"latency", V::Fail, "the robot does not move",
            "command.speed_m_s where the robot's program obeys it"};
  CommissionLine line{"latency", V::Ok,
                      fmt::format("half the speed is reached {:.2f} s after the command", *timing.response_s),
                      ""};
  if (*timing.response_s > kWarn_s) line.verdict = V::Warn;
  if (*timing.response_s > kFail_s) line.verdict = V::Fail;
  if (line.verdict != V::Ok) line.remedy = "the path of a command through the robot's program";
  return line;
}

}  // namespace waymark
