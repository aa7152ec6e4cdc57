#include "waymark/tags/tag_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/families/family.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/detector/quads.hpp"
#include "waymark/tags/detector/tag_reader.hpp"

namespace waymark {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

double apart_px(const Corners& a, const Corners& b) { return (center_px(a) - center_px(b)).norm(); }

/// Half the cross product of the diagonals; negative if the corners are in reverse order.
double area_px2(const Corners& c) {
  const Eigen::Vector2d a = c[2] - c[0];
  const Eigen::Vector2d b = c[3] - c[1];
  return 0.5 * (a.x() * b.y() - a.y() * b.x());
}

/// Range of the levels in a part of an image, and the greatest difference between neighbouring pixels.
struct Levels {
  int low = 255;
  int high = 0;
  int steepest = 0;
};

Levels levels_in(const ImageView& image, const Eigen::AlignedBox2d& box) {
  const int x0 = static_cast<int>(box.min().x());
  const int y0 = static_cast<int>(box.min().y());
  const int x1 = std::min(static_cast<int>(box.max().x()) + 1, image.width);
  const int y1 = std::min(static_cast<int>(box.max().y()) + 1, image.height);
  Levels levels;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const int level = image.row(y)[x];
      levels.low = std::min(levels.low, level);
      levels.high = std::max(levels.high, level);
      if (x > x0) levels.steepest = std::max(levels.steepest, std::abs(level - image.row(y)[x - 1]));
      if (y > y0) levels.steepest = std::max(levels.steepest, std::abs(level - image.row(y - 1)[x]));
    }
  }
  return levels;
}

}  // namespace

Eigen::AlignedBox2d box_of(const Corners& corners_px) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : corners_px) box.extend(corner);
  return box;
}

bool usable(const ExpectedTag& expected, const ImageView& image) {
  const Corners& corners = expected.corners_px;
  if (!std::ranges::all_of(corners, [](const auto& corner) { return corner.allFinite(); })) return false;
  const Eigen::AlignedBox2d box = box_of(corners);
  const bool in_view =
      (box.max().array() > 0).all() && box.min().x() < image.width && box.min().y() < image.height;
  return in_view && box.sizes().maxCoeff() < 2.0 * std::max(image.width, image.height) &&
         area_px2(corners) > 1;
}

const TagDetection* nearest(const std::vector<TagDetection>& found, const ExpectedTag& expected) {
  const TagDetection* best = nullptr;
  for (const TagDetection& one : found) {
    if (one.tag != expected.tag) continue;
    if (best == nullptr ||
        apart_px(one.corners_px, expected.corners_px) < apart_px(best->corners_px, expected.corners_px))
      best = &one;
  }
  return best;
}

bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected) {
  const TagDetection* near = nearest(found, expected);
  return near != nullptr &&
         apart_px(near->corners_px, expected.corners_px) < box_of(expected.corners_px).sizes().maxCoeff();
}

std::string_view to_string(MissReason reason) {
  switch (reason) {
    case MissReason::Outside:
      return "outside the image";
    case MissReason::TooFaint:
      return "too faint";
    case MissReason::Blurred:
      return "blurred";
    case MissReason::Occluded:
      return "occluded";
  }
  return "";
}

MissReason why_missed(const ImageView& image, const ExpectedTag& expected, int cells_across,
                      int min_white_black_diff) {
  const Eigen::AlignedBox2d box = box_of(expected.corners_px);
  const bool inside =
      (box.min().array() >= 0).all() && box.max().x() <= image.width && box.max().y() <= image.height;
  if (!inside || !usable(expected, image)) return MissReason::Outside;
  const Levels levels = levels_in(image, box);
  if (levels.high - levels.low < min_white_black_diff) return MissReason::TooFaint;
  const double cell_px = std::sqrt(area_px2(expected.corners_px)) / cells_across;
  const double edge_px = static_cast<double>(levels.high - levels.low) / std::max(levels.steepest, 1);
  return edge_px > cell_px ? MissReason::Blurred : MissReason::Occluded;
}

std::vector<MissedTag> missed_tags(const ImageView& image, std::span<const ExpectedTag> expected,
                                   const std::vector<TagDetection>& found, int min_white_black_diff) {
  std::vector<MissedTag> missed;
  for (const ExpectedTag& tag : expected) {
    if (found_at(found, tag)) continue;
    const int cells = family(tag.tag.family).width_at_border;
    missed.push_back({tag, why_missed(image, tag, cells, min_white_black_diff)});
  }
  return missed;
}

namespace {

/// The image scaled down by `factor`: each pixel is the mean of factor x factor pixels. Incomplete blocks at
/// the right and bottom are dropped. O(pixels).
Image shrunk(const ImageView& image, int factor) {
  Image small(image.width / factor, image.height / factor);
  const int area = factor * factor;
  std::vector<int> sums(static_cast<std::size_t>(small.width()));
  for (int y = 0; y < small.height(); ++y) {
    sums.assign(sums.size(), area / 2);
    for (int k = 0; k < factor; ++k) {
      const std::uint8_t* pixel = image.row(y * factor + k);
      for (int& sum : sums) {
        for (int i = 0; i < factor; ++i) sum += *pixel++;
      }
    }
    for (std::size_t x = 0; x < sums.size(); ++x) small.row(y)[x] = static_cast<std::uint8_t>(sums[x] / area);
  }
  return small;
}

search::Quad quad_of(const std::array<Eigen::Vector2d, 4>& corners) {
  search::Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = corners[i].cast<float>();
  return quad;
}

bool has_code(const TagId& tag) {
  return tag.number >= 0 && static_cast<std::size_t>(tag.number) < family(tag.family).codes.size();
}

}  // namespace

/// Reads a tag at its predicted position without a search.
struct TagTracker::Reader {
  std::vector<search::ReadableFamily> families;
  search::TagReader reader;
  bool find_inverted = false;

  std::optional<TagDetection> read(const ImageView& image, const ExpectedTag& expected) {
    const auto kind = std::ranges::find(families, expected.tag.family, &search::ReadableFamily::id);
    if (kind == families.end() || !has_code(expected.tag)) return std::nullopt;
    kind->known.assign(1, expected.tag.number);
    auto tag = read_as(image, expected, *kind, false);
    if (!tag && find_inverted) tag = read_as(image, expected, *kind, true);
    return tag;
  }

  std::optional<TagDetection> read_as(const ImageView& image, const ExpectedTag& expected,
                                      const search::ReadableFamily& kind, bool inverted) {
    constexpr float kMaxReachPx = 6;
    constexpr float kFinalReachPx = 1.5F;
    constexpr int kCrossingsPerEdge = 8;
    search::Quad quad = quad_of(expected.corners_px);
    const float cell_px = std::sqrt(search::area(quad)) / static_cast<float>(kind.width);
    const int sign = kind.bright_border == inverted ? 1 : -1;
    for (float reach = std::clamp(0.9F * cell_px, 1.0F, kMaxReachPx); reach > kFinalReachPx; reach *= 0.5F) {
      if (!search::sharpen_edges(image, {reach, sign, kCrossingsPerEdge}, quad)) return std::nullopt;
    }
    const float last = std::clamp(0.9F * cell_px, 1.0F, kFinalReachPx);
    if (!search::sharpen_edges(image, {last, sign}, quad)) return std::nullopt;
    search::ReadProgress progress;
    auto tag = reader.read(image, quad, kind, inverted, progress);
    if (tag && tag->tag != expected.tag) tag.reset();
    return tag;
  }
};

TagTracker::TagTracker(const Detector& detector, const TrackingOptions& options,
                       std::unique_ptr<Reader> reader)
    : detector_(&detector), options_(options), reader_(std::move(reader)) {}
TagTracker::TagTracker(TagTracker&&) noexcept = default;
TagTracker::~TagTracker() = default;

Result<TagTracker> TagTracker::make(const Detector& detector, const TrackingOptions& tracking) {
  constexpr int kMaxInterval = 1000;
  if (tracking.whole_every < 1 || tracking.whole_every > kMaxInterval) {
    return fail(ErrorCode::InvalidArgument, fmt::format("`whole_every` is {}", tracking.whole_every),
                {.key = "whole_every"}, fmt::format("Set it to a value from 1 to {}.", kMaxInterval));
  }
  const DetectorOptions& options = tracking.detector;
  if (const Status ranges = check_ranges(options); !ranges) return tl::unexpected<Error>(ranges.error());
  const Result<std::vector<FamilyId>> ids = chosen_families(options);
  if (!ids) return tl::unexpected<Error>(ids.error());
  auto reader = std::make_unique<Reader>(
      Reader{{},
             search::TagReader({.min_contrast = std::max(5.0, options.min_white_black_diff / 2.0),
                                .min_margin = options.min_decision_margin}),
             options.find_inverted});
  for (const FamilyId id : *ids) reader->families.emplace_back(family(id), options.max_hamming);
  return TagTracker(detector, tracking, std::move(reader));
}

std::vector<ExpectedTag> TagTracker::all_expected(std::span<const ExpectedTag> given) const {
  std::vector<ExpectedTag> all(given.begin(), given.end());
  for (const ExpectedTag& tag : moved_) {
    const auto same = [&](const ExpectedTag& other) {
      return found_at({{.tag = other.tag, .corners_px = other.corners_px}}, tag);
    };
    if (std::ranges::none_of(given, same)) all.push_back(tag);
  }
  return all;
}

/// Searches around the tag, at a scale at which its cells are a few pixels wide.
Status TagTracker::search_around(const ImageView& image, const ExpectedTag& tag,
                                 std::vector<TagDetection>& found) {
  constexpr double kFinestCell = 8;  // in px; images with larger cells are scaled down by at least two
  constexpr double kAround = 0.5;    // margin around the tag, as a fraction of its box, and
  constexpr double kAroundPx = 8;
  const Eigen::AlignedBox2d box = box_of(tag.corners_px);
  const Eigen::Vector2d room = (kAround * box.sizes()).array() + kAroundPx;
  const int x0 = std::max(static_cast<int>(box.min().x() - room.x()), 0);
  const int y0 = std::max(static_cast<int>(box.min().y() - room.y()), 0);
  const int x1 = static_cast<int>(std::min<double>(box.max().x() + room.x(), image.width));
  const int y1 = static_cast<int>(std::min<double>(box.max().y() + room.y(), image.height));
  if (x0 >= x1 || y0 >= y1) return {};
  const double cell_px = std::sqrt(static_cast<double>(search::area(quad_of(tag.corners_px)))) /
                         family(tag.tag.family).width_at_border;
  const int factor = cell_px >= kFinestCell ? static_cast<int>(cell_px / (0.5 * kFinestCell)) : 1;
  return search_region(image, {x0, y0, x1 - x0, y1 - y0}, factor, found);
}

/// Searches a part of the image, scaled down by a factor. Tags detected there are read again in the
/// full-resolution image.
Status TagTracker::search_region(const ImageView& image, const PixelRect& region, int factor,
                                 std::vector<TagDetection>& found) {
  if (factor == 1) {
    auto here = detector_->detect(image, std::span(&region, 1));
    if (!here) return tl::unexpected<Error>(here.error());
    found.insert(found.end(), here->begin(), here->end());
    return {};
  }
  const Image small = shrunk(crop(image, region.x, region.y, region.width, region.height), factor);
  auto here = detector_->detect(small);
  if (!here) return tl::unexpected<Error>(here.error());
  for (const TagDetection& coarse : *here) {
    ExpectedTag again{coarse.tag, coarse.corners_px};
    for (Eigen::Vector2d& corner : again.corners_px)
      corner = corner * factor + Eigen::Vector2d(region.x, region.y);
    if (const auto fine = reader_->read(image, again)) found.push_back(*fine);
  }
  return {};
}

/// Searches a strip at each scale. The strip is extended above and below by the height of the tags at that
/// scale, so that smaller tags lie entirely within it.
Status TagTracker::search_strip(const ImageView& image, std::vector<TagDetection>& found) {
  constexpr int kHighest = 64;  // tallest tags at a scale, in its px; the next scale covers taller ones
  const int strips = options_.whole_every;
  const int from = image.height * strip_ / strips;
  const int to = image.height * (strip_ + 1) / strips;
  strip_ = (strip_ + 1) % strips;
  for (int factor = 1; factor == 1 || factor * kHighest < 2 * image.height; factor *= 2) {
    const int reach = kHighest * factor / 2;
    const int y0 = std::max(from - reach, 0) / factor * factor;
    const int y1 = std::min(to + reach, image.height);
    if (Status status = search_region(image, {0, y0, image.width, y1 - y0}, factor, found); !status)
      return status;
  }
  return {};
}

void TagTracker::remember(const std::vector<TagDetection>& found) {
  moved_.clear();
  for (const TagDetection& tag : found) {
    ExpectedTag next{tag.tag, tag.corners_px};
    const TagDetection* before = nearest(last_, next);
    if (before != nullptr && found_at({*before}, next)) {
      for (std::size_t i = 0; i < 4; ++i) next.corners_px[i] += tag.corners_px[i] - before->corners_px[i];
    }
    moved_.push_back(next);
  }
  last_ = found;
}

Result<TrackedTags> TagTracker::next(const ImageView& image, std::span<const ExpectedTag> expected) {
  TrackedTags tracked;
  tracked.whole = since_whole_ == 0;
  since_whole_ = tracked.whole ? 1 : since_whole_ + 1;
  const std::vector<ExpectedTag> all = all_expected(expected);
  const auto fail_with = [&](const Error& error) {
    since_whole_ = 0;
    return tl::unexpected<Error>(error);
  };
  const auto search_whole = [&]() -> Status {
    auto whole = detector_->detect(image);
    if (!whole) return tl::unexpected<Error>(whole.error());
    tracked.detections.insert(tracked.detections.end(), whole->begin(), whole->end());
    tracked.whole = true;
    since_whole_ = 1;
    return {};
  };
  if (tracked.whole) {
    if (const Status status = search_whole(); !status) return fail_with(status.error());
  }
  for (const ExpectedTag& tag : all) {
    if (!usable(tag, image) || found_at(tracked.detections, tag)) continue;
    if (const auto read = reader_->read(image, tag)) {
      tracked.detections.push_back(*read);
    } else if (!tracked.whole) {
      const Status status = search_around(image, tag, tracked.detections);
      if (!status) return fail_with(status.error());
    }
  }
  if (options_.in_strips && !tracked.whole) {
    if (const Status status = search_strip(image, tracked.detections); !status)
      return fail_with(status.error());
  }
  if (tracked.detections.empty() && !all.empty() && !tracked.whole && !options_.in_strips) {
    if (const Status status = search_whole(); !status) return fail_with(status.error());
  }
  remove_duplicates(tracked.detections);
  tracked.missed = missed_tags(image, all, tracked.detections, options_.detector.min_white_black_diff);
  if (since_whole_ >= options_.whole_every && !options_.in_strips) since_whole_ = 0;
  remember(tracked.detections);
  return tracked;
}

}  // namespace waymark
