#include "waymark/tags/detector/tag_search.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace waymark::search {
namespace {

/// Parameters for binarising the image.
struct PlaneRule {
  std::uint16_t share_256 = 128;  ///< see ThresholdRule
  int row_step = 1;               ///< see BitPlane
  int gates = 1;                  ///< minimum range of levels in a window, in multiples of the global minimum
  bool diagonals = true;          ///< whether pixels that share only a corner are joined in a second pass
};

/// The first threshold is at a low share of the local range. A border that is darkened by a shadow or joined
/// to mid-grey surroundings still lies below it, but the paper does not. Tags found this way are large and
/// not faint, so half of the rows suffice. The second threshold is at half of the range, for small, blurred
/// and faint tags.
constexpr std::array<PlaneRule, 2> kPlanes = {{{64, 2, 2, false}, {128, 1, 1, true}}};

bool inside(const std::array<Eigen::Vector2d, 4>& corners, const Eigen::Vector2d& point) {
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d edge = corners[(i + 1) % 4] - corners[i];
    const Eigen::Vector2d to = point - corners[i];
    if (edge.x() * to.y() - edge.y() * to.x() <= 0) return false;
  }
  return true;
}

double area_of(const std::array<Eigen::Vector2d, 4>& c) {
  const Eigen::Vector2d a = c[2] - c[0];
  const Eigen::Vector2d b = c[3] - c[1];
  return 0.5 * (a.x() * b.y() - a.y() * b.x());
}

/// The quad with each corner moved outwards by this many pixels along its diagonal.
Quad grown(const Quad& quad, float by_px) {
  constexpr float kMinRadiusPx = 4;  // px
  const Eigen::Vector2f middle = 0.25F * (quad[0] + quad[1] + quad[2] + quad[3]);
  Quad out;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2f from = quad[i] - middle;
    out[i] = middle + from * (1 + by_px / std::max(kMinRadiusPx, from.norm()));
  }
  return out;
}

}  // namespace

TagSearch::TagSearch(const SearchOptions& options, const PlaneKernels& kernels)
    : options_(options),
      kernels_(&kernels),
      reader_({.min_contrast = std::max(5.0, options.min_white_black_diff / 2.0),
               .min_margin = options.min_decision_margin}) {}

const std::vector<TagDetection>& TagSearch::run(const ImageView& image,
                                                const std::vector<ReadableFamily>& families) {
  found_.clear();
  counts_ = {};
  measure_tiles(image, *kernels_, tiles_);
  gate_ = noise_gate(tiles_, options_.min_white_black_diff);
  for (const Polarity polarity : {Polarity::Dark, Polarity::Bright}) {
    wanted_.clear();
    least_width_ = 0;
    for (const ReadableFamily& family : families) {
      const bool upright = family.bright_border == (polarity == Polarity::Bright);
      if (!upright && !options_.find_inverted) continue;
      wanted_.push_back({&family, !upright});
      least_width_ = least_width_ == 0 ? family.width : std::min(least_width_, family.width);
    }
    if (!wanted_.empty()) search_polarity(image, polarity);
  }
  return found_;
}

void TagSearch::search_polarity(const ImageView& image, Polarity polarity) {
  boxes_.clear();
  const bool dark = polarity == Polarity::Dark;
  for (const PlaneRule& plane : kPlanes) {
    const int gate = std::clamp(plane.gates * options_.min_white_black_diff, gate_, 255);
    const ThresholdRule rule{dark, plane.share_256, static_cast<std::uint8_t>(gate)};
    threshold(image, tiles_, rule, *kernels_, plane_, plane.row_step);
    search_plane(image, polarity, plane.diagonals);
  }
}

void TagSearch::search_plane(const ImageView& image, Polarity polarity, bool diagonals) {
  components_.label(plane_, *kernels_, diagonals);
  counts_.runs += components_.runs().size();
  counts_.components += components_.components().size();
  search_components(image, polarity, false);
  if (!diagonals) return;
  components_.join_diagonals();
  search_components(image, polarity, true);
}

void TagSearch::search_components(const ImageView& image, Polarity polarity, bool joined) {
  const auto count = static_cast<std::int32_t>(components_.components().size());
  for (std::int32_t i = 0; i < count; ++i) {
    if (!components_.is_root(i)) continue;
    const Component& component = components_.components()[static_cast<std::size_t>(i)];
    if (joined && !component.joined_diagonally) continue;
    // The same frame is often found again, at the other threshold or joined to something inside it.
    if (may_be_frame(image, component) && boxes_.insert(component))
      search_component(image, polarity, component);
  }
}

/// Considers only the box and the area, and accepts any frame one cell wide around a tag with at least one
/// pixel per cell.
bool TagSearch::may_be_frame(const ImageView& image, const Component& component) const {
  constexpr double kBoxShare = 0.12;
  constexpr int kFrame = 3;           // minimum area in px, per px of the length of the frame
  constexpr double kRunsARow = 1.25;  // a frame has two or more runs in most rows, a spot has one
  constexpr double kMaxRunsARow = 5;
  const int width = component.x1 - component.x0;
  const int height = component.y1 - component.y0;
  if (width < 5 || height < 5 || width + height < 2 * least_width_) return false;
  if (component.run_count < kRunsARow * height || component.run_count > kMaxRunsARow * height) return false;
  if (component.area < std::min(kBoxShare * width * height, 1.0 * kFrame * (width + height))) return false;
  return width < 0.95 * image.width || height < 0.95 * image.height;
}

/// Whether a tag has already been found at this quad. A tag printed inside another one, which may be found
/// first, is much smaller than it.
bool TagSearch::known(const Quad& quad) const {
  constexpr double kMaxInnerArea = 0.05;
  constexpr double kMinOuterArea = 8;
  const Eigen::Vector2d middle = (0.5F * (quad[0] + quad[2])).cast<double>();
  const double size = area(quad);
  return std::ranges::any_of(found_, [&](const TagDetection& tag) {
    const double area_found = area_of(tag.corners_px);
    return inside(tag.corners_px, middle) && size > kMaxInnerArea * area_found &&
           size < kMinOuterArea * area_found;
  });
}

namespace {

constexpr float kPreciseCell = 2;  // in px; the outline of smaller cells is too imprecise
constexpr float kSmallCell = 5;    // in px; a deviation of one pixel does not matter for larger cells

}  // namespace

void TagSearch::search_component(const ImageView& image, Polarity polarity, const Component& component) {
  constexpr float kMaxReachPx = 2.5F;
  constexpr float kReachBeyondCell = 1.25F;  // in cells
  constexpr float kLargeCell = 3;            // in px
  constexpr double kRunsARow = 2;            // minimum for a border with bits inside
  Attempt attempt;
  if (!fitter_.fit(components_, component, attempt.outline)) return;
  ++counts_.quads;
  if (known(attempt.outline)) return;
  attempt.cell_px = std::sqrt(area(attempt.outline)) / static_cast<float>(least_width_);
  attempt.sign = polarity == Polarity::Dark ? 1 : -1;
  attempt.reach_px = std::clamp(0.9F * attempt.cell_px, 1.0F, kMaxReachPx);
  if (read_outline(image, attempt) || read_overexposed(image, attempt)) return;
  // An object that touches a side of the border and extends beyond it shifts the outline by up to a cell.
  const int height = component.y1 - component.y0;
  if (attempt.cell_px < kLargeCell || component.run_count < kRunsARow * height) return;
  attempt.reach_px = kReachBeyondCell * attempt.cell_px;
  attempt.far = true;
  read_outline(image, attempt);
}

bool TagSearch::read_outline(const ImageView& image, Attempt& attempt) {
  constexpr int kCrossingsPerEdge = 8;  // enough to locate the edge
  constexpr int kMinChangesToVary = 14;
  constexpr float kFinalReachPx = 1.5F;
  const bool precise = attempt.cell_px > kPreciseCell;
  // Out of 8. Either the outline of a component is at most a pixel off, or half of it is correct.
  constexpr int kMinSteps = 5;
  constexpr int kHalf = 4;
  if (precise && !has_steps_outwards(image, attempt.outline, attempt.far ? kHalf : kMinSteps)) return false;
  attempt.sharpened = attempt.outline;
  const EdgeSearch first{attempt.reach_px, attempt.sign, kCrossingsPerEdge, attempt.far};
  if (!sharpen_edges(image, first, attempt.sharpened)) return false;
  if (precise && !has_steps_outwards(image, attempt.sharpened, kMinSteps)) return false;
  sharpen_edges(image, {std::min(kFinalReachPx, attempt.reach_px), attempt.sign}, attempt.sharpened);
  ReadProgress progress;
  if (read_any(image, attempt.sharpened, progress)) return true;
  if (!progress.border_seen || progress.changes < kMinChanges) return false;
  if (!attempt.far && attempt.cell_px < kSmallCell && read_varied(image, attempt)) return true;
  return precise && progress.changes >= kMinChangesToVary && read_covered(image, attempt.sharpened);
}

bool TagSearch::has_steps_outwards(const ImageView& image, const Quad& quad, int least) {
  return std::ranges::any_of(wanted_, [&](const Wanted& wanted) {
    return reader_.steps_outwards(image, quad, *wanted.family, wanted.inverted) >= least;
  });
}

bool TagSearch::read_any(const ImageView& image, const Quad& quad, ReadProgress& best) {
  for (const Wanted& wanted : wanted_) {
    ReadProgress progress;
    const auto tag = reader_.read(image, quad, *wanted.family, wanted.inverted, progress);
    counts_.borders += progress.border_seen ? 1 : 0;
    best.border_seen = best.border_seen || progress.border_seen;
    best.changes = std::max(best.changes, progress.changes);
    if (tag && keep(image, wanted, *tag)) return true;
  }
  return false;
}

/// The outlines of small and blurred tags are off by part of a cell; growing or shrinking them by a pixel
/// makes these tags readable. This is attempted only if the border was detected, because no tag in the
/// rendered sets was read otherwise.
bool TagSearch::read_varied(const ImageView& image, const Attempt& attempt) {
  constexpr std::array<float, 5> kGrowth = {-0.35F, 0.3F, -0.7F, 0.6F, -1.0F};
  ReadProgress ignored;
  if (read_any(image, attempt.outline, ignored)) return true;
  for (std::size_t i = 0; i < kGrowth.size(); ++i) {
    const Quad quad = grown(i % 2 == 0 ? attempt.outline : attempt.sharpened, 1.414F * kGrowth[i]);
    if (read_any(image, quad, ignored)) return true;
  }
  return false;
}

/// If something covers one side of the border, the quad ends where the covering object begins or, if that
/// object is dark and extends outwards, where it ends. The bits inside reveal which side is affected and
/// where it really is.
bool TagSearch::read_covered(const ImageView& image, const Quad& quad) {
  for (const Wanted& wanted : wanted_) {
    const ReadableFamily& family = *wanted.family;
    const MisplacedSides misplaced = grid_.misplaced_sides(image, quad, family, wanted.inverted);
    for (std::size_t i = 0; i < misplaced.count; ++i) {
      const MisplacedSide& at = misplaced.sides[i];
      for (const float off : {0.0F, 0.2F, -0.2F, 0.4F, -0.4F}) {
        const Quad whole = with_side_moved(at.quad, at.side, at.missing + off, family.width);
        const auto tag = reader_.read_covered(image, whole, family, wanted.inverted, at.side);
        if (tag && keep(image, wanted, *tag)) return true;
      }
    }
  }
  return false;
}

/// Whether the image is saturated near all corners.
bool TagSearch::overexposed(const std::array<Eigen::Vector2d, 4>& corners_px) const {
  constexpr int kSaturated = 254;
  return std::ranges::all_of(corners_px, [&](const Eigen::Vector2d& corner) {
    const int column = std::clamp(static_cast<int>(corner.x()) / kTilePx, 0, tiles_.columns - 1);
    const int row = std::clamp(static_cast<int>(corner.y()) / kTilePx, 0, tiles_.rows - 1);
    return tiles_.window_high[at(row * tiles_.columns + column)] >= kSaturated;
  });
}

/// White far beyond the range of the image spreads over the rims of black cells. The visible border then lies
/// inside the printed one by about the width of the blur.
bool TagSearch::read_overexposed(const ImageView& image, const Attempt& attempt) {
  constexpr std::array<float, 3> kSpreadPx = {1.2F, 1.8F, 0.6F};
  std::array<Eigen::Vector2d, 4> corners_px;
  for (std::size_t i = 0; i < 4; ++i) corners_px[i] = attempt.outline[i].cast<double>();
  if (!overexposed(corners_px)) return false;
  for (const float spread_px : kSpreadPx) {
    const Quad quad = grown(attempt.outline, 1.414F * spread_px * static_cast<float>(attempt.sign));
    for (const Wanted& wanted : wanted_) {
      auto tag = reader_.read_overexposed(image, quad, *wanted.family, wanted.inverted);
      if (!tag || !grid_.align_overexposed(image, *wanted.family, wanted.inverted, *tag)) continue;
      found_.push_back(*tag);
      return true;
    }
  }
  return false;
}

/// Rejects a tag whose bits do not agree with its corners.
bool TagSearch::keep(const ImageView& image, const Wanted& wanted, TagDetection tag) {
  if (overexposed(tag.corners_px) && grid_.align_overexposed(image, *wanted.family, wanted.inverted, tag)) {
    found_.push_back(tag);
    return true;
  }
  if (!grid_.align_corners(image, *wanted.family, wanted.inverted, tag)) return false;
  found_.push_back(tag);
  return true;
}

}  // namespace waymark::search
