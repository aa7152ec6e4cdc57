#include "waymark/tags/no_tags.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "waymark/tags/make_detector.hpp"

namespace waymark {
namespace {

/// Whether these tags are real. A single tag of a family with few bits may be clutter.
bool is_evidence(const std::vector<TagDetection>& tags) {
  constexpr double kMinMargin = 10;
  constexpr std::size_t kManyBits = 36;
  std::size_t weak = 0;
  for (const TagDetection& tag : tags) {
    if (tag.hamming > 0 || tag.decision_margin < kMinMargin) continue;
    if (family(tag.tag.family).bits.size() >= kManyBits) return true;
    ++weak;
  }
  return weak >= 2;
}

/// Whether a detector with these options finds tags in one of the images.
bool finds_tags(const std::vector<Image>& images, const DetectorOptions& options) {
  const auto detector = make_detector(options);
  if (!detector) return false;
  return std::ranges::any_of(images, [&](const Image& image) {
    const auto tags = (*detector)->detect(image);
    return tags && is_evidence(*tags);
  });
}

Image mirrored(const Image& image) {
  Image out(image.width(), image.height());
  for (int y = 0; y < image.height(); ++y)
    std::reverse_copy(image.row(y), image.row(y) + image.width(), out.row(y));
  return out;
}

/// The image at twice its size, interpolated.
Image enlarged(const Image& image) {
  Image out(2 * image.width(), 2 * image.height());
  for (int y = 0; y < out.height(); ++y)
    for (int x = 0; x < out.width(); ++x)
      out.row(y)[x] =
          static_cast<std::uint8_t>(std::lround(sample_bilinear(image, 0.5 * x + 0.25, 0.5 * y + 0.25)));
  return out;
}

template <class Change>
std::vector<Image> all_changed(const std::vector<Image>& images, Change change) {
  std::vector<Image> all;
  all.reserve(images.size());
  for (const Image& image : images) all.push_back(change(image));
  return all;
}

/// The grey levels that an image uses, and its steepest edge.
struct GreyRange {
  int low = 0, high = 0;  ///< 1 % and 99 % of the pixels are at or below these levels
  int steepest = 0;       ///< 99.9 % of the differences between pixels two columns apart are at or below this
};

/// The value at or below which this share of the counts lies.
int quantile(const std::array<std::size_t, 256>& counts, double share) {
  std::size_t all = 0;
  for (const std::size_t count : counts) all += count;
  std::size_t below = 0;
  for (std::size_t value = 0; value < counts.size(); ++value) {
    below += counts[value];
    if (static_cast<double>(below) >= share * static_cast<double>(all)) return static_cast<int>(value);
  }
  return 255;
}

GreyRange grey_range_of(const Image& image) {
  std::array<std::size_t, 256> levels{};
  std::array<std::size_t, 256> steps{};
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      ++levels[image.row(y)[x]];
      if (x >= 2) ++steps[static_cast<std::size_t>(std::abs(image.row(y)[x] - image.row(y)[x - 2]))];
    }
  }
  return {quantile(levels, 0.01), quantile(levels, 0.99), quantile(steps, 0.999)};
}

/// Whether all images are dark, bright, faint or blurred.
std::optional<NoTagReason> reason_in_levels(const std::vector<Image>& images,
                                            const DetectorOptions& options) {
  constexpr int kDark = 40;
  constexpr int kBright = 230;
  constexpr double kSharp = 0.12;  // of the range: an edge that is blurred over ten pixels
  std::vector<GreyRange> ranges;
  ranges.reserve(images.size());
  for (const Image& image : images) ranges.push_back(grey_range_of(image));
  if (std::ranges::all_of(ranges, [](const GreyRange& range) { return range.high < kDark; }))
    return NoTagReason{NoTagCause::Dark,
                       "no tag found: the images are nearly black. Uncover the lens, add light or increase "
                       "the exposure time."};
  if (std::ranges::all_of(ranges, [](const GreyRange& range) { return range.low > kBright; }))
    return NoTagReason{NoTagCause::Bright,
                       "no tag found: the images are nearly white. Reduce the light or the exposure time."};
  if (std::ranges::all_of(ranges, [&](const GreyRange& range) {
        return range.high - range.low < 2 * options.min_white_black_diff;
      }))
    return NoTagReason{
        NoTagCause::Faint,
        fmt::format("no tag found: the images use few grey levels. Improve the contrast, or lower "
                    "`min_white_black_diff` ({}).",
                    options.min_white_black_diff)};
  if (std::ranges::all_of(
          ranges, [](const GreyRange& range) { return range.steepest < kSharp * (range.high - range.low); }))
    return NoTagReason{NoTagCause::Blurred,
                       "no tag found: the images are blurred. Focus the lens, reduce the exposure time or "
                       "hold the camera still."};
  return std::nullopt;
}

/// Searches for each of the other families on its own, so that a failure for one family does not hide others.
/// `found` states what the run found.
std::optional<NoTagReason> reason_in_families(const std::vector<Image>& images,
                                              const DetectorOptions& options, const std::string& found) {
  const auto searched = chosen_families(options);
  if (!searched) return std::nullopt;
  for (const FamilyId id : kAllFamilies) {
    if (std::ranges::find(*searched, id) != searched->end()) continue;
    DetectorOptions other = options;
    other.families = {std::string(to_string(id))};
    if (finds_tags(images, other))
      return NoTagReason{NoTagCause::OtherFamily,
                         fmt::format("{}, but the images contain tags of {}. Set `family={}`.", found,
                                     to_string(id), to_string(id))};
  }
  return std::nullopt;
}

}  // namespace

std::string_view to_string(NoTagCause cause) {
  switch (cause) {
    case NoTagCause::OtherFamily:
      return "other_family";
    case NoTagCause::Mirrored:
      return "mirrored";
    case NoTagCause::Inverted:
      return "inverted";
    case NoTagCause::Small:
      return "small";
    case NoTagCause::Dark:
      return "dark";
    case NoTagCause::Bright:
      return "bright";
    case NoTagCause::Faint:
      return "faint";
    case NoTagCause::Blurred:
      return "blurred";
  }
  return "";
}

void NoTagDiagnosis::add(const ImageView& image, std::size_t tags) {
  if (tags > 0) {
    ++with_;
    return;
  }
  ++without_;
  if (!std::has_single_bit(without_) || image.empty()) return;
  Image copy(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, copy.row(y));
  if (kept_.size() == kMaxKept) kept_.erase(kept_.begin() + 1);  // the first image is kept
  kept_.push_back(std::move(copy));
}

std::optional<NoTagReason> NoTagDiagnosis::reason(const DetectorOptions& options) const {
  if (kept_.empty() || without_ < (kImagesPerTag - 1) * with_) return std::nullopt;
  // The detector of this project is used in any case, because it also finds inverted tags.
  DetectorOptions own;
  own.families = options.families;
  own.max_hamming = 0;
  own.min_white_black_diff = options.min_white_black_diff;
  if (with_ > 0)
    return reason_in_families(kept_, own,
                              fmt::format("tags found in {} of {} images only", with_, with_ + without_));
  const auto in_levels = reason_in_levels(kept_, options);
  if (in_levels && in_levels->cause != NoTagCause::Blurred) return in_levels;
  if (finds_tags(all_changed(kept_, mirrored), own))
    return NoTagReason{NoTagCause::Mirrored,
                       "no tag found, but the mirrored images contain tags. Switch off mirroring in the "
                       "camera or its driver."};
  DetectorOptions inverted = own;
  inverted.find_inverted = true;
  if (!options.find_inverted && finds_tags(kept_, inverted))
    return NoTagReason{NoTagCause::Inverted,
                       "no tag found, but the images contain tags with black and white exchanged. Set "
                       "`find_inverted`."};
  if (auto other = reason_in_families(kept_, own, "no tag found")) return other;
  constexpr int kMaxEnlarged = 4096;  // maximum side of an image that is enlarged [px]
  std::vector<Image> small = kept_;
  std::erase_if(small,
                [](const Image& image) { return std::max(image.width(), image.height()) > kMaxEnlarged; });
  if (finds_tags(all_changed(small, enlarged), own))
    return NoTagReason{NoTagCause::Small,
                       "no tag found, but the enlarged images contain tags. Use a higher resolution, larger "
                       "tags or a shorter distance."};
  return in_levels;
}

}  // namespace waymark
