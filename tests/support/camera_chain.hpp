#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/image/image.hpp"

/// Single tags as the chain of a real camera shows them: light, lens, exposure, colour mosaic, tone curve,
/// sharpening, scaler, compression. With exact truth, from a seed. Shares no code with the corner refinement
/// or the simulated camera: the tag is sampled by areas on a grid three times as fine as the pixels, and
/// every step of the chain works on the picture as a whole.
namespace waymark::testing {

/// What is printed, how it is lit, and what the camera makes of it. Grey levels are those of a camera with
/// gamma 1.
struct CameraChain {
  double min_size_px = 16;  ///< of the border square, seen face to face
  double max_size_px = 100;
  double max_tilt_deg = 60;
  bool level = false;  ///< not turned: edges along the rows of pixels
  double black = 40;
  double white = 200;      ///< may exceed 255: overexposed
  double black_slope = 0;  ///< [grey level] light on top of everything, from the middle of the tag to its rim
  double light_slope = 0;  ///< relative change of the light from the middle of the tag to its rim
  double margin_cells = 1;      ///< of white paper
  double blur_px = 0.6;         ///< standard deviation of the lens; the square of a pixel comes on top
  double disc_px = 0;           ///< radius of the disc of a lens out of focus
  double motion_px = 0;         ///< in any direction
  double bloom = 0;             ///< share of the light that is spread over some pixels before it saturates
  double noise = 2;             ///< [grey level] of the sensor
  bool mosaic = false;          ///< Bayer pattern, colours interpolated, grey of the three
  double gamma = 1;             ///< of the encoding
  double sharpening = 0;        ///< share of the difference from a blurred picture that is added
  double denoising_px = 0;      ///< standard deviation of a blur against noise
  double scale = 1;             ///< pixels of the sensor for one of the picture
  int jpeg_quality = 0;         ///< 0: not compressed
  double paper_over_cells = 0;  ///< white paper over so much of one border
  bool corner_covered = false;  ///< a grey thing over one corner
  double gloss = 0;             ///< [grey level] of a spot that reflects a lamp
};

struct ChainedTag {
  Image image;
  TrueTag truth;
};

/// The same seed gives the same picture.
[[nodiscard]] ChainedTag photographed_tag(const CameraChain& chain, std::uint64_t seed);

struct NamedChain {
  std::string name;
  CameraChain chain;
};

/// One effect at a time.
[[nodiscard]] std::vector<NamedChain> single_effects();
/// Something of everything, within what the single effects show.
[[nodiscard]] CameraChain random_chain(Random& random);

}  // namespace waymark::testing
