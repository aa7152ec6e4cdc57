#include "waymark/base/printable.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr unsigned char kDelete = 0x7f;
/// UTF-8 of U+0080 to U+009F, which terminals obey as well: this byte, then 0x80 to 0x9f.
constexpr unsigned char kLeadOfControls = 0xc2;

bool continues(unsigned char byte) { return (byte & 0xc0U) == 0x80U; }

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  unsigned char before = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const unsigned char next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    const bool alone = continues(byte) && before < kDelete;  // no letter of UTF-8: an old terminal's control
    const bool begins_control = byte == kLeadOfControls && continues(next) && next < 0xa0U;
    const bool control = byte < ' ' || byte == kDelete || alone || begins_control;
    if (control)
      out += fmt::format("\\x{:02x}", byte);
    else
      out += text[i];
    // The byte after an escaped one stands alone, too.
    before = control ? static_cast<unsigned char>(0) : byte;
  }
  return out;
}

}  // namespace waymark
