#include "waymark/robots/process/drop_reports.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

constexpr std::size_t kMaxTracked = 100;

bool is_round(std::uint64_t count) {
  while (count >= 10 && count % 10 == 0) count /= 10;
  return count == 1 || count == 3;
}

}  // namespace

std::string DropReports::add(const std::string& topic, std::string_view why) {
  if (dropped_of_.size() >= kMaxTracked && !dropped_of_.contains(topic)) return {};
  const std::uint64_t count = ++dropped_of_[topic];
  std::string reason = topic + " ";
  std::ranges::copy_if(why, std::back_inserter(reason), [](char c) { return c < '0' || c > '9'; });
  const bool is_new = reasons_.size() < kMaxTracked && reasons_.insert(std::move(reason)).second;
  if (!is_new && !is_round(count)) return {};
  return fmt::format("dropped {} of {}; the last one: {}", counted(count, "message"), topic, why);
}

}  // namespace waymark
