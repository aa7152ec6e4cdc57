#include <functional>

#include "tests/support/camera_chain.hpp"

namespace waymark::testing {
namespace {

CameraChain with(const std::function<void(CameraChain&)>& change) {
  CameraChain chain;
  change(chain);
  return chain;
}

}  // namespace

std::vector<NamedChain> single_effects() {
  std::vector<NamedChain> chains;
  const auto add = [&](const char* name, const std::function<void(CameraChain&)>& change) {
    chains.push_back({name, with(change)});
  };
  add("even light", [](CameraChain&) {});
  add("level tags", [](CameraChain& c) { c.level = true; });
  add("12 to 16 px", [](CameraChain& c) { c.min_size_px = 12, c.max_size_px = 16, c.max_tilt_deg = 40; });
  add("gamma 1.4", [](CameraChain& c) { c.gamma = 1.4; });
  add("gamma 2.2", [](CameraChain& c) { c.gamma = 2.2; });
  add("black +-5", [](CameraChain& c) { c.black_slope = 5; });
  add("black +-10", [](CameraChain& c) { c.black_slope = 10; });
  add("light +-3 %", [](CameraChain& c) { c.light_slope = 0.03; });
  add("light +-6 %", [](CameraChain& c) { c.light_slope = 0.06; });
  add("white 300", [](CameraChain& c) { c.white = 300; });
  add("white 400", [](CameraChain& c) { c.white = 400; });
  add("white 400 %", [](CameraChain& c) { c.white = 1020; });
  add("bloom", [](CameraChain& c) { c.bloom = 0.15, c.white = 300; });
  add("mosaic", [](CameraChain& c) { c.mosaic = true; });
  add("scaler 1.5", [](CameraChain& c) { c.scale = 1.5; });
  add("scaler 0.75", [](CameraChain& c) { c.scale = 0.75; });
  add("sharpened", [](CameraChain& c) { c.sharpening = 1; });
  add("denoised", [](CameraChain& c) { c.denoising_px = 0.7; });
  add("blur 0.35", [](CameraChain& c) { c.blur_px = 0.35; });
  add("blur 1.0", [](CameraChain& c) { c.blur_px = 1.0; });
  add("blur 1.5", [](CameraChain& c) { c.blur_px = 1.5, c.min_size_px = 24; });
  add("out of focus", [](CameraChain& c) { c.disc_px = 1.5, c.min_size_px = 20; });
  add("noise 5", [](CameraChain& c) { c.noise = 5; });
  add("noise 10", [](CameraChain& c) { c.noise = 10; });
  add("contrast 50", [](CameraChain& c) { c.black = 90, c.white = 140; });
  add("JPEG 90", [](CameraChain& c) { c.jpeg_quality = 90; });
  add("JPEG 60", [](CameraChain& c) { c.jpeg_quality = 60; });
  add("motion 2", [](CameraChain& c) { c.motion_px = 2; });
  add("motion 4", [](CameraChain& c) { c.motion_px = 4, c.min_size_px = 24; });
  add("motion 6", [](CameraChain& c) { c.motion_px = 6, c.min_size_px = 32; });
  add("margin 0.25", [](CameraChain& c) { c.margin_cells = 0.25; });
  add("margin 0.5", [](CameraChain& c) { c.margin_cells = 0.5; });
  add("paper over edge", [](CameraChain& c) { c.paper_over_cells = 0.15, c.min_size_px = 24; });
  add("corner covered", [](CameraChain& c) { c.corner_covered = true, c.min_size_px = 24; });
  add("gloss", [](CameraChain& c) { c.gloss = 102, c.min_size_px = 24; });
  return chains;
}

CameraChain random_chain(Random& random) {
  CameraChain chain;
  const auto sometimes = [&](double share) { return random.uniform() < share; };
  chain.min_size_px = 12;
  chain.max_tilt_deg = 50;
  chain.black = random.uniform(20, 70);
  chain.white = chain.black + random.uniform(90, 185);
  if (sometimes(0.2)) chain.white = random.uniform(260, 1020);
  if (sometimes(0.5)) chain.gamma = random.uniform(1, 2.2);
  if (sometimes(0.5)) chain.black_slope = random.uniform(0, 10);
  if (sometimes(0.5)) chain.light_slope = random.uniform(0, 0.06);
  chain.blur_px = random.uniform(0.4, 1.0);
  chain.noise = random.uniform(1, 6);
  if (sometimes(0.3)) chain.motion_px = random.uniform(0, 3);
  chain.mosaic = sometimes(0.3);
  if (sometimes(0.3)) chain.scale = random.uniform(0.75, 1.5);
  if (sometimes(0.3)) chain.sharpening = random.uniform(0, 1);
  if (sometimes(0.3)) chain.jpeg_quality = 60 + static_cast<int>(random.index(40));
  return chain;
}

}  // namespace waymark::testing
