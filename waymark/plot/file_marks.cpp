#include "waymark/plot/file_marks.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

namespace waymark::plot {
namespace {

std::optional<int> number_after(std::string_view text, std::string_view word) {
  const std::size_t at = text.find(word);
  if (at == std::string_view::npos) return std::nullopt;
  const std::size_t first = text.find_first_of("0123456789", at + word.size());
  if (first == std::string_view::npos) return std::nullopt;
  int value = 0;
  const auto [end, failure] = std::from_chars(text.data() + first, text.data() + text.size(), value);
  return failure == std::errc() ? std::optional(value) : std::nullopt;
}

/// What stands between "<<" and the last ">>" of an object.
std::optional<std::string> dictionary_of(std::string_view pdf, int object) {
  const std::size_t at = pdf.rfind(fmt::format("\n{} 0 obj", object));
  if (at == std::string_view::npos) return std::nullopt;
  const std::string_view body = pdf.substr(at, pdf.find("endobj", at) - at);
  const std::size_t open = body.find("<<");
  const std::size_t close = body.rfind(">>");
  if (open == std::string_view::npos || close == std::string_view::npos) return std::nullopt;
  return std::string(body.substr(open + 2, close - open - 2));
}

/// CRC-32 as PNG wants it (PNG specification, annex D).
std::uint32_t crc32(const std::uint8_t* data, std::size_t count) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (std::size_t i = 0; i < count; ++i) {
    crc ^= data[i];
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  return ~crc;
}

void put_big_endian(std::uint8_t* out, std::uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) out[i] = static_cast<std::uint8_t>(value >> (24 - 8 * i));
}

}  // namespace

void ask_to_print_unscaled(std::vector<std::uint8_t>& pdf) {
  const std::string_view text(reinterpret_cast<const char*>(pdf.data()), pdf.size());
  const std::size_t trailer_at = text.rfind("trailer");
  if (trailer_at == std::string_view::npos) return;
  const std::string_view trailer = text.substr(trailer_at);
  const auto root = number_after(trailer, "/Root");
  const auto info = number_after(trailer, "/Info");
  const auto size = number_after(trailer, "/Size");
  const auto previous = number_after(trailer, "startxref");
  if (!root || !info || !size || !previous) return;
  const auto catalog = dictionary_of(text, *root);
  if (!catalog) return;

  const std::string object = fmt::format(
      "{} 0 obj\n<<{}   /ViewerPreferences << /PrintScaling /None >>\n>>\nendobj\n", *root, *catalog);
  const std::string update = fmt::format(
      "{}xref\n{} 1\n{:010} 00000 n \ntrailer\n<< /Size {} /Root {} 0 R /Info {} 0 R /Prev {} "
      ">>\nstartxref\n{}\n%%EOF\n",
      object, *root, pdf.size(), *size, *root, *info, *previous, pdf.size() + object.size());
  pdf.insert(pdf.end(), update.begin(), update.end());
}

void record_resolution(std::vector<std::uint8_t>& png, double dpi) {
  constexpr std::size_t kEndOfHeader = 33;  // signature 8, IHDR 4 + 4 + 13 + 4
  constexpr double kMetresPerInch = 0.0254;
  if (png.size() < kEndOfHeader) return;
  std::array<std::uint8_t, 21> chunk = {0, 0, 0, 9, 'p', 'H', 'Y', 's'};
  const auto per_metre = static_cast<std::uint32_t>(std::lround(dpi / kMetresPerInch));
  put_big_endian(&chunk[8], per_metre);
  put_big_endian(&chunk[12], per_metre);
  chunk[16] = 1;  // the unit is the metre
  put_big_endian(&chunk[17], crc32(&chunk[4], 13));
  png.insert(png.begin() + kEndOfHeader, chunk.begin(), chunk.end());
}

}  // namespace waymark::plot
