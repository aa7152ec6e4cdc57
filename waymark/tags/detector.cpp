#include "waymark/tags/detector.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <utility>

#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using Quad = std::array<Eigen::Vector2d, 4>;

/// Margin searched around a region. It includes the white margin of a tag at the edge of the region and the
/// neighbourhood that determines the threshold there.
constexpr std::int64_t kMarginPx = 16;

/// A clipped rectangle, computed without overflow.
struct Span2 {
  std::int64_t x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

Span2 clipped(const Span2& span, const ImageView& image) {
  return {
      std::clamp<std::int64_t>(span.x0, 0, image.width), std::clamp<std::int64_t>(span.y0, 0, image.height),
      std::clamp<std::int64_t>(span.x1, 0, image.width), std::clamp<std::int64_t>(span.y1, 0, image.height)};
}

Span2 span_of(const PixelRect& rect) {
  return {rect.x, rect.y, std::int64_t{rect.x} + std::max(rect.width, 0),
          std::int64_t{rect.y} + std::max(rect.height, 0)};
}

Span2 widened(const Span2& span, std::int64_t alignment, const ImageView& image) {
  Span2 wide =
      clipped({span.x0 - kMarginPx, span.y0 - kMarginPx, span.x1 + kMarginPx, span.y1 + kMarginPx}, image);
  wide.x0 -= wide.x0 % alignment;
  wide.y0 -= wide.y0 % alignment;
  return wide;
}

bool inside(const Eigen::Vector2d& point, const Span2& span) {
  return point.x() >= static_cast<double>(span.x0) && point.x() < static_cast<double>(span.x1) &&
         point.y() >= static_cast<double>(span.y0) && point.y() < static_cast<double>(span.y1);
}

/// Whether an edge of `a` separates `a` from `b`.
bool separated_by_an_edge_of(const Quad& a, const Quad& b) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d edge = a[(i + 1) % 4] - a[i];
    const Eigen::Vector2d normal(-edge.y(), edge.x());
    const auto range = [&](const Quad& quad) {
      std::array<double, 4> along{};
      for (std::size_t k = 0; k < 4; ++k) along[k] = normal.dot(quad[k] - a[i]);
      const auto [low, high] = std::minmax_element(along.begin(), along.end());
      return std::pair(*low, *high);
    };
    const auto [a_low, a_high] = range(a);
    const auto [b_low, b_high] = range(b);
    if (a_high <= b_low || b_high <= a_low) return true;
  }
  return false;
}

/// Separating axis theorem for convex quads.
bool overlap(const Quad& a, const Quad& b) {
  return !separated_by_an_edge_of(a, b) && !separated_by_an_edge_of(b, a);
}

auto position(const TagDetection& d) {
  return std::tuple(d.corners_px[0].x(), d.corners_px[0].y(), d.corners_px[2].x(), d.corners_px[2].y());
}

auto reading(const TagDetection& d) { return std::tuple(d.tag, d.hamming, -d.decision_margin, position(d)); }

}  // namespace

void sort_detections(std::vector<TagDetection>& detections) {
  std::sort(detections.begin(), detections.end(), [](const TagDetection& a, const TagDetection& b) {
    return std::tuple(a.tag, position(a), -a.decision_margin) <
           std::tuple(b.tag, position(b), -b.decision_margin);
  });
}

void remove_duplicates(std::vector<TagDetection>& detections) {
  std::sort(detections.begin(), detections.end(),
            [](const TagDetection& a, const TagDetection& b) { return reading(a) < reading(b); });
  std::vector<TagDetection> kept;
  kept.reserve(detections.size());
  for (const TagDetection& next : detections) {
    bool seen = false;
    for (std::size_t i = kept.size(); i > 0 && kept[i - 1].tag == next.tag && !seen; --i) {
      seen = overlap(kept[i - 1].corners_px, next.corners_px);
    }
    if (!seen) kept.push_back(next);
  }
  detections = std::move(kept);
  sort_detections(detections);
}

Result<std::vector<TagDetection>> Detector::detect(const ImageView& image,
                                                   std::span<const PixelRect> regions) const {
  std::vector<TagDetection> all;
  if (image.empty()) return all;
  for (const PixelRect& rect : regions) {
    const Span2 region = clipped(span_of(rect), image);
    if (region.x0 >= region.x1 || region.y0 >= region.y1) continue;
    const Span2 wide = widened(region, std::max(region_alignment_px(), 1), image);
    const ImageView part = crop(image, static_cast<int>(wide.x0), static_cast<int>(wide.y0),
                                static_cast<int>(wide.x1 - wide.x0), static_cast<int>(wide.y1 - wide.y0));
    Result<std::vector<TagDetection>> found = detect(part);
    if (!found) return found;
    const Eigen::Vector2d offset(static_cast<double>(wide.x0), static_cast<double>(wide.y0));
    for (TagDetection& detection : *found) {
      for (Eigen::Vector2d& corner : detection.corners_px) corner += offset;
      if (inside(center_px(detection.corners_px), region)) all.push_back(detection);
    }
  }
  remove_duplicates(all);
  return all;
}

Result<std::vector<FamilyId>> chosen_families(const DetectorOptions& options) {
  std::vector<FamilyId> ids;
  for (const std::string& name : options.families) {
    const Result<FamilyId> id = parse_family(name);
    if (!id) return fail(id.error().code, id.error().message, {.key = "families"}, id.error().hint);
    // If a family were listed twice, each of its tags would be reported twice.
    if (std::find(ids.begin(), ids.end(), *id) == ids.end()) ids.push_back(*id);
  }
  if (ids.empty()) {
    return fail(ErrorCode::InvalidArgument, "no tag family given", {.key = "families"},
                "Pass at least one, e.g. tag36h11.");
  }
  return ids;
}

}  // namespace waymark
