#include "waymark/media/video_format.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>

namespace waymark {
namespace {

using namespace std::string_view_literals;

template <std::size_t N>
bool ends_as(std::string_view path, const std::array<std::string_view, N>& suffixes) {
  std::string suffix = std::filesystem::path(path).extension().string();
  for (char& c : suffix) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return std::ranges::find(suffixes, suffix) != suffixes.end();
}

/// Packets of a transport stream are 188 bytes long and begin with 0x47.
bool is_transport_stream(std::string_view head) {
  constexpr std::size_t kPacket = 188;
  return head.size() > 2 * kPacket && head[0] == 0x47 && head[kPacket] == 0x47 && head[2 * kPacket] == 0x47;
}

}  // namespace

bool begins_as_video(std::span<const std::uint8_t> bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  constexpr std::size_t kBoxName = 4;
  const std::string_view box = head.size() >= 8 ? head.substr(kBoxName, 4) : ""sv;
  constexpr std::array kBoxes = {"ftyp"sv, "moov"sv, "mdat"sv, "wide"sv, "skip"sv};
  constexpr std::array kImages = {"heic"sv, "heix"sv, "mif1"sv, "avif"sv};  // images in the same container
  if (box == "ftyp"sv && head.size() >= 12 && std::ranges::find(kImages, head.substr(8, 4)) != kImages.end())
    return false;
  if (std::ranges::find(kBoxes, box) != kBoxes.end()) return true;
  if (head.starts_with("\x1A\x45\xDF\xA3"sv)) return true;  // EBML
  if (head.starts_with("RIFF"sv) && head.size() >= 12 && head.substr(8, 3) == "AVI"sv) return true;
  return head.starts_with("\0\0\1\xBA"sv) || is_transport_stream(head);
}

bool is_video_name(std::string_view path) {
  constexpr std::array kWritten = {".mp4"sv, ".mov"sv, ".m4v"sv, ".mkv"sv, ".webm"sv, ".avi"sv};
  return ends_as(path, kWritten);
}

bool has_video_ending(std::string_view path) {
  constexpr std::array kRaw = {".h264"sv, ".264"sv, ".h265"sv, ".hevc"sv, ".mjpeg"sv, ".ivf"sv};
  return is_video_name(path) || ends_as(path, kRaw);
}

}  // namespace waymark
