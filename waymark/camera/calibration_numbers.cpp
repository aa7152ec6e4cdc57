#include "waymark/camera/calibration_numbers.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"

namespace waymark {
namespace {

/// Offset between the pixel centres in files and messages (at integers) and in Waymark (at +1/2;
/// docs/conventions.md).
constexpr double kHalfPixel = 0.5;
constexpr std::int64_t kMaxSide_px = 1'000'000;

enum class Lens : std::uint8_t { None, Radtan, Equidistant };

struct NamedLens {
  std::string_view name;
  Lens lens;
};
/// ROS uses plumb_bob, rational_polynomial and equidistant; kalibr uses radtan, equidistant and none. The
/// other names occur in files and drivers.
constexpr std::array kLenses = {
    NamedLens{"plumb_bob", Lens::Radtan},
    NamedLens{"rational_polynomial", Lens::Radtan},
    NamedLens{"radtan", Lens::Radtan},
    NamedLens{"radial-tangential", Lens::Radtan},
    NamedLens{"brown_conrady", Lens::Radtan},
    NamedLens{"opencv", Lens::Radtan},
    NamedLens{"equidistant", Lens::Equidistant},
    NamedLens{"fisheye", Lens::Equidistant},
    NamedLens{"kannala_brandt", Lens::Equidistant},
    NamedLens{"kannala_brandt4", Lens::Equidistant},
    NamedLens{"equi", Lens::Equidistant},
    NamedLens{"opencv_fisheye", Lens::Equidistant},
    NamedLens{"none", Lens::None},
};

std::string letters_of(std::string_view name) {
  std::string letters;
  for (const char c : name)
    if (c != '_' && c != '-' && c != ' ')
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return letters;
}

Result<Lens> lens_named(const std::string& name) {
  if (name.empty()) return Lens::Radtan;
  for (const NamedLens& known : kLenses)
    if (letters_of(known.name) == letters_of(name)) return known.lens;
  return fail(ErrorCode::Unsupported,
              fmt::format("unknown distortion model '{}'", printable(name.substr(0, 40))),
              {.key = "distortion_model"}, suggestion(name, distortion_model_names()));
}

auto wrong_distortion(std::string message, std::string hint) {
  return fail(ErrorCode::InvalidArgument, std::move(message), {.key = "distortion"}, std::move(hint));
}

/// The number of coefficients in use. OpenCV may write 12 or 14 coefficients of which it estimated at most 8.
Result<std::size_t> used_count(const CalibrationNumbers& numbers, Lens lens) {
  const std::vector<double>& d = numbers.distortion;
  const std::size_t n = d.size();
  const bool padded = n == 12 || n == 14;
  const auto zero_from = [&](std::size_t first) {
    return std::all_of(d.begin() + static_cast<std::ptrdiff_t>(first), d.end(),
                       [](double c) { return c == 0.0; });
  };
  if (lens == Lens::None && zero_from(0)) return std::size_t{0};
  if (lens == Lens::Equidistant) {
    if (n == 0 || n == 4) return n;
    if ((padded || n == 8) && zero_from(4)) return std::size_t{4};
    return wrong_distortion(
        fmt::format("{} distortion coefficients, but the model '{}' has 4", n, numbers.model),
        "Give k1 k2 k3 k4, or correct the name of the model.");
  }
  if (lens == Lens::Radtan) {
    if (n == 0 || n == 4 || n == 5 || n == 8) return n;
    if (padded && zero_from(8)) return std::size_t{8};
    if (padded)
      return wrong_distortion(
          fmt::format("unsupported distortion: coefficients 9 to {} (thin prism, tilted sensor) are not zero",
                      n),
          "Calibrate with at most 8 coefficients: `waymark calibrate camera` with `lens=rational8`.");
  }
  return wrong_distortion(
      fmt::format("{} distortion coefficients, but the model '{}' has {}", n,
                  numbers.model.empty() ? "plumb_bob" : numbers.model,
                  lens == Lens::None ? "0" : "0, 4, 5 or 8"),
      "Models: none (0), plumb_bob or radtan (4 or 5), rational_polynomial (8), equidistant (4).");
}

Status check_matrix(const std::array<double, 9>& k) {
  if (k[3] == 0.0 && k[6] == 0.0 && k[7] == 0.0 && k[8] == 1.0) return {};
  return fail(ErrorCode::InvalidArgument, "not a camera matrix", {.key = "camera_matrix"},
              "Its rows are [fx, skew, cx], [0, fy, cy], [0, 0, 1].");
}

/// A focal length in millimetres, as data sheets state it, would mean an impossible field of view in pixels.
Status check_focal_length(const CalibrationNumbers& numbers, Lens lens) {
  const double widest_rad = lens == Lens::Equidistant ? 2 * std::numbers::pi : to_radians(170);
  const double half = 0.5 * static_cast<double>(numbers.width_px);
  const double least_px =
      lens == Lens::Equidistant ? half / (0.5 * widest_rad) : half / std::tan(0.5 * widest_rad);
  if (!(numbers.k[0] > 0) || !(numbers.k[0] < least_px)) return {};  // CameraModel::make() checks its sign
  return fail(
      ErrorCode::InvalidArgument,
      fmt::format("a focal length of {:.4g} px would mean a field of view of more than {:.0f} degrees "
                  "in an image {} px wide",
                  numbers.k[0], to_degrees(widest_rad), numbers.width_px),
      {.key = "camera_matrix"},
      "Give it in pixels: the focal length in mm, divided by the width of the sensor in mm, times the "
      "width of the image in pixels.");
}

/// The part with zeros replaced by what they mean.
Result<ImagePart> explicit_part(const CalibrationNumbers& numbers) {
  ImagePart part = numbers.part;
  if (part.width_px == 0) part.width_px = numbers.width_px - part.x_px;
  if (part.height_px == 0) part.height_px = numbers.height_px - part.y_px;
  part.binning_x = std::max<std::int64_t>(part.binning_x, 1);
  part.binning_y = std::max<std::int64_t>(part.binning_y, 1);
  const bool inside = part.x_px >= 0 && part.y_px >= 0 && part.width_px > 0 && part.height_px > 0 &&
                      part.x_px + part.width_px <= numbers.width_px &&
                      part.y_px + part.height_px <= numbers.height_px && part.binning_x <= part.width_px &&
                      part.binning_y <= part.height_px;
  if (inside) return part;
  return fail(ErrorCode::InvalidArgument,
              fmt::format("the region of interest ({}x{} at ({}, {}), binning {}x{}) is not inside the "
                          "calibrated image of {}x{}",
                          part.width_px, part.height_px, part.x_px, part.y_px, part.binning_x, part.binning_y,
                          numbers.width_px, numbers.height_px),
              {.key = "roi"}, "Correct the region or the image size in the calibration.");
}

}  // namespace

std::vector<std::string> distortion_model_names() {
  std::vector<std::string> names;
  names.reserve(kLenses.size());
  for (const NamedLens& known : kLenses) names.emplace_back(known.name);
  return names;
}

Result<CameraModel> camera_from(const CalibrationNumbers& numbers) {
  const Result<Lens> lens = lens_named(numbers.model);
  if (!lens) return tl::unexpected(lens.error());
  const Result<std::size_t> count = used_count(numbers, *lens);
  if (!count) return tl::unexpected(count.error());
  if (Status matrix = check_matrix(numbers.k); !matrix) return tl::unexpected(matrix.error());
  if (Status focal = check_focal_length(numbers, *lens); !focal) return tl::unexpected(focal.error());
  ImagePart part{
      .width_px = numbers.width_px, .height_px = numbers.height_px, .binning_x = 1, .binning_y = 1};
  const bool sized = numbers.width_px > 0 && numbers.height_px > 0 && numbers.width_px <= kMaxSide_px &&
                     numbers.height_px <= kMaxSide_px;
  if (sized) {  // otherwise CameraModel::make() reports the size
    const Result<ImagePart> sent = explicit_part(numbers);
    if (!sent) return tl::unexpected(sent.error());
    part = *sent;
  }
  const auto bin_x = static_cast<double>(part.binning_x);
  const auto bin_y = static_cast<double>(part.binning_y);
  const auto fill = [&](auto camera) {
    camera.fx = numbers.k[0] / bin_x;
    camera.skew = numbers.k[1] / bin_x;
    camera.cx = (numbers.k[2] + kHalfPixel - static_cast<double>(part.x_px)) / bin_x;
    camera.fy = numbers.k[4] / bin_y;
    camera.cy = (numbers.k[5] + kHalfPixel - static_cast<double>(part.y_px)) / bin_y;
    std::copy_n(numbers.distortion.begin(), *count, camera.k.begin());
    return CameraModel::Projection(camera);
  };
  const PinholeRadtan radtan{.coefficients = static_cast<int>(*count)};
  const CameraModel::Projection projection = *lens == Lens::Equidistant ? fill(Equidistant{}) : fill(radtan);
  const auto side = [](std::int64_t px, std::int64_t binning) {
    return static_cast<int>(std::clamp<std::int64_t>(px / binning, -1, kMaxSide_px + 1));
  };
  return CameraModel::make(projection, side(part.width_px, part.binning_x),
                           side(part.height_px, part.binning_y));
}

}  // namespace waymark
