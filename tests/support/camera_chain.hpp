#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/random.hpp"
#include "waymark/evaluation/detections.hpp"
#include "waymark/image/image.hpp"

/// Images of single tags through the processing chain of a real camera: illumination, lens, exposure, colour
/// mosaic, tone curve, sharpening, scaler, compression. With exact ground truth, from a seed. Shares no code
/// with the corner refinement or the simulated camera: the tag is sampled by areas on a grid three times as
/// fine as the pixels, and every step of the chain processes the entire image.
namespace waymark::testing {

/// Print, illumination and camera. Grey levels are those of a camera with gamma 1.
struct CameraChain {
  double min_size_px = 16;  ///< of the border square of a frontal tag
  double max_size_px = 100;
  double max_tilt_deg = 60;
  bool level = false;  ///< no roll: edges along the rows of pixels
  double black = 40;
  double white = 200;       ///< may exceed 255: overexposed
  double black_slope = 0;   ///< [grey level] additive light, change from the middle of the tag to its rim
  double light_slope = 0;   ///< relative change of the illumination from the middle of the tag to its rim
  double margin_cells = 1;  ///< of white paper
  /// standard deviation of the lens blur; the integration over the pixel is additional
  double blur_px = 0.6;
  double disc_px = 0;           ///< radius of the defocus disc
  double motion_px = 0;         ///< in any direction
  double bloom = 0;             ///< fraction of the light that spreads over some pixels before saturation
  double noise = 2;             ///< [grey level] of the sensor
  bool mosaic = false;          ///< Bayer pattern, colours interpolated, grey of the three
  double gamma = 1;             ///< of the encoding
  double sharpening = 0;        ///< fraction of the difference from a blurred image that is added
  double denoising_px = 0;      ///< standard deviation of a denoising blur
  double scale = 1;             ///< sensor pixels per image pixel
  int jpeg_quality = 0;         ///< 0: not compressed
  double paper_over_cells = 0;  ///< width of white paper over one border
  bool corner_covered = false;  ///< a grey object over one corner
  double gloss = 0;             ///< [grey level] of a specular highlight
};

struct ChainedTag {
  Image image;
  TrueTag truth;
};

/// The same seed gives the same image.
[[nodiscard]] ChainedTag photographed_tag(const CameraChain& chain, std::uint64_t seed);

struct NamedChain {
  std::string name;
  CameraChain chain;
};

/// One effect at a time.
[[nodiscard]] std::vector<NamedChain> single_effects();
/// A random combination of all effects, within the range of the single effects.
[[nodiscard]] CameraChain random_chain(Random& random);

}  // namespace waymark::testing
