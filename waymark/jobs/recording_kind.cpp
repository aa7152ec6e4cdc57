#include "waymark/jobs/recording_kind.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <system_error>

namespace waymark {
namespace {

using namespace std::string_view_literals;
constexpr std::array kBeginnings = {"\x89MCAP"sv, "#ROSBAG"sv,  "SQLite format 3"sv, "\xED\xA1\xDA\x01"sv,
                                    "BZh"sv,      "\x1F\x8B"sv, "\x28\xB5\x2F\xFD"sv};

}  // namespace

bool looks_like_recording(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  std::array<char, 16> head{};
  std::ifstream file(path, std::ios::binary);
  file.read(head.data(), head.size());
  const std::string_view begin(head.data(), static_cast<std::size_t>(file.gcount()));
  return std::ranges::any_of(kBeginnings, [&](std::string_view magic) { return begin.starts_with(magic); });
}

}  // namespace waymark
