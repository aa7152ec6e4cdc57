#include "waymark/tags/detector/waymark_detector.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/tags/detector/tag_search.hpp"

namespace waymark {
namespace {

constexpr int kMaxSide = 32767;

class WaymarkDetector final : public Detector {
 public:
  WaymarkDetector(const search::SearchOptions& options, std::vector<search::ReadableFamily> families)
      : options_(options), families_(std::move(families)) {}

  using Detector::detect;
  [[nodiscard]] Result<std::vector<TagDetection>> detect(const ImageView& image) const override;

 private:
  [[nodiscard]] int region_alignment_px() const override { return search::kTilePx; }
  [[nodiscard]] std::unique_ptr<search::TagSearch> take_workspace() const;

  search::SearchOptions options_;
  std::vector<search::ReadableFamily> families_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<search::TagSearch>> idle_;  ///< guarded by mutex_
};

std::unique_ptr<search::TagSearch> WaymarkDetector::take_workspace() const {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      std::unique_ptr<search::TagSearch> workspace = std::move(idle_.back());
      idle_.pop_back();
      return workspace;
    }
  }
  return std::make_unique<search::TagSearch>(options_);
}

Status check_size(const ImageView& image) {
  if (image.stride < image.width) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("image rows of {} px with a stride of {} bytes", image.width, image.stride), {},
                "Set `stride` to at least the width.");
  }
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  if (image.width <= kMaxSide && image.height <= kMaxSide && pixels <= kMaxImagePixels) return {};
  return fail(
      ErrorCode::LimitExceeded, fmt::format("image of {} x {} px is too large", image.width, image.height),
      {},
      fmt::format("Crop or scale it to at most {} pixels and {} px per side.", kMaxImagePixels, kMaxSide));
}

Result<std::vector<TagDetection>> WaymarkDetector::detect(const ImageView& image) const {
  std::vector<TagDetection> detections;
  if (image.empty()) return detections;
  if (const Status size = check_size(image); !size) return tl::unexpected<Error>(size.error());
  std::unique_ptr<search::TagSearch> workspace = take_workspace();
  detections = workspace->run(image, families_);
  {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(workspace));
  }
  remove_duplicates(detections);
  return detections;
}

/// Rejects options that apply only to AprilTag 3, because this detector would ignore them.
Status check_own_options(const DetectorOptions& options) {
  constexpr std::array<std::string_view, 6> kOwn = {
      "detector", "families", "max_hamming", "min_decision_margin", "find_inverted", "min_white_black_diff"};
  Status status;
  std::vector<std::string> usual;
  const auto text = [](const auto& value) {
    if constexpr (std::is_arithmetic_v<std::remove_cvref_t<decltype(value)>>) return fmt::format("{}", value);
    return std::string();
  };
  const DetectorOptions defaults;
  DetectorOptions::fields(defaults, [&](const auto& value, const Field&) { usual.push_back(text(value)); });
  std::size_t next = 0;
  DetectorOptions::fields(options, [&](const auto& value, const Field& field) {
    const std::string& expected = usual[next++];
    if (!status || std::ranges::find(kOwn, field.name) != kOwn.end() || text(value) == expected) return;
    status = fail(ErrorCode::InvalidArgument, fmt::format("{} is an option of AprilTag 3", field.name),
                  {.key = std::string(field.name)}, "Omit it, or use the detector apriltag3.");
  });
  return status;
}

}  // namespace

Result<std::unique_ptr<Detector>> make_waymark_detector(const DetectorOptions& options) {
  if (const Status ranges = check_ranges(options); !ranges) return tl::unexpected<Error>(ranges.error());
  if (const Status own = check_own_options(options); !own) return tl::unexpected<Error>(own.error());
  const Result<std::vector<FamilyId>> ids = chosen_families(options);
  if (!ids) return tl::unexpected<Error>(ids.error());
  std::vector<search::ReadableFamily> families;
  families.reserve(ids->size());
  for (const FamilyId id : *ids) {
    families.emplace_back(family(id), options.max_hamming);
    for (const TagId& tag : options.known_tags)
      if (tag.family == id && tag.number >= 0 &&
          static_cast<std::size_t>(tag.number) < family(id).codes.size())
        families.back().known.push_back(tag.number);
  }
  const search::SearchOptions search{.min_white_black_diff = options.min_white_black_diff,
                                     .min_decision_margin = options.min_decision_margin,
                                     .find_inverted = options.find_inverted};
  return std::make_unique<WaymarkDetector>(search, std::move(families));
}

}  // namespace waymark
