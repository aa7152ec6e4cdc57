#include "waymark/base/message_text.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace waymark {
namespace {

constexpr unsigned char kDelete = 0x7f;
/// Terminals also treat U+0080 to U+009F as control characters. In UTF-8 they are this byte followed by 0x80
/// to 0x9f.
constexpr unsigned char kLeadOfControls = 0xc2;

bool continues(unsigned char byte) { return (byte & 0xc0U) == 0x80U; }

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  unsigned char before = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const unsigned char next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0;
    const bool alone = continues(byte) && before < kDelete;  // invalid UTF-8; a control on 8-bit terminals
    const bool begins_control = byte == kLeadOfControls && continues(next) && next < 0xa0U;
    const bool control = byte < ' ' || byte == kDelete || alone || begins_control;
    if (control)
      out += fmt::format("\\x{:02x}", byte);
    else
      out += text[i];
    // A continuation byte that follows an escaped byte is also alone.
    before = control ? static_cast<unsigned char>(0) : byte;
  }
  return out;
}

namespace {

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

/// Counts insertions, deletions, substitutions and swaps of adjacent characters ("optimal string alignment").
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> cost(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) cost[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) cost[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substitute = lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1;
      cost[i][j] = std::min({cost[i - 1][j] + 1, cost[i][j - 1] + 1, cost[i - 1][j - 1] + substitute});
      const bool swapped =
          i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (swapped) cost[i][j] = std::min(cost[i][j], cost[i - 2][j - 2] + 1);
    }
  }
  return cost[a.size()][b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongestWord = 100;  // a longer word is not a misspelling
  if (word.size() > kLongestWord) return {};
  std::string best;
  std::size_t best_edits = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    // "36h11" for "tag36h11": omitting the beginning or the end is the most common mistake.
    const bool part = word.size() >= 3 && candidate.find(word) != std::string::npos;
    const std::size_t distance = part ? 1 : edits(word, candidate);
    if (distance < best_edits) {
      best = candidate;
      best_edits = distance;
    }
  }
  return best;
}

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  if (candidates.empty()) return {};
  const std::string nearest = nearest_word(word, candidates);
  if (!nearest.empty()) return fmt::format("Did you mean '{}'?", nearest);
  return fmt::format("Known: {}.", fmt::join(candidates, ", "));
}

}  // namespace waymark
