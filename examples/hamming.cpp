// How many wrong bits should a detector correct? For each threshold: how often a random quad passes as a tag,
// and how many tags are read correctly and wrongly if each bit flips with some probability. Martins and
// Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section 2.3.1.   usage: waymark_hamming
// [FAMILY]
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/random.hpp"
#include "waymark/families/hamming.hpp"

using namespace waymark;  // NOLINT(google-build-using-namespace): an example

/// Distance and index of the word in `turns` nearest to `word`: equation 2.15 over all codes.
std::pair<int, std::size_t> nearest(std::uint64_t word, const std::vector<std::uint64_t>& turns) {
  std::pair<int, std::size_t> best{64, 0};
  for (std::size_t i = 0; i < turns.size(); ++i) best = std::min(best, {hamming_distance(word, turns[i]), i});
  return best;
}

/// Words within `radius` of one word, as a fraction of all words.
double ball(double bits, int radius) {
  double words = 0;
  double choose = 1;
  for (int k = 0; k <= radius; choose *= (bits - k) / (k + 1), ++k) words += choose;
  return words / std::exp2(bits);
}

int main(int argc, char** argv) {
  const Result<FamilyId> id = parse_family(argc > 1 ? argv[1] : "tag36h11");
  if (!id) return fmt::print(stderr, "{}\n", to_string(id.error())), 2;
  const Family& table = family(*id);
  const std::size_t bits = table.bits.size();
  std::vector<std::uint64_t> turns;
  for (const std::uint64_t code : table.codes) {
    for (int turn = 0; turn < 4; ++turn) turns.push_back(CodeRotation(table).turned(code, turn));
  }
  constexpr std::array kFlips = {0.02, 0.05, 0.10};
  constexpr int kTrials = 20000;
  std::array<std::array<std::array<int, 65>, 2>, kFlips.size()> read{};  // [flips][right, wrong][distance]
  std::array<int, 65> random_quads{};                                    // [distance]
  Random random(1);
  for (int trial = 0; trial < kTrials; ++trial) {
    ++random_quads.at(std::size_t(nearest(random.index(std::uint64_t{1} << bits), turns).first));
    for (std::size_t f = 0; f < kFlips.size(); ++f) {
      const std::size_t seen = random.index(turns.size());
      std::uint64_t word = turns[seen];
      for (std::size_t bit = 0; bit < bits; ++bit)
        word ^= std::uint64_t{random.uniform() < kFlips.at(f)} << bit;
      const auto [distance, index] = nearest(word, turns);
      ++read.at(f).at(index / 4 == seen / 4 ? 0 : 1).at(std::size_t(distance));
    }
  }
  fmt::print("| bits corrected | random quads taken for a tag: expected | counted |");
  for (const double flip : kFlips) fmt::print(" {:.0f} % flips: right | wrong |", 100 * flip);
  fmt::print("\n|---|---|---|---|---|---|---|---|---|\n");
  double counted = 0;
  std::array<std::array<double, 2>, kFlips.size()> share{};
  for (int t = 0; t <= table.min_hamming; ++t) {
    counted += random_quads.at(std::size_t(t)) / double{kTrials};
    const double expected = double(turns.size()) * ball(double(bits), t);
    // Beyond half the distance the codes' balls overlap, and their sum is only an upper bound.
    const char* bound = 2 * t < table.min_hamming ? "" : "at most ";
    fmt::print("| {} | {}{:.2g} | {:.2g} |", t, bound, std::min(expected, 1.0), counted);
    for (std::size_t f = 0; f < kFlips.size(); ++f) {
      for (std::size_t k = 0; k < 2; ++k) {
        share.at(f).at(k) += 100.0 * read.at(f).at(k).at(std::size_t(t)) / kTrials;
        fmt::print(" {:.1f} % |", share.at(f).at(k));
      }
    }
    fmt::print("\n");
  }
}
