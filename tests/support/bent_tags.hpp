#pragma once

#include <cstdint>
#include <string_view>

#include "waymark/evaluation/detections.hpp"
#include "waymark/image/image.hpp"

/// Images of single tags whose borders are not straight, with exact ground truth. They share no code with the
/// corner refinement or with the simulated camera.
namespace waymark::testing {

/// Why a border is not straight, and the unit of the amount.
enum class Bend : std::uint8_t {
  Flat,      ///< it is straight
  Cylinder,  ///< the tag is wrapped around a bottle; angle from one side to the other [deg]
  Wobble,    ///< the camera shakes while a rolling shutter reads the image; amplitude [side of the tag]
  Crumpled,  ///< the paper is crumpled smoothly; root mean square displacement [side of the tag]
};
[[nodiscard]] std::string_view to_string(Bend bend);

struct BentTagOptions {
  Bend bend = Bend::Flat;
  double amount = 0;
  double size_px = 60;  ///< side of a flat tag seen frontally
  double blur_px = 0.7;
  double noise = 2;  ///< [grey level]
  double max_tilt_deg = 35;
};

/// One tag (of tag36h11) and its image.
struct BentTag {
  Image image;
  TrueTag truth;  ///< its corners are the images of the printed corners, wherever the sheet bends them
};

/// The same options and seed give the same image.
[[nodiscard]] BentTag bent_tag(const BentTagOptions& options, std::uint64_t seed);

}  // namespace waymark::testing
