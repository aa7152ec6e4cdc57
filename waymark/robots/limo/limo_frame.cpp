#include "waymark/robots/limo/limo_frame.hpp"

#include <algorithm>
#include <numeric>

namespace waymark {
namespace {

constexpr std::array<std::uint8_t, 2> kHeader = {0x55, 0x0E};

LimoFrame frame_of(std::span<const std::uint8_t> bytes) {
  LimoFrame frame{.id = static_cast<std::uint16_t>((bytes[2] << 8U) | bytes[3]), .count = bytes[12]};
  std::copy_n(bytes.begin() + 4, frame.data.size(), frame.data.begin());
  return frame;
}

/// Whether a header may begin here, as far as the bytes go.
bool begins(std::span<const std::uint8_t> bytes) {
  const std::size_t known = std::min(bytes.size(), kHeader.size());
  return std::equal(kHeader.begin(), kHeader.begin() + static_cast<std::ptrdiff_t>(known), bytes.begin());
}

}  // namespace

std::uint8_t checksum(const LimoFrame& frame) {
  return static_cast<std::uint8_t>(std::accumulate(frame.data.begin(), frame.data.end(), 0U));
}

std::array<std::uint8_t, kLimoFrameBytes> encode(const LimoFrame& frame) {
  std::array<std::uint8_t, kLimoFrameBytes> bytes{kHeader[0], kHeader[1],
                                                  static_cast<std::uint8_t>(frame.id >> 8U),
                                                  static_cast<std::uint8_t>(frame.id & 0xFFU)};
  std::ranges::copy(frame.data, bytes.begin() + 4);
  bytes[12] = frame.count;
  bytes[13] = checksum(frame);
  return bytes;
}

std::optional<LimoFrame> LimoReader::next() {
  std::size_t at = 0;
  std::optional<LimoFrame> found;
  while (!found && at < bytes_.size()) {
    const auto rest = std::span<const std::uint8_t>(bytes_).subspan(at);
    if (begins(rest)) {
      if (rest.size() < kLimoFrameBytes) break;  // more may come
      const LimoFrame frame = frame_of(rest);
      if (checksum(frame) == rest[13]) {
        found = frame;
        break;
      }
    }
    ++at;
  }
  skipped_ += at;
  const std::size_t taken = at + (found ? kLimoFrameBytes : 0);
  bytes_.erase(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(taken));
  return found;
}

}  // namespace waymark
