#pragma once

#include <cstdint>
#include <string_view>

namespace waymark {

/// 64-bit FNV-1a (Fowler, Noll, Vo), continued from the hash of earlier text. Detects changes, but is not a
/// cryptographic hash.
[[nodiscard]] constexpr std::uint64_t fnv1a(std::string_view text,
                                            std::uint64_t earlier = 0xcbf29ce484222325ULL) {
  constexpr std::uint64_t kPrime = 0x100000001b3ULL;
  std::uint64_t hash = earlier;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * kPrime;
  return hash;
}

}  // namespace waymark
