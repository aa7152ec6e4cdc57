#include "waymark/app/world/import_world.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/app/world/lay_world.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/base/error.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/samples/tag_map.hpp"
#include "waymark/sdf/read_sdf.hpp"
#include "waymark/sdf/texture_place.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

// Finding tags in the textures of a scene.

/// A tag in the texture of a visual.
struct PaintedTag {
  TagId tag{};
  MappedTag placed{};       ///< pose in the world frame, and size
  std::size_t visual = 0;   ///< index into SdfScene::visuals
  double margin_cells = 0;  ///< white margin outside the tag's total width, up to the nearest image edge
  double error = 0;         ///< relative deviation of width and height from their mean
};

struct PaintedTags {
  std::vector<PaintedTag> tags{};       ///< ordered by visual, then as in triangles_of()
  std::vector<std::string> warnings{};  ///< warnings about unreadable images and mirrored tags
};

/// Corners of a tag in a texture, and its white margin in cells.
struct TextureTag {
  TagId tag{};
  std::array<Eigen::Vector2d, 4> uv{};
  double margin_cells = 0;
};

/// A texture prepared for detection. It is enlarged, because a cell may be only a few pixels wide, and
/// surrounded with white, because a tag may fill the whole image.
struct FramedImage {
  Image image;
  int enlarged = 1;
  int frame_px = 0;
};

FramedImage add_frame(const Image& image) {
  constexpr int kSide_px = 400;
  const int shorter = std::min(image.width(), image.height());
  const int times = std::max(1, (kSide_px + shorter - 1) / shorter);
  const int frame = std::max(image.width(), image.height()) * times / 4;
  FramedImage made{Image(image.width() * times + 2 * frame, image.height() * times + 2 * frame, 255), times,
                   frame};
  for (int y = 0; y < image.height() * times; ++y)
    for (int x = 0; x < image.width() * times; ++x)
      made.image.row(y + frame)[x + frame] = image.row(y / times)[x / times];
  return made;
}

double margin_of(const TagDetection& found, const FramedImage& photo) {
  const Family& layout = family(found.tag.family);
  const auto side_px = (found.corners_px[1] - found.corners_px[0]).norm();
  double least_px = 1e9;
  for (const Eigen::Vector2d& corner : found.corners_px) {
    const Eigen::Vector2d in = corner - Eigen::Vector2d::Constant(photo.frame_px);
    const double width = photo.image.width() - 2.0 * photo.frame_px;
    const double height = photo.image.height() - 2.0 * photo.frame_px;
    least_px = std::min({least_px, in.x(), in.y(), width - in.x(), height - in.y()});
  }
  const double cell_px = side_px / layout.width_at_border;
  return std::max(0.0, least_px / cell_px - (layout.total_width - layout.width_at_border) / 2.0);
}

Result<std::vector<TextureTag>> tags_in(const std::string& file, const TagFinder& finder) {
  const Result<Image> image = read_image(file);
  if (!image) return tl::unexpected(image.error());
  const FramedImage large = add_frame(*image);
  const Result<FoundTags> found = find_tags(large.image, finder, ImageLens::unknown());
  if (!found) return tl::unexpected(found.error());
  std::vector<TextureTag> tags;
  for (const TagDetection& detection : found->detections) {
    if (!usable_corners(detection)) continue;
    TextureTag tag{.tag = detection.tag, .margin_cells = margin_of(detection, large)};
    std::ranges::transform(
        detection.corners_px, tag.uv.begin(), [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
          const Eigen::Vector2d in = (px - Eigen::Vector2d::Constant(large.frame_px)) / large.enlarged;
          return {in.x() / image->width(), in.y() / image->height()};
        });
    tags.push_back(tag);
  }
  return tags;
}

/// Computes the pose and size of a tag from its corners TL, TR, BR, BL.
PaintedTag placed(const TextureTag& tag, const PlacedQuad& quad, const SE3& world_T_visual) {
  const auto& p = quad.visual_p;
  const Eigen::Vector3d right = (p[1] - p[0] + p[2] - p[3]) / 2;
  const Eigen::Vector3d down = (p[3] - p[0] + p[2] - p[1]) / 2;
  const Eigen::Vector3d x = right.normalized();
  const Eigen::Vector3d z = x.cross(down).normalized();
  Eigen::Matrix3d R;
  R << x, z.cross(x), z;
  const SE3 visual_T_tag(SO3::from_matrix(R), (p[0] + p[1] + p[2] + p[3]) / 4);
  const double size_m = (right.norm() + down.norm()) / 2;
  return {.tag = tag.tag,
          .placed = {.map_T_tag = world_T_visual * visual_T_tag, .size_m = size_m},
          .margin_cells = tag.margin_cells,
          .error = std::abs(right.norm() - down.norm()) / (2 * size_m)};
}

class TextureSearch {
 public:
  TextureSearch(const TagFinder& finder, PaintedTags& found) : finder_(finder), found_(found) {}

  void add(const SdfVisual& visual, std::size_t index) {
    const std::vector<TexturedTriangle> triangles = triangles_of(visual);
    if (triangles.empty()) return;
    for (const TextureTag& tag : tags_of(visual.texture))
      for (const PlacedQuad& quad : placed_on(triangles, tag.uv)) add(tag, quad, visual, index);
  }

 private:
  const std::vector<TextureTag>& tags_of(const std::string& file) {
    const auto [known, fresh] = textures_.try_emplace(file);
    if (fresh) {
      auto tags = tags_in(file, finder_);
      if (tags)
        known->second = std::move(*tags);
      else
        found_.warnings.push_back(to_string(tags.error()));
    }
    return known->second;
  }

  void add(const TextureTag& tag, const PlacedQuad& quad, const SdfVisual& visual, std::size_t index) {
    PaintedTag painted = placed(tag, quad, visual.world_T_visual);
    constexpr double kMinSize_m = 0.005;
    constexpr double kMaxError = 0.02;
    if (!(painted.placed.size_m > kMinSize_m) || !(painted.error < kMaxError)) return;
    if (quad.mirrored) {
      found_.warnings.push_back(fmt::format("{}: {} is mirrored", visual.name, to_string(tag.tag)));
      return;
    }
    painted.visual = index;
    found_.tags.push_back(painted);
  }

  const TagFinder& finder_;
  PaintedTags& found_;
  std::map<std::string, std::vector<TextureTag>> textures_{};
};

/// Finds tags from `families` in the textures of a scene. They are detected in the images, regardless of file
/// names, and placed on the shape according to the texture coordinates. Tags are ignored if they are smaller
/// than 5 mm, or if they are not square within 2 %, because they are on the narrow sides of a board. Fails if
/// a family is unknown.
Result<PaintedTags> find_painted_tags(const SdfScene& scene, const std::vector<std::string>& families) {
  const auto finder = make_tag_finder({.families = families, .max_hamming = 0});
  if (!finder) return tl::unexpected(finder.error());
  PaintedTags found;
  TextureSearch search(*finder, found);
  for (std::size_t i = 0; i < scene.visuals.size(); ++i)
    if (!scene.visuals[i].texture.empty()) search.add(scene.visuals[i], i);
  return found;
}

// Converting a scene to a world.

using Vec3 = Eigen::Vector3d;

/// Thickness [m] of the board that carries `front`, if `back` is on its back.
std::optional<double> board_between(const MappedTag& front, const MappedTag& back) {
  const SE3 front_T_back = front.map_T_tag.inverse() * back.map_T_tag;
  const Vec3& t = front_T_back.translation();
  const bool opposite = (front_T_back.rotation() * Vec3::UnitZ()).z() < -0.999;
  constexpr double kMaxThickness_m = 0.1;
  const bool behind = t.z() > 0 && t.z() < kMaxThickness_m && t.head<2>().norm() < 0.1 * front.size_m;
  return opposite && behind ? std::optional(t.z()) : std::nullopt;
}

FamilyId most_common_family(const std::vector<PaintedTag>& tags) {
  std::map<FamilyId, int> counts;
  for (const PaintedTag& tag : tags) ++counts[tag.tag.family];
  return std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
}

double rounded(double value, double step) { return std::round(value / step) * step; }

void take_tags(const std::vector<PaintedTag>& painted, World& world, std::vector<std::string>& warnings) {
  const FamilyId family = most_common_family(painted);
  std::vector<double> boards_m;
  double margin_cells = 1e9;
  for (const PaintedTag& tag : painted) {
    if (tag.tag.family != family) {
      warnings.push_back(fmt::format("{} is omitted, because all tags in a world must be from one family",
                                     to_string(tag.tag)));
      continue;
    }
    MappedTag placed = tag.placed;
    constexpr double kTenthOfAMillimetre = 1e-4;
    placed.size_m = rounded(placed.size_m, kTenthOfAMillimetre);
    margin_cells = std::min(margin_cells, tag.margin_cells);
    const auto [known, fresh] = world.tags.tags.emplace(tag.tag, placed);
    if (fresh) continue;
    if (const auto board_m = board_between(known->second, placed))
      boards_m.push_back(*board_m);
    else
      warnings.push_back(fmt::format("{} is a duplicate; its first pose is used", to_string(tag.tag)));
  }
  world.anchor = world.tags.tags.begin()->first;
  world.tag_margin_cells = std::max(0.0, rounded(margin_cells, 0.05));
  if (boards_m.empty()) return;
  std::ranges::nth_element(boards_m, boards_m.begin() + static_cast<std::ptrdiff_t>(boards_m.size() / 2));
  world.tag_board_m = rounded(boards_m[boards_m.size() / 2], 1e-4);
  if (boards_m.size() < world.tags.tags.size())
    warnings.push_back(
        fmt::format("{} of {} tags are also on the back of their boards; this is assumed for all tags",
                    boards_m.size(), world.tags.tags.size()));
}

/// The box that represents a shape. It is rotated about z if one of the shape's axes is vertical; otherwise
/// it is the bounding box along the world axes. `exact` is set if the shape itself is such an upright box.
Occluder upright_box(const SdfVisual& visual, bool& exact) {
  const Eigen::Matrix3d R = visual.world_T_visual.rotation().matrix();
  Occluder box{.centre_m = visual.world_T_visual * visual.visual_t_centre, .reflectance = visual.reflectance};
  exact = visual.shape == SdfShape::Box;
  for (int up = 0; up < 3; ++up) {
    constexpr double kVertical = 0.9998;  // within about a degree of the vertical
    if (std::abs(R(2, up)) < kVertical) continue;
    const int along = (up + 1) % 3, across = (up + 2) % 3;
    box.yaw_rad = std::atan2(R(1, along), R(0, along));
    box.size_m = {visual.size_m[along], visual.size_m[across], visual.size_m[up]};
    if (visual.shape == SdfShape::Cylinder) exact = false;
    return box;
  }
  exact = false;
  box.size_m = R.cwiseAbs() * visual.size_m;
  return box;
}

/// Whether the visual is merely a thin board that carries a tag.
bool carries_a_tag(const SdfVisual& visual, const World& world) {
  constexpr double kThin_m = 0.05;
  if (visual.size_m.minCoeff() > kThin_m) return false;
  const Vec3 middle = visual.world_T_visual * visual.visual_t_centre;
  return std::ranges::any_of(world.tags.tags, [&](const auto& entry) {
    return (entry.second.map_T_tag.translation() - middle).norm() < kThin_m + world.tag_board_m &&
           visual.size_m.maxCoeff() < 3 * entry.second.size_m;
  });
}

void take_scenery(const SdfScene& scene, World& world, std::vector<std::string>& warnings) {
  std::set<std::string> moving;
  int approximated = 0;
  for (const SdfVisual& visual : scene.visuals) {
    if (!visual.fixed) {
      moving.insert(visual.name.substr(0, visual.name.find("::")));
      continue;
    }
    const Vec3 up = visual.world_T_visual.rotation() * visual.visual_n_plane;
    if (visual.shape == SdfShape::Plane && up.z() > 0.999 && visual.texture.empty())
      world.floor.reflectance = visual.reflectance;
    if (visual.shape == SdfShape::Plane || carries_a_tag(visual, world)) continue;
    constexpr double kMinSize_m = 1e-3;
    constexpr double kMaxSize_m = 1000;
    bool exact = false;
    Occluder box = upright_box(visual, exact);
    if (box.size_m.minCoeff() < kMinSize_m || box.size_m.maxCoeff() > kMaxSize_m) {
      warnings.push_back(fmt::format(
          "{} is omitted: its shape is unknown, or its size is not from 1 mm to 1 km", visual.name));
      continue;
    }
    if (box.centre_m.z() + box.size_m.z() / 2 < 0.01) continue;  // this is part of the floor
    if (!exact) ++approximated;
    world.occluders.push_back(box);
  }
  if (approximated > 0)
    warnings.push_back(
        fmt::format("replaced {} shapes that are not upright boxes by their bounding boxes", approximated));
  for (const std::string& model : moving)
    warnings.push_back(fmt::format("{} is omitted: it is not static", model));
}

}  // namespace

Result<World> world_of(const SdfScene& scene, const std::vector<std::string>& families,
                       std::vector<std::string>& warnings) {
  const auto painted = find_painted_tags(scene, families);
  if (!painted) return tl::unexpected(painted.error());
  warnings.insert(warnings.end(), painted->warnings.begin(), painted->warnings.end());
  if (painted->tags.empty())
    return fail(
        ErrorCode::NotFound,
        fmt::format("no readable tag in any texture ({} of {} visuals have a texture)",
                    std::ranges::count_if(scene.visuals, [](const auto& v) { return !v.texture.empty(); }),
                    scene.visuals.size()),
        {}, "Check the tag families (`family`) and the model folders (`models`).");
  World world{.name = scene.name};
  take_tags(painted->tags, world, warnings);
  take_scenery(scene, world, warnings);
  return world;
}

namespace {

/// Sets the line to drive to one metre straight ahead of a model or of the origin.
Status short_line(const SdfScene& scene, const std::string& start, ImportWorldReport& report) {
  const auto model = std::ranges::find_if(
      scene.models, [&](const SdfModelPose& m) { return start.empty() ? !m.fixed : m.name == start; });
  const bool found = model != scene.models.end();
  if (!start.empty() && !found) {
    std::string names;
    for (const SdfModelPose& known : scene.models) names += (names.empty() ? "" : ", ") + known.name;
    return fail(ErrorCode::NotFound, fmt::format("unknown model '{}'", start), {.key = "start"},
                fmt::format("Known: {}.", names));
  }
  const SE3 from = found ? model->world_T_model : SE3();
  const Eigen::Vector2d begin = from.translation().head<2>();
  const Eigen::Vector2d ahead = (from.rotation() * Eigen::Vector3d::UnitX()).head<2>();
  report.world.path_closed = false;
  for (const double distance_m : {0.0, 0.5, 1.0})
    report.world.path_m.emplace_back(begin + distance_m * ahead.normalized());
  report.warnings.push_back(
      fmt::format("the line to drive is one metre long and starts at {}; set `path` to use a different line "
                  "(`driver=keyboard` needs no line)",
                  found ? model->name : "the origin"));
  return {};
}

}  // namespace

Result<ImportWorldReport> import_world(const ImportWorldJob& job, const JobControl& control) {
  if (Status status = check_output_file(job.output); !status) return tl::unexpected(status.error());
  const auto scene = or_wrong_kind(read_sdf(job.file, job.folders), job.file, FileUse::SdfWorld);
  if (!scene) return tl::unexpected(scene.error());
  ImportWorldReport report{.file = job.output.string(), .warnings = scene->warnings};
  auto world = world_of(*scene, job.families, report.warnings);
  if (!world) {
    for (const std::string& warning : report.warnings)
      control.note("warning: " + warning);  // the warnings may explain the error
    Error error = world.error();
    if (error.place.source.empty()) error.place.source = job.file.string();
    return tl::unexpected(std::move(error));
  }
  report.world = std::move(*world);
  for (const SdfLight& light : scene->lights)
    report.lights.push_back(fmt::format("{}: {}, intensity {:g}", light.name, light.kind, light.intensity));
  if (job.path.empty()) {
    if (Status status = short_line(*scene, job.start, report); !status) return tl::unexpected(status.error());
  } else {
    auto line = read_line(job.path, control);
    if (!line) return tl::unexpected(line.error());
    report.world.path_m = std::move(line->path_m);
    report.world.path_closed = line->path_closed;
  }
  const std::string yaml = to_yaml(report.world);
  if (const auto again = parse_world(yaml, job.output.string()); !again) return tl::unexpected(again.error());
  const auto earlier = move_aside(job.output, yaml);
  if (!earlier) return tl::unexpected(earlier.error());
  if (!earlier->empty()) control.note("the existing file was renamed to " + *earlier);
  if (Status status = write_text_file(job.output, yaml); !status) return tl::unexpected(status.error());
  return report;
}

std::string to_text(const ImportWorldReport& report) {
  const World& world = report.world;
  std::string text = fmt::format("{}: {} tags ({} to {}), {} pieces of furniture\n", report.file,
                                 world.tags.tags.size(), to_string(world.tags.tags.begin()->first),
                                 to_string(world.tags.tags.rbegin()->first), world.occluders.size());
  if (world.tag_board_m > 0)
    text += fmt::format("tags are on both sides of {:.1f} mm thick boards\n", 1e3 * world.tag_board_m);
  for (const std::string& light : report.lights)
    text += fmt::format("light {} (ignored; set the lighting with `set=camera.…`)\n", light);
  return text + fmt::format("Check it: waymark world check {}\n", shell_word(report.file));
}

ReportFields fields(const ImportWorldReport& report) {
  return {{"file", "World file", report.file},
          {"tags", "Number of tags", report.world.tags.tags.size()},
          {"furniture", "Number of pieces of furniture", report.world.occluders.size()},
          {"two_sided_board_m", "Thickness of the boards with tags on both sides; 0 without such boards",
           report.world.tag_board_m},
          {"lights", "Lights in the file; ignored", report.lights},
          {"warnings", "Omissions and simplifications", report.warnings}};
}

}  // namespace waymark
