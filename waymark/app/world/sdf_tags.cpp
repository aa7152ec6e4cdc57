#include "waymark/app/world/sdf_tags.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "waymark/codecs/image_file.hpp"
#include "waymark/sdf/texture_place.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {
namespace {

/// Corners of a tag in the texture, and the white around it in cells.
struct TextureTag {
  TagId tag{};
  std::array<Eigen::Vector2d, 4> uv{};
  double margin_cells = 0;
};

/// The picture, enlarged where its cells would be few pixels, in a white frame: a tag may fill the whole of
/// it.
struct Framed {
  Image image;
  int enlarged = 1;
  int frame_px = 0;
};

Framed framed(const Image& picture) {
  constexpr int kSide_px = 400;
  const int shorter = std::min(picture.width(), picture.height());
  const int times = std::max(1, (kSide_px + shorter - 1) / shorter);
  const int frame = std::max(picture.width(), picture.height()) * times / 4;
  Framed made{Image(picture.width() * times + 2 * frame, picture.height() * times + 2 * frame, 255), times,
              frame};
  for (int y = 0; y < picture.height() * times; ++y)
    for (int x = 0; x < picture.width() * times; ++x)
      made.image.row(y + frame)[x + frame] = picture.row(y / times)[x / times];
  return made;
}

double margin_of(const TagDetection& found, const Framed& picture) {
  const Family& layout = family(found.tag.family);
  const auto side_px = (found.corners_px[1] - found.corners_px[0]).norm();
  double least_px = 1e9;
  for (const Eigen::Vector2d& corner : found.corners_px) {
    const Eigen::Vector2d in = corner - Eigen::Vector2d::Constant(picture.frame_px);
    const double width = picture.image.width() - 2.0 * picture.frame_px;
    const double height = picture.image.height() - 2.0 * picture.frame_px;
    least_px = std::min({least_px, in.x(), in.y(), width - in.x(), height - in.y()});
  }
  const double cell_px = side_px / layout.width_at_border;
  return std::max(0.0, least_px / cell_px - (layout.total_width - layout.width_at_border) / 2.0);
}

Result<std::vector<TextureTag>> tags_in(const std::string& file, const TagFinder& finder) {
  const Result<Image> picture = read_image(file);
  if (!picture) return tl::unexpected(picture.error());
  const Framed large = framed(*picture);
  const Result<FoundTags> found = find_tags(large.image, finder, nullptr);
  if (!found) return tl::unexpected(found.error());
  std::vector<TextureTag> tags;
  for (const TagDetection& detection : found->detections) {
    TextureTag tag{.tag = detection.tag, .margin_cells = margin_of(detection, large)};
    std::ranges::transform(
        detection.corners_px, tag.uv.begin(), [&](const Eigen::Vector2d& px) -> Eigen::Vector2d {
          const Eigen::Vector2d in = (px - Eigen::Vector2d::Constant(large.frame_px)) / large.enlarged;
          return {in.x() / picture->width(), in.y() / picture->height()};
        });
    tags.push_back(tag);
  }
  return tags;
}

/// Pose and size of a tag by its corners TL, TR, BR, BL.
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
    constexpr double kSmallest_m = 0.005;
    constexpr double kSquare = 0.02;
    if (!(painted.placed.size_m > kSmallest_m) || !(painted.error < kSquare)) return;
    if (quad.mirrored) {
      found_.warnings.push_back(fmt::format("{}: {} is mirrored there", visual.name, to_string(tag.tag)));
      return;
    }
    painted.visual = index;
    found_.tags.push_back(painted);
  }

  const TagFinder& finder_;
  PaintedTags& found_;
  std::map<std::string, std::vector<TextureTag>> textures_{};
};

}  // namespace

Result<PaintedTags> find_painted_tags(const SdfScene& scene, const std::vector<std::string>& families) {
  const auto finder = make_tag_finder({.families = families, .max_hamming = 0});
  if (!finder) return tl::unexpected(finder.error());
  PaintedTags found;
  TextureSearch search(*finder, found);
  for (std::size_t i = 0; i < scene.visuals.size(); ++i)
    if (!scene.visuals[i].texture.empty()) search.add(scene.visuals[i], i);
  return found;
}

}  // namespace waymark
