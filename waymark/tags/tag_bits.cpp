// From the levels of a tag's cells to its code.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>

#include "waymark/tags/shadow_edge.hpp"
#include "waymark/tags/soft_bits.hpp"
#include "waymark/tags/tag_reader.hpp"

namespace waymark::search {
namespace {

TagDetection turned(const Quad& quad, std::size_t turn, const TagId& tag, int hamming, float margin) {
  TagDetection detection;
  detection.tag = tag;
  detection.hamming = hamming;
  detection.decision_margin = margin;
  for (std::size_t i = 0; i < 4; ++i) detection.corners_px[i] = quad[(i + turn) % 4].cast<double>();
  return detection;
}

}  // namespace

/// Distances of the cells from the threshold, after each was moved away from the mean of its neighbours.
void TagReader::sharpen(const ReadableFamily& family, const Levels& levels, float amount) {
  const int side = side_of(family);
  const float middle = 0.5F * static_cast<float>(side - 1);
  Plane mean{};
  for (std::size_t i = 0; i < 3; ++i) mean[i] = 0.5F * (levels.border[i] + levels.around[i]);
  const auto at = [side](int x, int y) {
    const int index = y * side + x;
    return static_cast<std::size_t>(index);
  };
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const float here = levels_[at(x, y)];
      float around = 0;
      around += y > 0 ? levels_[at(x, y - 1)] : here;
      around += y + 1 < side ? levels_[at(x, y + 1)] : here;
      around += x > 0 ? levels_[at(x - 1, y)] : here;
      around += x + 1 < side ? levels_[at(x + 1, y)] : here;
      const float threshold =
          mean[0] + mean[1] * (static_cast<float>(x) - middle) + mean[2] * (static_cast<float>(y) - middle);
      distances_[at(x, y)] = here + amount * 0.5F * (4 * here - around) - threshold;
    }
  }
}

/// Whether the bits that would have to be wrong are ones that were nearly undecided. `margin`: mean distance
/// of the known bits from the threshold, wrong ones counted as negative.
bool TagReader::believable(const ReadableFamily& family, std::size_t turn, std::uint64_t wrong_bits,
                           std::uint64_t known_bits, float& margin) const {
  constexpr float kUndecided = 0.8F;  // of the mean distance of the right bits
  float right = 0;
  float wrong = 0;
  int wrong_count = 0;
  int known_count = 0;
  const std::vector<std::uint16_t>& cells = family.cells[turn];
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const std::size_t bit = cells.size() - 1 - k;
    if (((known_bits >> bit) & 1U) == 0) continue;
    ++known_count;
    const bool is_wrong = ((wrong_bits >> bit) & 1U) != 0;
    const float distance = std::abs(distances_[cells[k]]);
    (is_wrong ? wrong : right) += distance;
    wrong_count += is_wrong ? 1 : 0;
  }
  const auto count = static_cast<float>(std::max(1, known_count));
  margin = (right - wrong) / count;
  const float mean_right = right / std::max(1.0F, count - static_cast<float>(wrong_count));
  return wrong <= kUndecided * mean_right * static_cast<float>(wrong_count);
}

/// In the signed levels the border is always low. A bit that is 1 is printed unlike a dark border and like a
/// bright one, inverted or not.
std::uint64_t TagReader::code_of(const ReadableFamily& family, std::size_t turn) const {
  const bool one_is_high = !family.bright_border;
  std::uint64_t code = 0;
  for (const std::uint16_t at : family.cells[turn]) {
    const bool high = distances_[at] > 0;
    code = (code << 1U) | (high == one_is_high ? 1U : 0U);
  }
  return code;
}

std::optional<TagDetection> TagReader::decode(const Quad& quad, const ReadableFamily& family) {
  std::optional<TagDetection> best;
  for (std::size_t turn = 0; turn < 4; ++turn) {
    const std::uint64_t code = code_of(family, turn);
    const std::optional<NearestCode> near = family.codes.find(code);
    if (!near || (best && near->distance >= best->hamming)) continue;
    const std::uint64_t wrong =
        code ^ waymark::family(family.id).codes[static_cast<std::size_t>(near->number)];
    float margin = 0;
    if (!believable(family, turn, wrong, ~std::uint64_t{0}, margin) ||
        !(margin >= static_cast<float>(options_.min_margin)))
      continue;
    best = turned(quad, turn, {family.id, near->number}, near->distance, margin);
  }
  return best;
}

std::optional<TagDetection> TagReader::decode_known(const Quad& quad, const ReadableFamily& family,
                                                    const Levels& levels) {
  constexpr std::array<float, 2> kSharpening = {0.25F, 0.8F};
  constexpr int kMostWrong = 4;
  constexpr float kTurns = 4;
  // By evidence_bits() bits at random pass in at most one of 2^14 quads with a border, whatever the number of
  // hypotheses. That is a bound: where all levels are sure, two wrong bits are left of 36 and 44 known tags,
  // and 1.7 in a million quads pass. With one bit corrected 1.3 in a million pass for any tag of tag36h11.
  constexpr float kEnough = 14;
  if (family.known.empty()) return std::nullopt;
  const auto hypotheses = static_cast<float>(family.known.size() * kSharpening.size()) * kTurns;
  float most = kEnough + std::log2(hypotheses);
  std::optional<TagDetection> best;
  for (const float amount : kSharpening) {
    sharpen(family, levels, amount);
    for (std::size_t turn = 0; turn < family.cells.size(); ++turn) {
      const std::uint64_t code = code_of(family, turn);
      for (const int number : family.known) {
        const std::uint64_t wrong = code ^ waymark::family(family.id).codes[static_cast<std::size_t>(number)];
        if (std::popcount(wrong) > kMostWrong) continue;
        const float evidence = evidence_bits(distances_, family.cells[turn], wrong);
        float margin = 0;
        (void)believable(family, turn, wrong, ~std::uint64_t{0}, margin);
        if (!(evidence >= most) || !(margin >= static_cast<float>(options_.min_margin))) continue;
        most = evidence;
        best = turned(quad, turn, {family.id, number}, std::popcount(wrong), margin);
      }
    }
  }
  return best;
}

std::optional<TagDetection> TagReader::decode_in_shadow(const Quad& quad, const ReadableFamily& family) {
  constexpr float kSharpening = 0.25F;
  const auto edge =
      find_shadow_edge({levels_, family.width, family.margin}, static_cast<float>(options_.min_contrast));
  if (!edge) return std::nullopt;
  for (int y = -family.margin; y < family.width + family.margin; ++y) {
    for (int x = -family.margin; x < family.width + family.margin; ++x) {
      float& level = cell(family, x, y);
      level = edge->in_the_light(level, x, y);
    }
  }
  sharpen(family, {{edge->border[1], 0, 0}, {edge->around[1], 0, 0}}, kSharpening);
  return decode(quad, family);
}

std::optional<TagDetection> TagReader::decode_beside(const Quad& quad, const ReadableFamily& family,
                                                     std::size_t covered) {
  constexpr int kLeastDistance = 5;  // of two codes, by the bits that are left
  const int side = side_of(family);
  const auto next_to_it = [&](std::uint16_t at) {
    const int x = at % side - family.margin;
    const int y = at / side - family.margin;
    const std::array<int, 4> depth = {y, family.width - 1 - x, family.width - 1 - y, x};
    return depth.at(covered) <= 1;
  };
  for (std::size_t turn = 0; turn < 4; ++turn) {
    std::uint64_t known = 0;
    int left_out = 0;
    for (const std::uint16_t at : family.cells[turn]) {
      const bool out = next_to_it(at);
      known = (known << 1U) | (out ? 0U : 1U);
      left_out += out ? 1 : 0;
    }
    if (waymark::family(family.id).min_hamming - left_out < kLeastDistance) return std::nullopt;
    const std::optional<int> number = family.codes.find_exact(code_of(family, turn), known);
    float margin = 0;
    if (!number || !believable(family, turn, 0, known, margin) ||
        !(margin >= static_cast<float>(options_.min_margin)))
      continue;
    return turned(quad, turn, {family.id, *number}, 0, margin);
  }
  return std::nullopt;
}

int TagReader::changes_inside(const ReadableFamily& family) const {
  const int side = side_of(family);
  const auto bright = [&](int x, int y) {
    const int index = (y + family.margin) * side + x + family.margin;
    return distances_[static_cast<std::size_t>(index)] > 0;
  };
  int changes = 0;
  for (int y = 1; y < family.width - 1; ++y) {
    for (int x = 1; x < family.width - 1; ++x) {
      changes += x > 1 && bright(x, y) != bright(x - 1, y) ? 1 : 0;
      changes += y > 1 && bright(x, y) != bright(x, y - 1) ? 1 : 0;
    }
  }
  return changes;
}

}  // namespace waymark::search
