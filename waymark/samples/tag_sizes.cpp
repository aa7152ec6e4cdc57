#include "waymark/samples/tag_sizes.hpp"

#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr const char* kHint =
    "Pass the side of the black square in metres, measured where black meets white.";

tl::unexpected<Error> not_a_size(double size_m, std::string key) {
  return fail(ErrorCode::InvalidArgument, fmt::format("{} m is not a valid tag size", size_m),
              {.key = std::move(key)}, kHint);
}

}  // namespace

bool is_tag_size(double size_m) { return std::isfinite(size_m) && size_m > 0.0; }

Result<double> TagSizes::size_m(const TagId& tag) const {
  const auto own = size_by_tag_m.find(tag);
  if (own == size_by_tag_m.end() && !default_size_m) {
    return fail(ErrorCode::NotFound, fmt::format("unknown size of {}", to_string(tag)),
                {.key = to_string(tag)}, "Set its size, or a default size for all tags, in metres.");
  }
  const double size = own == size_by_tag_m.end() ? *default_size_m : own->second;
  if (!is_tag_size(size)) return not_a_size(size, to_string(tag));
  return size;
}

std::string size_in_metres(double size_m) {
  constexpr double kMinMillimetres = 50;  // larger prints are rarely given in centimetres
  if (!(size_m > kMaxTagSize_m && size_m <= 1000 * kMaxTagSize_m)) return {};
  const bool millimetres = size_m >= kMinMillimetres;
  return fmt::format(" {0:g} {1} are {2:g} m.", size_m, millimetres ? "mm" : "cm",
                     size_m / (millimetres ? 1000 : 100));
}

Status check_printed_size(double size_m, std::string key) {
  if (size_m >= kMinTagSize_m && size_m <= kMaxTagSize_m) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("{:g} is not a size in metres from {} to {}", size_m, kMinTagSize_m, kMaxTagSize_m),
              {.key = std::move(key)}, std::string(kHint) + size_in_metres(size_m));
}

std::vector<std::string> TagSizes::warnings() const {
  constexpr double kUsualMin_m = 0.005;
  constexpr double kUsualMax_m = 1;
  std::vector<std::string> all;
  const auto check_usual = [&](double size, const std::string& owner) {
    if (size >= kUsualMin_m && size <= kUsualMax_m) return;
    all.push_back(fmt::format(
        "unusual size of {}: {:g} m. Is it in metres and measured along the black square?", owner, size));
  };
  if (default_size_m) check_usual(*default_size_m, "the tags");
  for (const auto& [tag, size] : size_by_tag_m) check_usual(size, to_string(tag));
  return all;
}

Status TagSizes::check() const {
  if (default_size_m && !is_tag_size(*default_size_m)) return not_a_size(*default_size_m, "default_size_m");
  for (const auto& [tag, size] : size_by_tag_m) {
    if (!is_tag_size(size)) return not_a_size(size, to_string(tag));
  }
  return {};
}

}  // namespace waymark
