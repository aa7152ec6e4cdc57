#include "waymark/simulation/photograph.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/simulation/backdrop.hpp"
#include "waymark/simulation/point_spread.hpp"
#include "waymark/simulation/scene_light.hpp"
#include "waymark/simulation/scene_patterns.hpp"

namespace waymark {
namespace {

constexpr std::int64_t kMaxPixels = 250'000'000;

Result<photo::Backdrop::Kind> backdrop_kind(const std::string& word) {
  if (word == "flat") return photo::Backdrop::Kind::Flat;
  if (word == "gradient") return photo::Backdrop::Kind::Gradient;
  if (word == "clutter") return photo::Backdrop::Kind::Clutter;
  return fail(ErrorCode::InvalidArgument, fmt::format("no background '{}'", word), {.key = "background"},
              suggestion(word, {"flat", "gradient", "clutter"}));
}

Status check_size(double size_m, std::string key) {
  if (std::isfinite(size_m) && size_m > 0) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("{} m is no size", size_m), {.key = std::move(key)},
              "Give metres above 0.");
}

Status check_finite(const SE3& cam_T_plane, std::string key) {
  if (cam_T_plane.matrix().allFinite()) return {};
  return fail(ErrorCode::InvalidArgument, "a pose with a number that is not finite", {.key = std::move(key)});
}

Status check_tag(const TagInScene& tag, std::size_t index) {
  const auto key = [&](const char* member) { return fmt::format("tags[{}].{}", index, member); };
  const std::size_t count = family(tag.tag.family).codes.size();
  if (tag.tag.number < 0 || static_cast<std::size_t>(tag.tag.number) >= count) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} has no tag {}", to_string(tag.tag.family), tag.tag.number),
                {.key = key("tag")}, fmt::format("Its numbers are 0 to {}.", count - 1));
  }
  if (!std::isfinite(tag.margin_cells) || tag.margin_cells < 0) {
    return fail(ErrorCode::InvalidArgument, fmt::format("a margin of {} cells", tag.margin_cells),
                {.key = key("margin_cells")}, "Give 0 or more.");
  }
  if (Status size = check_size(tag.size_m, key("size_m")); !size) return size;
  return check_finite(tag.cam_T_tag, key("cam_T_tag"));
}

Status check_sheet(const SheetInScene& sheet, std::size_t index) {
  const auto key = [&](const char* member) { return fmt::format("sheets[{}].{}", index, member); };
  if (sheet.raster.empty())
    return fail(ErrorCode::InvalidArgument, "a sheet without pixels", {.key = key("raster")});
  if (Status size = check_size(sheet.metres_per_pixel, key("metres_per_pixel")); !size) return size;
  return check_finite(sheet.cam_T_sheet, key("cam_T_sheet"));
}

Status check(const CameraModel& camera, const PhotographScene& scene, const PhotographOptions& options) {
  if (Status ranges = check_ranges(options); !ranges) return ranges;
  for (std::size_t i = 0; i < scene.tags.size(); ++i) {
    if (Status good = check_tag(scene.tags[i], i); !good) return good;
  }
  for (std::size_t i = 0; i < scene.sheets.size(); ++i) {
    if (Status good = check_sheet(scene.sheets[i], i); !good) return good;
  }
  if (std::int64_t{camera.width_px()} * camera.height_px() <= kMaxPixels) return {};
  return fail(ErrorCode::LimitExceeded, fmt::format("a photograph of {} x {} px, more than {} pixels",
                                                    camera.width_px(), camera.height_px(), kMaxPixels));
}

/// Light relative to its mean, which is in the middle of the picture: a plane over the pixels.
struct Illumination {
  double mean = 1, per_x = 0, per_y = 0;

  Illumination(const CameraModel& camera, const PhotographOptions& options) {
    const double direction = to_radians(options.illumination_direction_deg);
    const double half_width = camera.width_px() / 2.0;
    const double half_height = camera.height_px() / 2.0;
    const double reach =
        std::abs(std::cos(direction)) * half_width + std::abs(std::sin(direction)) * half_height;
    per_x = options.illumination_gradient / 2 * std::cos(direction) / reach;
    per_y = options.illumination_gradient / 2 * std::sin(direction) / reach;
    mean = 1 - per_x * half_width - per_y * half_height;
  }
  [[nodiscard]] double at(double x, double y) const { return mean + per_x * x + per_y * y; }
};

/// From light to grey levels, pixel by pixel in rows.
Image expose(const CameraModel& camera, const photo::SceneLight& light, const photo::Backdrop& backdrop,
             const PhotographOptions& options, Random noise) {
  const Illumination illumination(camera, options);
  const double contrast = (options.white_level_dn - options.black_level_dn) / 255;
  const double dark_variance = options.read_noise_dn * options.read_noise_dn;
  Image image(camera.width_px(), camera.height_px());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double covered = static_cast<double>(light.covered[light.index(x, y)]);
      double level =
          covered * options.black_level_dn + static_cast<double>(light.level[light.index(x, y)]) * contrast;
      if (covered < 1) {
        const double behind =
            options.background_level_dn + options.background_contrast_dn * backdrop.at(x + 0.5, y + 0.5);
        level += (1 - covered) * std::clamp(behind, 0.0, 255.0);
      }
      level *= illumination.at(x + 0.5, y + 0.5);
      const double variance = dark_variance + options.shot_noise_dn * level;
      if (variance > 0) level += noise.normal(0, std::sqrt(variance));
      image.row(y)[x] = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  }
  return image;
}

}  // namespace

Result<Photograph> photograph(const CameraModel& camera, const PhotographScene& scene,
                              const PhotographOptions& options, Random& random) {
  if (Status good = check(camera, scene, options); !good) return tl::unexpected(good.error());
  const Result<photo::Backdrop::Kind> kind = backdrop_kind(options.background);
  if (!kind) return tl::unexpected(kind.error());
  const photo::Backdrop backdrop{.kind = *kind,
                                 .size_px = options.clutter_size_px,
                                 .seed = random.fork().index(std::uint64_t{1} << 62U),
                                 .width_px = camera.width_px(),
                                 .height_px = camera.height_px()};
  const std::vector<photo::PlanarPattern> patterns = photo::patterns_from_far_to_near(scene);
  std::vector<photo::ProjectedPattern> projected;
  projected.reserve(patterns.size());
  for (const photo::PlanarPattern& pattern : patterns)
    projected.push_back(photo::project_pattern(camera, pattern));
  const photo::SceneLight light = photo::gather_light(projected, camera.width_px(), camera.height_px(),
                                                      photo::point_spread(options.blur_sigma_px));
  Photograph result{.image = expose(camera, light, backdrop, options, random.fork())};
  for (const TagInScene& tag : scene.tags) {
    if (auto truth = photo::tag_truth(camera, tag, patterns)) result.tags.push_back(*std::move(truth));
  }
  return result;
}

}  // namespace waymark
