#include "waymark/cameras/v4l2/picture_faults.hpp"

#include <algorithm>
#include <utility>

namespace waymark::internal {
namespace {

constexpr int kStep = 61;  // no divisor of a usual width: the samples do not stand in columns
constexpr Duration kFrozenFor = std::chrono::seconds(1);
constexpr int kFrozenPictures = 10;
constexpr int kBlack = 24;         // black of video range is 16
constexpr int kBlackContrast = 8;  // noise in the dark

void sample(const ImageView& image, std::vector<std::uint8_t>& to) {
  to.clear();
  const std::int64_t pixels = std::int64_t{image.width} * image.height;
  for (std::int64_t i = 0; i < pixels; i += kStep)
    to.push_back(image.at(static_cast<int>(i % image.width), static_cast<int>(i / image.width)));
}

}  // namespace

PictureFaults::Fault PictureFaults::fault_of(const ImageView& image, Duration stamp, bool counted) {
  std::swap(before_, sampled_);
  sample(image, sampled_);
  if (sampled_ != before_) {
    same_ = same_uncounted_ = 0;
    same_since_ = stamp;
  } else {
    ++same_;
    same_uncounted_ += counted ? 0 : 1;
  }
  const auto [least, most] = std::ranges::minmax_element(sampled_);
  if (sampled_.empty()) return Fault::None;
  if (*most <= kBlack && *most - *least <= kBlackContrast) return Fault::Black;
  if (same_ < kFrozenPictures || stamp - same_since_ < kFrozenFor) return Fault::None;
  return same_uncounted_ > same_ / 2 ? Fault::Frozen : Fault::Still;
}

std::optional<std::string> PictureFaults::add(const ImageView& image, Duration stamp, bool counted) {
  const Fault fault = fault_of(image, stamp, counted);
  if (fault == fault_) return std::nullopt;
  const Fault before = std::exchange(fault_, fault);
  if (fault == Fault::Black)
    return "the pictures are black: is the lens covered, or exposure_ms far too short?";
  if (fault == Fault::Frozen)
    return "the picture has been the same for a second: the camera hangs; unplug it and plug it in again";
  if (fault == Fault::Still) {
    if (std::exchange(still_said_, true)) return std::nullopt;
    return "each picture has been exactly like the one before for a second, though the camera counts on: a "
           "still source without noise, or a sensor that hangs";
  }
  return before == Fault::Still ? std::nullopt : std::optional<std::string>("the pictures change again");
}

}  // namespace waymark::internal
