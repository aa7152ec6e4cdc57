#include "waymark/tags/code_index.hpp"

#include <algorithm>
#include <cassert>
#include <cstddef>

#include "waymark/families/hamming.hpp"

namespace waymark::search {

CodeIndex::CodeIndex(const Family& family, int max_distance)
    : codes_(family.codes), max_distance_(max_distance) {
  assert(max_distance >= 0 && max_distance <= 3);
  constexpr unsigned kMostBits = 16;  // of a piece: what is beyond is not looked at
  const auto bits = static_cast<unsigned>(family.bits.size());
  const unsigned count = static_cast<unsigned>(max_distance) + 1;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned begin = bits * i / count;
    const unsigned width = std::min(bits * (i + 1) / count - begin, kMostBits);
    Piece piece;
    piece.shift = begin;
    piece.mask = (std::uint64_t{1} << width) - 1;
    piece.begins.assign((std::size_t{1} << width) + 1, 0);
    const auto value = [&piece](std::uint64_t code) {
      return static_cast<std::size_t>((code >> piece.shift) & piece.mask);
    };
    for (const std::uint64_t code : codes_) ++piece.begins[value(code) + 1];
    for (std::size_t v = 1; v < piece.begins.size(); ++v) piece.begins[v] += piece.begins[v - 1];
    std::vector<std::uint32_t> next = piece.begins;
    piece.numbers.resize(codes_.size());
    for (std::size_t number = 0; number < codes_.size(); ++number)
      piece.numbers[next[value(codes_[number])]++] = static_cast<std::uint32_t>(number);
    pieces_.push_back(std::move(piece));
  }
}

std::optional<NearestCode> CodeIndex::find(std::uint64_t code) const {
  std::optional<NearestCode> best;
  for (const Piece& piece : pieces_) {
    const auto value = static_cast<std::size_t>((code >> piece.shift) & piece.mask);
    for (std::uint32_t i = piece.begins[value]; i < piece.begins[value + 1]; ++i) {
      const auto number = static_cast<int>(piece.numbers[i]);
      const int distance = hamming_distance(codes_[piece.numbers[i]], code);
      if (distance > max_distance_) continue;
      const bool better =
          !best || distance < best->distance || (distance == best->distance && number < best->number);
      if (better) best = NearestCode{number, distance};
    }
  }
  return best;
}

std::optional<int> CodeIndex::find_exact(std::uint64_t code, std::uint64_t known) const {
  const auto fits = [&](std::uint64_t other) { return ((other ^ code) & known) == 0; };
  const auto found = std::ranges::find_if(codes_, fits);
  if (found == codes_.end() || std::find_if(found + 1, codes_.end(), fits) != codes_.end())
    return std::nullopt;
  return static_cast<int>(found - codes_.begin());
}

}  // namespace waymark::search
