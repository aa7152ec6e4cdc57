#include "waymark/recording/ros2/offered_qos.hpp"

#include <algorithm>
#include <charconv>
#include <span>

#include <fmt/format.h>

namespace waymark {
namespace {

using Names = std::span<const std::string_view>;

// Names of the policies, indexed by rmw's numbers (ros2/rmw, qos_string_conversions.c).
constexpr std::array<std::string_view, 4> kHistory{"system_default", "keep_last", "keep_all", "unknown"};
constexpr std::array<std::string_view, 5> kReliability{"system_default", "reliable", "best_effort", "unknown",
                                                       "best_available"};
constexpr std::array<std::string_view, 5> kDurability{"system_default", "transient_local", "volatile",
                                                      "unknown", "best_available"};
constexpr std::array<std::string_view, 6> kLiveliness{"system_default",  "automatic", "manual_by_node",
                                                      "manual_by_topic", "unknown",   "best_available"};

constexpr std::string_view kWord = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";

/// The next word at or after `at`, which is advanced past the word; empty at the end.
std::string_view next_word(std::string_view text, std::size_t& at) {
  const std::size_t begin = std::min(text.find_first_of(kWord, at), text.size());
  at = std::min(text.find_first_not_of(kWord, begin), text.size());
  return text.substr(begin, at - begin);
}

std::uint64_t number(std::string_view word, std::uint64_t otherwise) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size() ? value : otherwise;
}

int policy(std::string_view word, Names names, int otherwise) {
  std::string lower(word);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  const auto named = std::ranges::find(names, lower);
  if (named != names.end()) return static_cast<int>(named - names.begin());
  const std::uint64_t value = number(word, names.size());
  return value < names.size() ? static_cast<int>(value) : otherwise;
}

/// The time limit with a given key; nullptr for other keys.
QosTime* time_of(OfferedQos& profile, std::string_view key) {
  if (key == "deadline") return &profile.deadline;
  if (key == "lifespan") return &profile.lifespan;
  return key == "liveliness_lease_duration" ? &profile.lease : nullptr;
}

void set_policy(OfferedQos& profile, std::string_view key, std::string_view value) {
  if (key == "history") profile.history = policy(value, kHistory, profile.history);
  if (key == "depth") profile.depth = number(value, profile.depth);
  if (key == "reliability") profile.reliability = policy(value, kReliability, profile.reliability);
  if (key == "durability") profile.durability = policy(value, kDurability, profile.durability);
  if (key == "liveliness") profile.liveliness = policy(value, kLiveliness, profile.liveliness);
  if (key == "avoid_ros_namespace_conventions") profile.avoid_ros_namespace_conventions = value == "true";
}

std::string written(int value, Names names, QosNotation notation) {
  if (notation == QosNotation::Numbers) return std::to_string(value);
  return std::string(names[std::min(static_cast<std::size_t>(value), names.size() - 1)]);
}

}  // namespace

std::vector<OfferedQos> parse_offered_qos(std::string_view yaml) {
  std::vector<OfferedQos> profiles;
  QosTime* time = nullptr;
  for (std::size_t at = 0; at < yaml.size();) {
    const std::string_view key = next_word(yaml, at);
    if (key == "history") profiles.emplace_back();  // rosbag2 begins each profile with this key
    if (profiles.empty() || key.empty()) continue;
    if (QosTime* opened = time_of(profiles.back(), key)) {
      time = opened;
      continue;
    }
    const std::string_view value = next_word(yaml, at);
    if (time != nullptr && key == "sec") time->sec = number(value, time->sec);
    if (time != nullptr && key == "nsec") time->nsec = number(value, time->nsec);
    set_policy(profiles.back(), key, value);
  }
  return profiles;
}

std::string to_yaml(const std::vector<OfferedQos>& profiles, QosNotation notation, std::size_t indent) {
  const std::string pad(indent, ' ');
  if (profiles.empty()) return pad + "[]\n";
  std::string text;
  const auto line = [&](std::string_view key, const auto& value) {
    text += fmt::format("{}  {}: {}\n", pad, key, value);
  };
  const auto time = [&](std::string_view key, const QosTime& limit) {
    text += fmt::format("{0}  {1}:\n{0}    sec: {2}\n{0}    nsec: {3}\n", pad, key, limit.sec, limit.nsec);
  };
  for (const OfferedQos& profile : profiles) {
    text += fmt::format("{}- history: {}\n", pad, written(profile.history, kHistory, notation));
    line("depth", profile.depth);
    line("reliability", written(profile.reliability, kReliability, notation));
    line("durability", written(profile.durability, kDurability, notation));
    time("deadline", profile.deadline);
    time("lifespan", profile.lifespan);
    line("liveliness", written(profile.liveliness, kLiveliness, notation));
    time("liveliness_lease_duration", profile.lease);
    line("avoid_ros_namespace_conventions", profile.avoid_ros_namespace_conventions);
  }
  return text;
}

}  // namespace waymark
