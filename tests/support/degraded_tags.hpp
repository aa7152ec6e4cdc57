#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/evaluation/detections.hpp"
#include "waymark/image/image.hpp"

/// Pictures of tags as bad cameras take them, with exact truth, made from a seed. They share no code with the
/// corner refinement or with the simulated camera: a picture is sampled point by point, then blurred, smeared
/// and made noisy as a whole.
namespace waymark::testing {

/// One picture with its tags.
struct TagPicture {
  std::string name;  ///< of what is wrong with it: "motion 8"
  Image image;
  std::vector<TrueTag> truth;
};

/// The seed of the sets whose figures docs/results/detection.md lists; detectors are tuned on this one.
inline constexpr std::uint64_t kSetSeed = 20261123;
/// Reported beside it and never tuned on.
inline constexpr std::uint64_t kSecondSetSeed = 7;

/// A set of pictures, told apart by name:
/// - "mixed": everything moderately bad at once; 12 to 200 px, tilts to 75 degrees.
/// - "single": one degradation at a time (blur, noise, motion, low contrast, occlusion, glare); 20 to 100 px.
/// - "grid": boards whose corners are joined by black squares; "shadow": the edge of a shadow across each
///   tag; "bar": a dark or bright bar over one border; "margin": paper cut a quarter of a cell outside the
///   border; "inverted": white and black swapped.
struct TagSet {
  std::string_view name;
  std::size_t pictures = 0;
};
[[nodiscard]] const std::vector<TagSet>& tag_sets();

/// Picture number `index` of a set, 1280 x 720 px. The same seed gives the same picture.
[[nodiscard]] TagPicture tag_picture(std::string_view set, std::size_t index, std::uint64_t seed = kSetSeed);

/// Clutter without tags.
[[nodiscard]] Image tag_free_picture(std::size_t index, std::uint64_t seed = kSetSeed);

}  // namespace waymark::testing
