#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/evaluation/detections.hpp"
#include "waymark/image/image.hpp"

/// Degraded images of tags with exact ground truth, generated from a seed. They share no code with the corner
/// refinement or with the simulated camera: an image is sampled point by point, then blur, motion and noise
/// are applied to the entire image.
namespace waymark::testing {

/// One image with its tags.
struct TagImage {
  std::string name;  ///< kind of the degradation: "motion 8"
  Image image;
  std::vector<TrueTag> truth;
};

/// The seed of the sets with figures in docs/results/detection.md; detectors are tuned on this one.
inline constexpr std::uint64_t kSetSeed = 20261123;
/// A second seed, reported but never used for tuning.
inline constexpr std::uint64_t kSecondSetSeed = 7;

/// A set of images, identified by name:
/// - "mixed": all degradations moderately at once; 12 to 200 px, tilts to 75 degrees.
/// - "single": one degradation at a time (blur, noise, motion, low contrast, occlusion, glare); 20 to 100 px.
/// - "grid": boards whose corners are joined by black squares;
/// - "shadow": the edge of a shadow across each tag; "bar": a dark or bright bar over one border;
/// - "overexposed": white at 600, 800 and 1200 grey levels by turns, clipped at 255;
/// - "margin": paper cut a quarter of a cell outside the border; "inverted": white and black swapped.
struct TagSet {
  std::string_view name;
  std::size_t images = 0;
};
[[nodiscard]] const std::vector<TagSet>& tag_sets();

/// Sets whose tags often cannot be refined: "tiny", "faint", "corner" (an object over a corner), "glare",
/// "bent", "cut" (by the border of the image), "covered" (a bar of any level along one side), "moving",
/// "bright" (white at 300 to 2000 grey levels).
[[nodiscard]] const std::vector<TagSet>& hard_tag_sets();

/// Image number `index` of a set, 1280 x 720 px. The same seed gives the same image.
[[nodiscard]] TagImage tag_image(std::string_view set, std::size_t index, std::uint64_t seed = kSetSeed);

/// Clutter without tags.
[[nodiscard]] Image tag_free_image(std::size_t index, std::uint64_t seed = kSetSeed);

/// Eight tags, 24 to 160 px with tilts of up to 60 degrees, over the middle of a photograph reduced to
/// 1280 x 720 px. The photograph must be at least that large.
[[nodiscard]] TagImage tags_on_photograph(const Image& photograph, std::size_t index,
                                          std::uint64_t seed = kSetSeed);

}  // namespace waymark::testing
