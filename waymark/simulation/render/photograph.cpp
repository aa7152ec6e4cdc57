#include "waymark/simulation/render/photograph.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/samples/visibility.hpp"
#include "waymark/simulation/render/pattern_radiance.hpp"

namespace waymark::photo {
namespace {

/// The background behind the tags: a smooth function of the pixel position with values from -1 to 1.
struct Backdrop {
  enum class Kind : std::uint8_t { Flat, Gradient, Clutter };

  Kind kind = Kind::Flat;
  double size_px = 48;     ///< size of the largest blobs in clutter
  std::uint64_t seed = 0;  ///< seed for clutter
  int width_px = 1;
  int height_px = 1;

  /// Flat: 0. Gradient: from -1 in the top left to 1 in the bottom right corner. Clutter: value noise with
  /// several octaves, each half the size of the previous one, down to 4 px (Lewis, "Algorithms for solid
  /// noise synthesis", SIGGRAPH 1989; value noise on a lattice, cubic blending). O(octaves).
  [[nodiscard]] double at(double x, double y) const;
};

/// splitmix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).
std::uint64_t mix(std::uint64_t z) {
  z += 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31U);
}

/// The value at a lattice point, in [-1, 1).
double lattice(std::uint64_t seed, std::int64_t i, std::int64_t j) {
  const std::uint64_t hash =
      mix(mix(mix(seed) ^ static_cast<std::uint64_t>(i)) ^ static_cast<std::uint64_t>(j));
  return static_cast<double>(hash >> 11U) * 0x1.0p-52 - 1.0;
}

double blend(double t) { return t * t * (3 - 2 * t); }

double value_noise(std::uint64_t seed, double x, double y) {
  const double i = std::floor(x);
  const double j = std::floor(y);
  const auto left = static_cast<std::int64_t>(i);
  const auto top = static_cast<std::int64_t>(j);
  const double u = blend(x - i);
  const double v = blend(y - j);
  const double above = lattice(seed, left, top) * (1 - u) + lattice(seed, left + 1, top) * u;
  const double below = lattice(seed, left, top + 1) * (1 - u) + lattice(seed, left + 1, top + 1) * u;
  return above * (1 - v) + below * v;
}

double clutter(std::uint64_t seed, double size_px, double x, double y) {
  constexpr double kMinOctavePx = 4;
  constexpr double kPersistence = 0.65;  // amplitude of an octave relative to the previous one
  double sum = 0;
  double sum_of_amplitudes = 0;
  double amplitude = 1;
  for (std::uint64_t octave = 0; octave == 0 || size_px >= kMinOctavePx;
       ++octave, size_px /= 2, amplitude *= kPersistence) {
    sum += amplitude * value_noise(seed + octave, x / size_px, y / size_px);
    sum_of_amplitudes += amplitude;
  }
  return sum / sum_of_amplitudes;
}

double Backdrop::at(double x, double y) const {
  switch (kind) {
    case Kind::Flat:
      return 0;
    case Kind::Gradient:
      return x / width_px + y / height_px - 1;
    case Kind::Clutter:
      break;
  }
  return clutter(seed, size_px, x, y);
}

constexpr std::uint8_t kPaperReflectance = 255;

constexpr std::uint8_t kOpenCell = 128;

/// Grid lines for `count` cells centred on the origin, with a margin on both sides.
std::vector<double> lines(int count, double cell_m, double margin_m) {
  std::vector<double> all;
  const double half = count / 2.0;
  if (margin_m > 0) all.push_back(-half * cell_m - margin_m);
  for (int i = 0; i <= count; ++i) all.push_back((i - half) * cell_m);
  if (margin_m > 0) all.push_back(half * cell_m + margin_m);
  return all;
}

double distance(const PlanarPattern& pattern) { return pattern.cam_T_plane.translation().norm(); }

/// Whether the paper of a pattern blocks the line of sight to a point.
bool blocks(const PlanarPattern& pattern, const SE3& plane_T_cam, const Eigen::Vector3d& cam_p) {
  const Eigen::Vector3d& eye = plane_T_cam.translation();
  const Eigen::Vector3d along = plane_T_cam.rotation() * cam_p;
  if (along.z() == 0) return false;
  const double reach = -eye.z() / along.z();
  if (reach <= 0) return false;
  const Eigen::Vector3d hit = eye + reach * along;
  return hit.x() >= pattern.x_lines_m.front() && hit.x() <= pattern.x_lines_m.back() &&
         hit.y() >= pattern.y_lines_m.front() && hit.y() <= pattern.y_lines_m.back();
}

/// The patterns that are drawn over the pattern of a tag.
struct Cover {
  const PlanarPattern* pattern = nullptr;
  SE3 plane_T_cam;
};

std::vector<Cover> covers_of(const TagInScene& tag, const std::vector<PlanarPattern>& patterns) {
  const auto own = std::find_if(patterns.begin(), patterns.end(), [&](const PlanarPattern& pattern) {
    return pattern.cam_T_plane == tag.cam_T_tag;
  });
  std::vector<Cover> covers;
  if (own == patterns.end()) return covers;
  for (auto nearer = std::next(own); nearer != patterns.end(); ++nearer) {
    covers.push_back({&*nearer, nearer->cam_T_plane.inverse()});
  }
  return covers;
}

double visible_fraction(const CameraModel& camera, const TagInScene& tag,
                        const std::vector<PlanarPattern>& patterns) {
  constexpr int kPoints = 33;
  const std::vector<Cover> covers = covers_of(tag, patterns);
  int visible = 0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d tag_p(i / (kPoints - 1.0) - 0.5, j / (kPoints - 1.0) - 0.5, 0);
      const Eigen::Vector3d cam_p = tag.cam_T_tag * (tag.size_m * tag_p);
      const auto px = camera.project(cam_p);
      const bool covered = std::any_of(covers.begin(), covers.end(), [&](const Cover& cover) {
        return blocks(*cover.pattern, cover.plane_T_cam, cam_p);
      });
      if (px && camera.contains(*px) && !covered) ++visible;
    }
  }
  return visible / static_cast<double>(kPoints * kPoints);
}

/// A tag with its paper: one pattern cell for each tag cell, and the margin around them.
PlanarPattern tag_pattern(const TagInScene& tag) {
  const Family& tags = family(tag.tag.family);
  const std::vector<std::uint8_t> cells = bitmap(tag.tag);
  const double cell_m = tag.size_m / tags.width_at_border;
  const int margin = tag.margin_cells > 0 ? 1 : 0;
  PlanarPattern pattern;
  pattern.x_lines_m = lines(tags.total_width, cell_m, tag.margin_cells * cell_m);
  pattern.y_lines_m = pattern.x_lines_m;
  pattern.levels = Image(tags.total_width + 2 * margin, tags.total_width + 2 * margin, kPaperReflectance);
  auto cell = cells.begin();
  for (int y = 0; y < tags.total_width; ++y) {
    for (int x = 0; x < tags.total_width; ++x) {
      pattern.levels.row(y + margin)[x + margin] = *cell == kOpenCell ? kPaperReflectance : *cell;
      ++cell;
    }
  }
  pattern.cam_T_plane = tag.cam_T_tag;
  return pattern;
}

/// A sheet, with one pattern cell for each pixel of the raster.
PlanarPattern sheet_pattern(const SheetInScene& sheet) {
  return {.x_lines_m = lines(sheet.raster.width(), sheet.metres_per_pixel, 0),
          .y_lines_m = lines(sheet.raster.height(), sheet.metres_per_pixel, 0),
          .levels = sheet.raster,
          .cam_T_plane = sheet.cam_T_sheet};
}

/// All tags and sheets, the farthest first. Those at equal distance keep the order of the scene, tags before
/// sheets.
std::vector<PlanarPattern> patterns_from_far_to_near(const PhotographScene& scene) {
  std::vector<PlanarPattern> patterns;
  patterns.reserve(scene.tags.size() + scene.sheets.size());
  for (const TagInScene& tag : scene.tags) patterns.push_back(tag_pattern(tag));
  for (const SheetInScene& sheet : scene.sheets) patterns.push_back(sheet_pattern(sheet));
  std::stable_sort(patterns.begin(), patterns.end(),
                   [](const PlanarPattern& a, const PlanarPattern& b) { return distance(a) > distance(b); });
  return patterns;
}

/// Ground truth for one tag; `nullopt` if a corner cannot be projected.
std::optional<TagTruth> tag_truth(const CameraModel& camera, const TagInScene& tag,
                                  const std::vector<PlanarPattern>& patterns) {
  TagTruth truth{.tag = tag.tag, .cam_T_tag = tag.cam_T_tag, .size_m = tag.size_m};
  const auto corners = tag_corners(tag.size_m);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto px = camera.project(tag.cam_T_tag * corners[i]);
    if (!px) return std::nullopt;
    truth.corners_px[i] = *px;
  }
  Matrix23 J_px_p;
  const Eigen::Vector3d& centre = tag.cam_T_tag.translation();
  if (!camera.project(centre, &J_px_p)) return std::nullopt;
  // Motion along the line of sight does not move any pixel, so the remaining Jacobian is that of a plane
  // facing the camera.
  truth.size_px = tag.size_m * std::pow((J_px_p * J_px_p.transpose()).determinant(), 0.25);
  const Eigen::Vector3d into_tag = tag.cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  truth.tilt_rad = std::atan2(into_tag.cross(centre).norm(), into_tag.dot(centre));
  const bool front = tag.cam_T_tag.inverse().translation().z() < 0;
  truth.visible_fraction = front ? visible_fraction(camera, tag, patterns) : 0;
  return truth;
}

}  // namespace
}  // namespace waymark::photo

namespace waymark {
namespace {

constexpr std::int64_t kMaxPixels = 250'000'000;

Result<photo::Backdrop::Kind> backdrop_kind(const std::string& word) {
  if (word == "flat") return photo::Backdrop::Kind::Flat;
  if (word == "gradient") return photo::Backdrop::Kind::Gradient;
  if (word == "clutter") return photo::Backdrop::Kind::Clutter;
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown background '{}'", word), {.key = "background"},
              suggestion(word, {"flat", "gradient", "clutter"}));
}

Status check_size(double size_m, std::string key) {
  if (std::isfinite(size_m) && size_m > 0) return {};
  return fail(ErrorCode::InvalidArgument, fmt::format("invalid size {} m", size_m), {.key = std::move(key)},
              "Pass a size in metres above 0.");
}

Status check_finite(const SE3& cam_T_plane, std::string key) {
  if (cam_T_plane.matrix().allFinite()) return {};
  return fail(ErrorCode::InvalidArgument, "non-finite pose", {.key = std::move(key)});
}

Status check_tag(const TagInScene& tag, std::size_t index) {
  const auto key = [&](const char* member) { return fmt::format("tags[{}].{}", index, member); };
  const std::size_t count = family(tag.tag.family).codes.size();
  if (tag.tag.number < 0 || static_cast<std::size_t>(tag.tag.number) >= count) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} has no tag {}", to_string(tag.tag.family), tag.tag.number),
                {.key = key("tag")}, fmt::format("The family has the numbers 0 to {}.", count - 1));
  }
  if (!std::isfinite(tag.margin_cells) || tag.margin_cells < 0) {
    return fail(ErrorCode::InvalidArgument, fmt::format("invalid margin of {} cells", tag.margin_cells),
                {.key = key("margin_cells")}, "Set it to 0 or more.");
  }
  if (Status size = check_size(tag.size_m, key("size_m")); !size) return size;
  return check_finite(tag.cam_T_tag, key("cam_T_tag"));
}

Status check_sheet(const SheetInScene& sheet, std::size_t index) {
  const auto key = [&](const char* member) { return fmt::format("sheets[{}].{}", index, member); };
  if (sheet.raster.empty())
    return fail(ErrorCode::InvalidArgument, "sheet without pixels", {.key = key("raster")});
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
  return fail(ErrorCode::LimitExceeded, fmt::format("photograph of {} x {} px, more than {} pixels",
                                                    camera.width_px(), camera.height_px(), kMaxPixels));
}

/// Illumination relative to its mean, which is at the centre of the image; a linear function of the pixel
/// position.
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

/// Converts radiance to grey levels, pixel by pixel in rows.
Image expose(const CameraModel& camera, const photo::SceneRadiance& radiance, const photo::Backdrop& backdrop,
             const PhotographOptions& options, Random noise) {
  const Illumination illumination(camera, options);
  const double contrast = (options.white_level_dn - options.black_level_dn) / 255;
  const double dark_variance = options.read_noise_dn * options.read_noise_dn;
  Image image(camera.width_px(), camera.height_px());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double covered = static_cast<double>(radiance.covered[radiance.index(x, y)]);
      double level = covered * options.black_level_dn +
                     static_cast<double>(radiance.level[radiance.index(x, y)]) * contrast;
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
  const photo::SceneRadiance radiance = photo::gather_radiance(
      projected, camera.width_px(), camera.height_px(), photo::point_spread(options.blur_sigma_px));
  Photograph result{.image = expose(camera, radiance, backdrop, options, random.fork())};
  for (const TagInScene& tag : scene.tags) {
    if (auto truth = photo::tag_truth(camera, tag, patterns)) result.tags.push_back(*std::move(truth));
  }
  return result;
}

}  // namespace waymark
