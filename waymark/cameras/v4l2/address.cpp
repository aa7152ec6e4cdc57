#include "waymark/cameras/v4l2/address.hpp"

#include <charconv>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

constexpr int kMaxSide_px = 65536;
constexpr double kMaxRate_hz = 10000;

std::vector<std::string_view> split(std::string_view text, char at) {
  std::vector<std::string_view> parts;
  while (true) {
    const std::size_t end = text.find(at);
    parts.push_back(text.substr(0, end));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

tl::unexpected<Error> wrong(const std::string& address, std::string_view word, std::string hint) {
  return fail(ErrorCode::InvalidArgument, fmt::format("invalid option '{}'", word), {.key = address},
              std::move(hint));
}

bool read_size(std::string_view text, V4l2Options& options) {
  const std::vector<std::string_view> sides = split(text, 'x');
  if (sides.size() != 2) return false;
  const auto width = number_in<int>(sides[0]);
  const auto height = number_in<int>(sides[1]);
  if (!width || !height || *width < 1 || *height < 1 || *width > kMaxSide_px || *height > kMaxSide_px)
    return false;
  options.width = *width;
  options.height = *height;
  return true;
}

Status read_word(const std::string& address, std::string_view word, V4l2Options& options) {
  if (word == "lock") {
    options.lock = true;
    return {};
  }
  const std::size_t sign = word.find('=');
  if (sign == std::string_view::npos)
    return wrong(
        address, word,
        suggestion(word, {"size=WxH", "rate=HZ", "format=NAME", "lock", "exposure_ms=MS", "gain=N"}));
  const std::string_view key = word.substr(0, sign);
  const std::string_view value = word.substr(sign + 1);
  if (key == "size")
    return read_size(value, options) ? Status() : wrong(address, word, "Use the form size=1280x720.");
  if (key == "format") {
    options.format = pixel_format_named(value);
    return options.format ? Status() : wrong(address, word, suggestion(value, pixel_format_names()));
  }
  const auto number = number_in<double>(value);
  if (!number || !std::isfinite(*number)) return wrong(address, word, "Write a number after '='.");
  if (key != "rate") {
    options.controls[std::string(key)] = *number;
    return {};
  }
  if (*number <= 0 || *number > kMaxRate_hz) return wrong(address, word, "Use the form rate=30.");
  options.rate_hz = *number;
  return {};
}

}  // namespace

Result<V4l2Options> parse_v4l2_address(const std::string& address) {
  std::string_view text = address;
  if (text.starts_with(kV4l2Scheme)) text.remove_prefix(kV4l2Scheme.size());
  std::vector<std::string_view> words = split(text, ',');
  V4l2Options options{.device = std::string(words.front())};
  if (options.device.empty())
    return fail(ErrorCode::InvalidArgument, "the address contains no device", {.key = address},
                "Use an address such as v4l2:/dev/video0; `waymark cameras` lists them.");
  if (options.device.find_first_not_of("0123456789") == std::string::npos)
    options.device = "/dev/video" + options.device;
  for (std::size_t i = 1; i < words.size(); ++i)
    if (Status read = read_word(address, words[i], options); !read) return tl::unexpected(read.error());
  return options;
}

}  // namespace waymark
