// Any bytes are either an image of the size in their header, or an Error; nothing crashes, leaks or prints.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "waymark/codecs/image_codec.hpp"

namespace {

std::uint32_t crc32(std::span<const std::uint8_t> bytes) {
  std::uint32_t crc = 0xffffffffU;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int k = 0; k < 8; ++k) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xedb88320U : 0U);
  }
  return ~crc;
}

/// Recomputes the checksum of every PNG chunk; otherwise nearly every mutation would fail at the first one.
void fix_png_checksums(std::span<std::uint8_t> bytes) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = (length << 8U) | bytes[at + i];
    if (length > bytes.size() - at - 12) return;
    const std::uint32_t crc = crc32(bytes.subspan(at + 4, 4 + length));
    for (std::size_t i = 0; i < 4; ++i)
      bytes[at + 8 + length + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
    at += 12 + length;
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  size = LLVMFuzzerMutate(data, size, max_size);
  const bool png = size > 8 && data[0] == 0x89 && data[1] == 'P';
  if (png && seed % 4 != 0) fix_png_checksums({data, size});
  return size;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::uint8_t> bytes(data, size);
  const auto info = waymark::probe(bytes, "fuzz");
  const auto image = waymark::decode_image(bytes, "fuzz", {.max_pixels = 1'000'000});
  if (image && !info) std::abort();
  if (image && (image->width() != info->width || image->height() != info->height || image->empty()))
    std::abort();
  if (!image && image.error().message.empty()) std::abort();
  return 0;
}
