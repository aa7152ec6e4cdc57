#include "waymark/cameras/v4l2/images.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "waymark/codecs/image_codec.hpp"
#include "waymark/codecs/raw_pixels.hpp"

namespace waymark {
namespace {

constexpr std::array kNames = {
    std::pair{PixelFormat::Grey, "GREY"}, std::pair{PixelFormat::Nv12, "NV12"},
    std::pair{PixelFormat::Yuyv, "YUYV"}, std::pair{PixelFormat::Uyvy, "UYVY"},
    std::pair{PixelFormat::Mjpg, "MJPG"},
};

/// The name of a pixel format in RawPixels.
std::string_view encoding_of(PixelFormat format) {
  switch (format) {
    case PixelFormat::Nv12:
      return "nv12";
    case PixelFormat::Yuyv:
      return "yuyv";
    case PixelFormat::Uyvy:
      return "uyvy";
    default:
      return "mono8";
  }
}

Result<Image> from_jpeg(std::span<const std::uint8_t> bytes, const RawLayout& layout) {
  const DecodeOptions options{.max_pixels = std::int64_t{layout.width} * layout.height};
  Result<Image> image = decode_image(bytes, "image of the camera", options);
  if (!image) return image;
  if (image->width() == layout.width && image->height() == layout.height) return image;
  return fail(ErrorCode::Unreadable, fmt::format("the image has {} x {} px, expected {} x {}", image->width(),
                                                 image->height(), layout.width, layout.height));
}

}  // namespace

const char* to_string(PixelFormat format) {
  return std::ranges::find(kNames, format, [](const auto& one) { return one.first; })->second;
}

std::optional<PixelFormat> pixel_format_named(std::string_view name) {
  for (const auto& [format, word] : kNames)
    if (name == word) return format;
  return std::nullopt;
}

std::vector<std::string> pixel_format_names() {
  std::vector<std::string> names;
  for (const auto& [format, word] : kNames) names.emplace_back(word);
  return names;
}

std::size_t bytes_of(const RawLayout& layout) {
  const auto plane = static_cast<std::size_t>(layout.stride) * static_cast<std::size_t>(layout.height);
  switch (layout.format) {
    case PixelFormat::Mjpg:
      return 0;
    case PixelFormat::Nv12:
      return plane + plane / 2;
    default:
      return plane;
  }
}

Result<Image> to_grey(std::span<const std::uint8_t> bytes, const RawLayout& layout) {
  if (layout.format == PixelFormat::Mjpg) return from_jpeg(bytes, layout);
  // A driver may omit the padding of the last row, but not a plane: the image would be incomplete.
  const bool packed = layout.format == PixelFormat::Yuyv || layout.format == PixelFormat::Uyvy;
  const auto row_bytes = static_cast<std::size_t>(layout.width) * (packed ? 2 : 1);
  const std::size_t padding = static_cast<std::size_t>(layout.stride) - row_bytes;
  if (bytes.size() + padding < bytes_of(layout))
    return fail(ErrorCode::Unreadable,
                fmt::format("the image has only {} of {} bytes", bytes.size(), bytes_of(layout)));
  return grey_of({.encoding = encoding_of(layout.format),
                  .width = layout.width,
                  .height = layout.height,
                  .row_bytes = static_cast<std::size_t>(layout.stride),
                  .bytes = bytes});
}

}  // namespace waymark

namespace waymark::internal {
namespace {

constexpr Duration kMaxAhead = std::chrono::milliseconds(20);  // the driver's clock tick, with margin
constexpr Duration kMaxAge = std::chrono::seconds(2);

}  // namespace

const char* ImageStamps::fault_of(const std::optional<Duration>& driver, Duration arrived) const {
  if (!driver) return "are not of the steady clock";
  if (*driver > arrived + kMaxAhead) return "are in the future";
  if (*driver < arrived - kMaxAge) return "are more than two seconds old";
  if (last_driver_ && *driver <= *last_driver_) return "do not increase";
  return nullptr;
}

ImageStamps::Stamped ImageStamps::add(std::optional<Duration> driver, bool start_of_exposure,
                                      std::optional<Duration> exposure, Duration arrived) {
  const char* fault = fault_of(driver, arrived);
  if (driver) last_driver_ = driver;
  if (fault != nullptr && !std::exchange(reported_, true))
    report_ = fmt::format("the driver's time stamps {}: images are stamped at their arrival", fault);
  const Duration half = exposure.value_or(Duration(0)) / 2;
  const bool begins = fault == nullptr && start_of_exposure;
  const Duration middle = (fault == nullptr ? *driver : arrived) + (begins ? half : -half);
  last_ = std::max(middle, last_ + Duration(1));
  return {last_, fault == nullptr};
}

std::optional<std::string> ImageStamps::take_reports() { return std::exchange(report_, std::nullopt); }

namespace {

constexpr int kStep = 61;  // not a divisor of common widths, so that samples do not align in columns
constexpr Duration kMinFrozenTime = std::chrono::seconds(1);
constexpr int kFrozenImages = 10;
constexpr int kBlack = 24;         // black is 16 in video range
constexpr int kBlackContrast = 8;  // noise in the dark

void sample(const ImageView& image, std::vector<std::uint8_t>& to) {
  to.clear();
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  for (std::int64_t i = 0; i < pixels; i += kStep)
    to.push_back(image.at(static_cast<int>(i % image.width), static_cast<int>(i / image.width)));
}

}  // namespace

ImageFaults::Fault ImageFaults::fault_of(const ImageView& image, Duration stamp, bool counted) {
  std::swap(before_, sampled_);
  sample(image, sampled_);
  if (sampled_ != before_) {
    same_ = same_uncounted_ = 0;
    same_since_ = stamp;
  } else {
    ++same_;
    same_uncounted_ += counted ? 0 : 1;
  }
  const auto [darkest, brightest] = std::ranges::minmax_element(sampled_);
  if (sampled_.empty()) return Fault::None;
  if (*brightest <= kBlack && *brightest - *darkest <= kBlackContrast) return Fault::Black;
  if (same_ < kFrozenImages || stamp - same_since_ < kMinFrozenTime) return Fault::None;
  return same_uncounted_ > same_ / 2 ? Fault::Frozen : Fault::Still;
}

std::optional<std::string> ImageFaults::add(const ImageView& image, Duration stamp, bool counted) {
  const Fault fault = fault_of(image, stamp, counted);
  if (fault == fault_) return std::nullopt;
  const Fault before = std::exchange(fault_, fault);
  if (fault == Fault::Black)
    return "the images are black: check that the lens is uncovered and that exposure_ms is long enough";
  if (fault == Fault::Frozen)
    return "the camera is frozen: it has repeated the same image for a second; unplug it and plug it in "
           "again";
  if (fault == Fault::Still) {
    if (std::exchange(still_reported_, true)) return std::nullopt;
    return "the images have been identical for a second, although their numbers advance: a still source "
           "without "
           "noise, or a frozen sensor";
  }
  return before == Fault::Still ? std::nullopt : std::optional<std::string>("the images change again");
}

}  // namespace waymark::internal
