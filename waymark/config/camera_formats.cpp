#include "waymark/config/camera_formats.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/config/yaml_write.hpp"

namespace waymark::internal {
namespace {

/// Pixel centres: integers in the files, +1/2 here (docs/conventions.md).
constexpr double kHalfPixel = 0.5;

/// A model by name, and how many coefficients may come with it.
struct Distortion {
  std::string_view name;
  bool fisheye = false;
  std::vector<std::size_t> counts;
};

const std::vector<Distortion>& known_distortions() {
  static const std::vector<Distortion> kKnown = {
      {"plumb_bob", false, {0, 4, 5}},     {"radtan", false, {0, 4, 5}},
      {"rational_polynomial", false, {8}}, {"none", false, {0}},
      {"equidistant", true, {4}},          {"fisheye", true, {4}},
  };
  return kKnown;
}

Result<Distortion> find_distortion(const YamlCursor& model) {
  const auto name = model.text();
  if (!name) return tl::unexpected<Error>(name.error());
  std::vector<std::string> names;
  for (const Distortion& known : known_distortions()) {
    if (known.name == *name) return known;
    names.emplace_back(known.name);
  }
  return model.fail_here(ErrorCode::Unsupported,
                         fmt::format("unknown distortion model '{}'", name->substr(0, 40)),
                         suggestion(*name, names));
}

Status check_count(const Distortion& model, std::size_t count, const YamlCursor& place) {
  if (std::find(model.counts.begin(), model.counts.end(), count) != model.counts.end()) return {};
  std::vector<std::string_view> fitting;
  for (const Distortion& other : known_distortions()) {
    const bool fits = std::find(other.counts.begin(), other.counts.end(), count) != other.counts.end();
    if (fits) fitting.push_back(other.name);
  }
  const std::string hint =
      fitting.empty() ? "" : fmt::format("{} coefficients belong to {}.", count, fmt::join(fitting, ", "));
  return place.fail_here(ErrorCode::InvalidArgument,
                         fmt::format("{} distortion coefficients, but the model '{}' has {}", count,
                                     model.name, fmt::join(model.counts, " or ")),
                         hint);
}

/// Tells the error of CameraModel::make() where in the file the numbers stand.
Error with_place(Error error, const CameraPlaces& places) {
  const bool about_size = error.place.key == "resolution";
  const bool about_distortion = error.place.key == "distortion";
  const YamlCursor& cursor = about_size         ? places.resolution
                             : about_distortion ? places.distortion
                                                : places.intrinsics;
  const std::string field = about_size || about_distortion ? "" : error.place.key;
  error.place = cursor.place();
  if (!field.empty()) error.message = fmt::format("{}: {}", field, error.message);
  return error;
}

/// c_x or c_y in the file: of the decimals that come back as the same value, the shortest.
std::string centre_text(double centre_px) {
  constexpr int kAllDigits = 17;
  const double in_file = centre_px - kHalfPixel;
  for (int digits = 1; digits <= kAllDigits; ++digits) {
    const std::string text = fmt::format("{:.{}g}", in_file, digits);
    double value = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    if (value + kHalfPixel == centre_px) return yaml_number(value);
  }
  return yaml_number(in_file);
}

}  // namespace

Result<CameraModel> make_camera(const YamlCursor& model, const FileIntrinsics& intrinsics,
                                const std::vector<double>& distortion, std::int64_t width_px,
                                std::int64_t height_px, const CameraPlaces& places) {
  const auto kind = find_distortion(model);
  if (!kind) return tl::unexpected<Error>(kind.error());
  if (Status status = check_count(*kind, distortion.size(), places.distortion); !status) {
    return tl::unexpected<Error>(status.error());
  }
  const auto fill = [&](auto camera) {
    camera.fx = intrinsics.fx;
    camera.fy = intrinsics.fy;
    camera.cx = intrinsics.cx + kHalfPixel;
    camera.cy = intrinsics.cy + kHalfPixel;
    std::copy(distortion.begin(), distortion.end(), camera.k.begin());
    return CameraModel::Projection(camera);
  };
  const PinholeRadtan radtan{.coefficients = static_cast<int>(distortion.size())};
  const CameraModel::Projection projection = kind->fisheye ? fill(Equidistant{}) : fill(radtan);
  auto camera = CameraModel::make(projection, static_cast<int>(width_px), static_cast<int>(height_px));
  if (!camera) return tl::unexpected<Error>(with_place(camera.error(), places));
  return camera;
}

std::array<std::string, 4> intrinsics_text(const CameraModel& camera) {
  return std::visit(
      [](const auto& c) {
        return std::array{yaml_number(c.fx), yaml_number(c.fy), centre_text(c.cx), centre_text(c.cy)};
      },
      camera.projection());
}

std::vector<double> file_distortion(const CameraModel& camera) {
  if (const auto* fisheye = std::get_if<Equidistant>(&camera.projection())) {
    return {fisheye->k.begin(), fisheye->k.end()};
  }
  const auto& radtan = std::get<PinholeRadtan>(camera.projection());
  return {radtan.k.begin(), radtan.k.begin() + radtan.coefficients};
}

}  // namespace waymark::internal
