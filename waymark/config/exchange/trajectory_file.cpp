#include "waymark/config/exchange/trajectory_file.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxBytes = std::size_t{1} << 28U;
constexpr std::int64_t kSecond = 1'000'000'000;
constexpr double kMaxPosition_m = 1e9;

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBlank = " \t\r,";
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(kBlank); begin != std::string_view::npos;) {
    const std::size_t end = line.find_first_of(kBlank, begin);
    words.push_back(line.substr(begin, end - begin));
    begin = end == std::string_view::npos ? end : line.find_first_not_of(kBlank, end);
  }
  return words;
}

template <class Number>
std::optional<Number> number(std::string_view word) {
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

/// Parses decimal seconds exactly: a double cannot represent nanoseconds since 1970.
std::optional<SensorTime> stamp(std::string_view word) {
  const std::size_t point = word.find('.');
  if (word.find_first_of("eE") != std::string_view::npos) {
    const auto seconds = number<double>(word);
    if (!seconds || !(std::abs(*seconds) < 9e9)) return std::nullopt;
    return SensorTime(Duration(std::llround(*seconds * 1e9)));
  }
  const bool negative = word.starts_with('-');
  const auto whole = number<std::int64_t>(word.substr(0, point));
  if (!whole || std::abs(*whole) >= 9'000'000'000) return std::nullopt;
  std::int64_t nanoseconds = 0;
  if (point != std::string_view::npos && point + 1 < word.size()) {
    std::string digits(word.substr(point + 1));
    if (digits.find_first_not_of("0123456789") != std::string::npos) return std::nullopt;
    digits.resize(9, '0');
    nanoseconds = *number<std::int64_t>(digits);
  }
  return SensorTime(Duration(*whole * kSecond + (negative ? -nanoseconds : nanoseconds)));
}

Result<StampedPose> parse_line(const std::vector<std::string_view>& words, const Place& place) {
  std::array<double, 7> n{};
  bool good = words.size() == 8;
  for (std::size_t i = 0; good && i < n.size(); ++i) {
    const auto value = number<double>(words[i + 1]);
    good = value && std::abs(*value) <= kMaxPosition_m;  // false for NaN too
    if (good) n[i] = *value;
  }
  const auto when = good ? stamp(words[0]) : std::nullopt;
  if (!when)
    return fail(ErrorCode::Unreadable, "not a trajectory line", place,
                "A line is `stamp_s x y z qx qy qz qw`.");
  auto rotation = SO3::try_from_quaternion(Eigen::Quaterniond(n[6], n[3], n[4], n[5]));
  if (!rotation) return fail(rotation.error().code, rotation.error().message, place);
  return StampedPose{*when, SE3(*rotation, {n[0], n[1], n[2]})};
}

}  // namespace

Result<Trajectory> parse_trajectory(std::string_view text, const std::string& source) {
  Trajectory trajectory;
  std::int64_t line_number = 0;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const Place place{.source = source, .line = ++line_number};
    const std::vector<std::string_view> words = words_of(line);
    if (words.empty() || words.front().starts_with('#')) continue;
    const Result<StampedPose> pose = parse_line(words, place);
    if (!pose) return tl::unexpected(pose.error());
    if (!trajectory.empty() && pose->stamp <= trajectory.back().stamp)
      return fail(ErrorCode::Unreadable, "the time does not increase", place);
    trajectory.push_back(*pose);
  }
  return trajectory;
}

Result<Trajectory> read_trajectory(const std::filesystem::path& path) {
  const Result<std::string> text = read_text_file(path, kMaxBytes);
  if (!text) return tl::unexpected(text.error());
  return parse_trajectory(*text, path.string());
}

std::string to_tum(const Trajectory& trajectory) {
  std::string text = "# stamp_s x y z qx qy qz qw (map_T_base)\n";
  for (const StampedPose& pose : trajectory) {
    const std::int64_t t = pose.stamp.time_since_epoch().count();
    const Eigen::Vector3d& p = pose.map_T_base.translation();
    const Eigen::Quaterniond& q = pose.map_T_base.rotation().quaternion();
    text += fmt::format("{}{}.{:09} {} {} {} {} {} {} {}\n", t < 0 ? "-" : "", std::abs(t) / kSecond,
                        std::abs(t) % kSecond, p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

}  // namespace waymark
