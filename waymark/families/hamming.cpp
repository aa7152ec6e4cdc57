#include "waymark/families/hamming.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>

namespace waymark {
namespace {

constexpr int kTurns = 4;
constexpr std::size_t kCancelCheckCodes = 1024;  // a multiple of kTurns; takes tens of milliseconds

/// All four rotations of every code, grouped by code, with the upright one first.
std::vector<std::uint64_t> all_turns(const Family& family) {
  const CodeRotation rotation(family);
  std::vector<std::uint64_t> turns;
  turns.reserve(family.codes.size() * kTurns);
  for (const std::uint64_t code : family.codes) {
    for (int turn = 0; turn < kTurns; ++turn) turns.push_back(rotation.turned(code, turn));
  }
  return turns;
}

/// All words of `width` bits with at most `weight` ones.
std::vector<std::uint32_t> light_words(int width, int weight) {
  std::vector<std::uint32_t> words;
  if (weight < 0) return words;
  words.push_back(0);
  std::size_t first = 0;
  for (int ones = 1; ones <= std::min(weight, width); ++ones) {
    const std::size_t end = words.size();
    for (std::size_t i = first; i < end; ++i) {
      for (int bit = static_cast<int>(std::bit_width(words[i])); bit < width; ++bit)
        words.push_back(words[i] | (1U << bit));
    }
    first = end;
  }
  return words;
}

/// A contiguous group of bits in a word.
struct Part {
  int shift = 0;
  int width = 0;

  [[nodiscard]] std::uint32_t value(std::uint64_t code) const {
    return static_cast<std::uint32_t>((code >> shift) & ((std::uint64_t{1} << width) - 1));
  }
};

/// Codes sorted by their value in a part. Among codes with the same value, the first one added is removed
/// first.
struct Buckets {
  std::vector<std::uint32_t> first;  ///< index of the first code with each value
  std::vector<std::uint32_t> end;
  std::vector<std::uint64_t> codes;

  Buckets(const std::vector<std::uint64_t>& turns, const Part& part)
      : first(std::size_t{1} << part.width), end(first.size()), codes(turns.size()) {
    for (const std::uint64_t code : turns) ++end[part.value(code)];
    std::uint32_t sum = 0;
    for (std::size_t value = 0; value < first.size(); ++value) {
      first[value] = sum;
      sum += end[value];
      end[value] = first[value];
    }
    for (const std::uint64_t code : turns) codes[end[part.value(code)]++] = code;
  }

  /// Whether a code that is still in the buckets is at most `radius` from `code`. Only checks codes whose
  /// values differ by one of `differences`.
  [[nodiscard]] bool any_near(std::uint64_t code, const Part& part,
                              const std::vector<std::uint32_t>& differences, int radius) const {
    const std::uint32_t here = part.value(code);
    for (const std::uint32_t difference : differences) {
      const std::uint32_t value = here ^ difference;
      for (std::uint32_t i = first[value]; i < end[value]; ++i) {
        if (hamming_distance(code, codes[i]) <= radius) return true;
      }
    }
    return false;
  }
};

/// Whether two different codes in any relative rotation, or a code and a rotation of itself, are at most
/// `radius` apart and at most `near` apart within the part.
bool any_pair(const std::vector<std::uint64_t>& turns, const Part& part, int near, int radius,
              const std::function<bool()>& cancelled) {
  const std::vector<std::uint32_t> differences = light_words(part.width, near);
  if (differences.empty()) return false;
  Buckets buckets(turns, part);
  for (std::size_t i = 0; i < turns.size(); i += kTurns) {
    if (i % kCancelCheckCodes == 0 && cancelled()) return true;
    // Each pair is checked only once: the upright first code against the rotations of the second, and a code
    // against its own rotations before those are removed.
    ++buckets.first[part.value(turns[i])];
    if (buckets.any_near(turns[i], part, differences, radius)) return true;
    for (std::size_t turn = 1; turn < kTurns; ++turn) ++buckets.first[part.value(turns[i + turn])];
  }
  return false;
}

/// Whether any pair is at most `radius` apart. Such a pair is at most `near` apart in one of three parts of
/// the word if the three values of near + 1 add up to radius + 1. Only codes that nearly agree in a part
/// therefore need to be compared.
bool any_pair(const std::vector<std::uint64_t>& turns, int bits, int radius,
              const std::function<bool()>& cancelled) {
  constexpr int kParts = 3;
  for (int i = 0; i < kParts; ++i) {
    const int begin = bits * i / kParts;
    const Part part{begin, bits * (i + 1) / kParts - begin};
    if (any_pair(turns, part, (radius + 1 + i) / kParts - 1, radius, cancelled)) return true;
  }
  return false;
}

}  // namespace

CodeRotation::CodeRotation(const Family& family) {
  const int count = static_cast<int>(family.bits.size());
  source_shift_.assign(family.bits.size(), 0);
  for (int from = 0; from < count; ++from) {
    const BitCell cell = family.bits[static_cast<std::size_t>(from)];
    const BitCell target{family.width_at_border - 1 - cell.y, cell.x};
    const auto found = std::find_if(family.bits.begin(), family.bits.end(), [&](const BitCell& bit) {
      return bit.x == target.x && bit.y == target.y;
    });
    assert(found != family.bits.end());
    const int to = static_cast<int>(found - family.bits.begin());
    source_shift_[static_cast<std::size_t>(count - 1 - to)] = count - 1 - from;
  }
}

std::uint64_t CodeRotation::turned(std::uint64_t code, int quarter_turns) const {
  const int turns = ((quarter_turns % kTurns) + kTurns) % kTurns;
  for (int turn = 0; turn < turns; ++turn) {
    std::uint64_t next = 0;
    for (std::size_t bit = 0; bit < source_shift_.size(); ++bit) {
      next |= ((code >> source_shift_[bit]) & 1U) << bit;
    }
    code = next;
  }
  return code;
}

int CodeRotation::min_rotational_distance(std::uint64_t a, std::uint64_t b) const {
  int best = hamming_distance(a, b);
  for (int turn = 1; turn < kTurns; ++turn) {
    b = turned(b, 1);
    best = std::min(best, hamming_distance(a, b));
  }
  return best;
}

int minimum_distance(const Family& family, const std::function<bool()>& cancelled) {
  const std::vector<std::uint64_t> turns = all_turns(family);
  const int bits = static_cast<int>(family.bits.size());
  // The nominal distance is nearly always exact, so checking first that no pair is closer avoids trying the
  // small radii.
  const int promised = std::clamp(family.min_hamming, 0, bits);
  int distance = any_pair(turns, bits, promised - 1, cancelled) ? 0 : promised;
  while (distance < bits && !any_pair(turns, bits, distance, cancelled)) ++distance;
  return distance;
}

}  // namespace waymark
