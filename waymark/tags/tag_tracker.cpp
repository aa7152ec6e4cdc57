#include "waymark/tags/tag_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "waymark/families/family.hpp"
#include "waymark/image/sampling.hpp"
#include "waymark/samples/corners.hpp"
#include "waymark/tags/quads.hpp"
#include "waymark/tags/shrink.hpp"
#include "waymark/tags/tag_reader.hpp"

namespace waymark {
namespace {

using Corners = std::array<Eigen::Vector2d, 4>;

struct Box {
  double x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

Box box_of(const Corners& corners) {
  Box box{corners[0].x(), corners[0].y(), corners[0].x(), corners[0].y()};
  for (const Eigen::Vector2d& corner : corners) {
    box = {std::min(box.x0, corner.x()), std::min(box.y0, corner.y()), std::max(box.x1, corner.x()),
           std::max(box.y1, corner.y())};
  }
  return box;
}

search::Quad quad_of(const Corners& corners) {
  search::Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = corners[i].cast<float>();
  return quad;
}

bool usable(const ExpectedTag& tag, const ImageView& image) {
  const bool finite = std::ranges::all_of(tag.corners_px, [](const auto& c) { return c.allFinite(); });
  if (!finite) return false;
  const Box box = box_of(tag.corners_px);
  const bool in_view = box.x1 > 0 && box.y1 > 0 && box.x0 < image.width && box.y0 < image.height;
  const double most = 2.0 * std::max(image.width, image.height);
  return in_view && box.x1 - box.x0 < most && box.y1 - box.y0 < most &&
         search::area(quad_of(tag.corners_px)) > 1;
}

double apart_px(const Corners& a, const Corners& b) { return (center_px(a) - center_px(b)).norm(); }

/// The nearest print of this tag, if there is one.
const TagDetection* nearest(const std::vector<TagDetection>& all, const TagId& tag, const Corners& corners) {
  const TagDetection* best = nullptr;
  for (const TagDetection& one : all) {
    if (one.tag != tag) continue;
    if (best == nullptr || apart_px(one.corners_px, corners) < apart_px(best->corners_px, corners))
      best = &one;
  }
  return best;
}

/// Whether one of these is this tag, about where it is expected.
bool found_at(const std::vector<TagDetection>& found, const ExpectedTag& expected) {
  const TagDetection* near = nearest(found, expected.tag, expected.corners_px);
  if (near == nullptr) return false;
  const Box box = box_of(expected.corners_px);
  return apart_px(near->corners_px, expected.corners_px) < std::max(box.x1 - box.x0, box.y1 - box.y0);
}

}  // namespace

/// Reads a tag where it should be, without a search.
struct TagTracker::Reader {
  std::vector<search::ReadableFamily> families;
  search::TagReader reader;
  bool find_inverted = false;

  std::optional<TagDetection> read(const ImageView& image, const ExpectedTag& expected) {
    const auto kind = std::ranges::find(families, expected.tag.family, &search::ReadableFamily::id);
    if (kind == families.end()) return std::nullopt;
    auto tag = read_as(image, expected, *kind, false);
    if (!tag && find_inverted) tag = read_as(image, expected, *kind, true);
    return tag;
  }

  std::optional<TagDetection> read_as(const ImageView& image, const ExpectedTag& expected,
                                      const search::ReadableFamily& kind, bool inverted) {
    constexpr float kWidestReach = 6;  // px
    constexpr float kLastReach = 1.5F;
    constexpr int kFewCrossings = 8;
    search::Quad quad = quad_of(expected.corners_px);
    const float cell_px = std::sqrt(search::area(quad)) / static_cast<float>(kind.width);
    const int sign = kind.bright_border == inverted ? 1 : -1;
    for (float reach = std::clamp(0.9F * cell_px, 1.0F, kWidestReach); reach > kLastReach; reach *= 0.5F) {
      if (!search::sharpen_edges(image, {reach, sign, kFewCrossings}, quad)) return std::nullopt;
    }
    const float last = std::clamp(0.9F * cell_px, 1.0F, kLastReach);
    if (!search::sharpen_edges(image, {last, sign}, quad)) return std::nullopt;
    search::ReadProgress progress;
    auto tag = reader.read(image, quad, kind, inverted, progress);
    if (tag && tag->tag != expected.tag) tag.reset();
    return tag;
  }

  [[nodiscard]] int cells_across(FamilyId id) const {
    const auto kind = std::ranges::find(families, id, &search::ReadableFamily::id);
    return kind == families.end() ? 1 : kind->width;
  }
};

std::string_view to_string(MissReason reason) {
  switch (reason) {
    case MissReason::Outside:
      return "outside the picture";
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
  const Box box = box_of(expected.corners_px);
  const bool inside = box.x0 >= 0 && box.y0 >= 0 && box.x1 <= image.width && box.y1 <= image.height;
  if (!inside || !usable(expected, image)) return MissReason::Outside;
  const int x0 = static_cast<int>(box.x0);
  const int y0 = static_cast<int>(box.y0);
  const int x1 = std::min(static_cast<int>(box.x1) + 1, image.width);
  const int y1 = std::min(static_cast<int>(box.y1) + 1, image.height);
  int low = 255;
  int high = 0;
  int steepest = 0;
  for (int y = y0; y < y1; ++y) {
    for (int x = x0; x < x1; ++x) {
      const int level = image.row(y)[x];
      low = std::min(low, level);
      high = std::max(high, level);
      if (x > x0) steepest = std::max(steepest, std::abs(level - image.row(y)[x - 1]));
      if (y > y0) steepest = std::max(steepest, std::abs(level - image.row(y - 1)[x]));
    }
  }
  if (high - low < min_white_black_diff) return MissReason::TooFaint;
  const double cell_px =
      std::sqrt(static_cast<double>(search::area(quad_of(expected.corners_px)))) / cells_across;
  const double edge_px = static_cast<double>(high - low) / std::max(steepest, 1);
  return edge_px > cell_px ? MissReason::Blurred : MissReason::Occluded;
}

TagTracker::TagTracker(const Detector& detector, const TrackingOptions& options,
                       std::unique_ptr<Reader> reader)
    : detector_(&detector), options_(options), reader_(std::move(reader)) {}
TagTracker::TagTracker(TagTracker&&) noexcept = default;
TagTracker::~TagTracker() = default;

Result<TagTracker> TagTracker::make(const Detector& detector, const TrackingOptions& tracking) {
  constexpr int kRarest = 1000;
  if (tracking.whole_every < 1 || tracking.whole_every > kRarest) {
    return fail(ErrorCode::InvalidArgument, fmt::format("whole_every is {}", tracking.whole_every),
                {.key = "whole_every"}, fmt::format("It is from 1 to {}.", kRarest));
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
      const Box box = box_of(tag.corners_px);
      return other.tag == tag.tag &&
             apart_px(other.corners_px, tag.corners_px) < std::max(box.x1 - box.x0, box.y1 - box.y0);
    };
    if (std::ranges::none_of(given, same)) all.push_back(tag);
  }
  return all;
}

/// Around the tag, at a scale at which its cells have a few pixels.
Status TagTracker::search_around(const ImageView& image, const ExpectedTag& tag,
                                 std::vector<TagDetection>& found) {
  constexpr double kFinestCell = 8;  // px; larger ones are shrunk to half of it or more
  constexpr double kAround = 0.5;    // of the tag's box, and
  constexpr double kAroundPx = 8;
  const Box box = box_of(tag.corners_px);
  const double x_room = kAround * (box.x1 - box.x0) + kAroundPx;
  const double y_room = kAround * (box.y1 - box.y0) + kAroundPx;
  const int x0 = std::max(static_cast<int>(box.x0 - x_room), 0);
  const int y0 = std::max(static_cast<int>(box.y0 - y_room), 0);
  const int x1 = static_cast<int>(std::min<double>(box.x1 + x_room, image.width));
  const int y1 = static_cast<int>(std::min<double>(box.y1 + y_room, image.height));
  if (x0 >= x1 || y0 >= y1) return {};
  const double cell_px = std::sqrt(static_cast<double>(search::area(quad_of(tag.corners_px)))) /
                         reader_->cells_across(tag.tag.family);
  const int factor = cell_px >= kFinestCell ? static_cast<int>(cell_px / (0.5 * kFinestCell)) : 1;
  const PixelRect region{x0, y0, x1 - x0, y1 - y0};
  if (factor == 1) {
    auto here = detector_->detect(image, std::span(&region, 1));
    if (!here) return tl::unexpected<Error>(here.error());
    found.insert(found.end(), here->begin(), here->end());
    return {};
  }
  const Image small = shrunk(crop(image, x0, y0, region.width, region.height), factor);
  auto here = detector_->detect(small);
  if (!here) return tl::unexpected<Error>(here.error());
  for (const TagDetection& coarse : *here) {
    ExpectedTag again{coarse.tag, coarse.corners_px};
    for (Eigen::Vector2d& corner : again.corners_px) corner = corner * factor + Eigen::Vector2d(x0, y0);
    if (const auto fine = reader_->read(image, again)) found.push_back(*fine);
  }
  return {};
}

void TagTracker::remember(const std::vector<TagDetection>& found) {
  moved_.clear();
  for (const TagDetection& tag : found) {
    ExpectedTag next{tag.tag, tag.corners_px};
    const TagDetection* before = nearest(last_, tag.tag, tag.corners_px);
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
  if (tracked.detections.empty() && !all.empty() && !tracked.whole) {
    if (const Status status = search_whole(); !status) return fail_with(status.error());
  }
  remove_duplicates(tracked.detections);
  for (const ExpectedTag& tag : all) {
    if (found_at(tracked.detections, tag)) continue;
    tracked.missed.push_back({tag, why_missed(image, tag, reader_->cells_across(tag.tag.family),
                                              options_.detector.min_white_black_diff)});
  }
  if (since_whole_ >= options_.whole_every) since_whole_ = 0;
  remember(tracked.detections);
  return tracked;
}

}  // namespace waymark
