// Conversion of a camera image to the grey image of the detector, compared with a memcpy of the grey image's
// bytes: the cost of capturing per frame, because the driver's buffer must be returned. MJPG is a JPEG that
// has to be decoded.
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "waymark/base/random.hpp"
#include "waymark/cameras/v4l2/images.hpp"
#include "waymark/codecs/image_codec.hpp"

namespace waymark {
namespace {

struct Raw {
  RawLayout layout{};
  std::vector<std::uint8_t> bytes{};
};

/// An image with structure and noise.
Image some_image(int width, int height) {
  Image image(width, height);
  Random random(1);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      image.row(y)[x] =
          static_cast<std::uint8_t>(80U + ((x / 16 + y / 16) % 2 == 0 ? 0U : 40U) + random.index(8));
  return image;
}

Raw raw_of(PixelFormat format, int width, int height) {
  Raw raw{.layout = {.format = format, .width = width, .height = height, .stride = width}};
  const Image image = some_image(width, height);
  if (format == PixelFormat::Mjpg) {
    raw.layout.stride = 0;
    raw.bytes = encode_jpeg(image.view(), 90).value();
    return raw;
  }
  if (format == PixelFormat::Yuyv || format == PixelFormat::Uyvy) raw.layout.stride = 2 * width;
  raw.bytes.resize(bytes_of(raw.layout));
  Random random(2);
  for (auto& byte : raw.bytes) byte = static_cast<std::uint8_t>(random.index(256));
  return raw;
}

void ours(benchmark::State& state, const Raw& raw) {
  for (auto _ : state) {
    auto grey = to_grey(raw.bytes, raw.layout);
    benchmark::DoNotOptimize(grey);
  }
}

void copied(benchmark::State& state, const Raw& raw) {
  const auto size = static_cast<std::size_t>(raw.layout.width) * static_cast<std::size_t>(raw.layout.height);
  const std::vector<std::uint8_t> from(size, 7);
  for (auto _ : state) {
    Image to(raw.layout.width, raw.layout.height);
    std::memcpy(to.row(0), from.data(), size);
    benchmark::DoNotOptimize(to);
  }
}

const bool kRegistered = [] {
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(1280, 720)})
    for (const std::string& name : pixel_format_names()) {
      const Raw raw = raw_of(pixel_format_named(name).value(), width, height);
      const std::string what = fmt::format("{} {}x{}", name, width, height);
      benchmark::RegisterBenchmark(("capture/ours/" + what).c_str(),
                                   [raw](benchmark::State& state) { ours(state, raw); });
      benchmark::RegisterBenchmark(("capture/peer:memcpy/" + what).c_str(),
                                   [raw](benchmark::State& state) { copied(state, raw); });
    }
  return true;
}();

}  // namespace
}  // namespace waymark
