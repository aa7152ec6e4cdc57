#include <charconv>
#include <regex>

#include <fmt/format.h>

#include "waymark/robots/mbot/lcm_link.hpp"

namespace waymark {
namespace {

/// Nothing where the digits are more than `most`.
bool at_most(const std::string& digits, unsigned long most) {
  unsigned long value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  return error == std::errc() && end == digits.data() + digits.size() && value <= most;
}

}  // namespace

Result<std::string> lcm_address(const std::string& text) {
  if (text.empty()) return std::string(kLcmDefaultAddress);
  const auto wrong = [&](const std::string& words) {
    return fail(ErrorCode::InvalidArgument, fmt::format("'{}' {}", text, words), {.source = "LCM"},
                fmt::format("For example {}; ttl=1 reaches the local network.", kLcmDefaultAddress));
  };
  static const std::regex kForm(
      R"(udpm://(\d{1,3})\.(\d{1,3})\.(\d{1,3})\.(\d{1,3}):(\d{1,5})(\?ttl=(\d{1,3}))?)");
  std::smatch parts;
  constexpr std::size_t kLongest = 100;
  if (text.size() > kLongest || !std::regex_match(text, parts, kForm))
    return wrong("is no address of UDP multicast");
  constexpr unsigned long kByte = 255;
  for (std::size_t i = 1; i <= 4; ++i)
    if (!at_most(parts[i], kByte)) return wrong("has a number above 255 in its address");
  const int first = std::stoi(parts[1]);
  constexpr int kFirstMulticast = 224;
  constexpr int kLastMulticast = 239;
  if (first < kFirstMulticast || first > kLastMulticast)
    return wrong("is no multicast address: those begin with 224 to 239");
  constexpr unsigned long kPorts = 65535;
  if (!at_most(parts[5], kPorts) || std::stoi(parts[5]) == 0) return wrong("has a port that is none");
  if (parts[7].matched && !at_most(parts[7], kByte)) return wrong("has a ttl above 255");
  return text;
}

}  // namespace waymark
