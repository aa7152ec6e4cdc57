#include "waymark/mapping/camera/calibration_advice.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark::internal {
namespace {

constexpr std::array<const char*, 9> kRegionNames = {
    "top left", "top", "top right", "left", "middle", "right", "bottom left", "bottom", "bottom right"};

void advise_regions(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr std::size_t kFewCorners = 20;
  constexpr double kMuchWorse = 2;
  std::vector<std::string> empty;
  for (std::size_t i = 0; i < found.regions.size(); ++i) {
    const ImageRegion& region = found.regions[i];
    if (region.corners < kFewCorners) empty.emplace_back(kRegionNames[i]);
    if (region.corners >= kFewCorners && region.noise_scale > kMuchWorse * found.noise_scale)
      advice.push_back(
          fmt::format("The {} of the image fits {:.1f} times worse than the whole: the lens bends "
                      "light there as this model cannot.",
                      kRegionNames[i], region.noise_scale / found.noise_scale));
  }
  if (!empty.empty())
    advice.push_back(fmt::format(
        "Hardly a corner in these parts of the image: {}. Hold the board there too, or the edges are "
        "guessed.",
        fmt::join(empty, ", ")));
}

void advise_views(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr double kTilted = 20;
  constexpr std::ptrdiff_t kEnoughTilted = 4;
  constexpr std::ptrdiff_t kEnoughViews = 10;
  const auto used = std::ranges::count_if(found.views, [](const auto& view) { return view.marks > 0; });
  const auto tilted = std::ranges::count_if(
      found.views, [](const auto& view) { return view.marks > 0 && view.tilt_deg > kTilted; });
  if (used < kEnoughViews)
    advice.push_back(fmt::format("{} pictures are few: fifteen from all sides are good.", used));
  if (tilted < kEnoughTilted)
    advice.push_back(
        fmt::format("{} pictures show the board tilted by more than {} degrees: tilt it to the left, "
                    "right, up and down, else focal length and distance look alike.",
                    tilted, kTilted));
}

void advise_numbers(const CameraCalibration& found, std::vector<std::string>& advice) {
  constexpr double kUncertainShare = 0.005;
  constexpr double kOverfitted = 1.3;
  const double share = std::sqrt(std::max(0.0, found.covariance(0, 0))) / found.parameters[0];
  if (share > kUncertainShare)
    advice.push_back(
        fmt::format("The focal length is known to {:.1f} % only (one sigma): more pictures, nearer "
                    "and tilted.",
                    100 * share));
  if (found.held_out_rms_px > kOverfitted * found.rms_px)
    advice.push_back(
        fmt::format("Pictures left out fit {:.2f} times worse than those used: take more, or a lens "
                    "with fewer numbers.",
                    found.held_out_rms_px / found.rms_px));
}

}  // namespace

std::vector<std::string> calibration_advice(const CameraCalibration& found) {
  std::vector<std::string> advice;
  advise_views(found, advice);
  advise_regions(found, advice);
  advise_numbers(found, advice);
  return advice;
}

}  // namespace waymark::internal
