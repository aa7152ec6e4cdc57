#include "waymark/tags/tag_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "waymark/tags/cell_view.hpp"

namespace waymark::search {
namespace {

constexpr float kHalf = 0.5F;

/// Calls visit(side, inner x, inner y, outer x, outer y) for the cells along the border and those outside it.
/// Side i follows corner i of the quad.
template <class Visit>
void for_border_pairs(int width, Visit&& visit) {
  for (int k = 0; k < width; ++k) {
    visit(0U, k, 0, k, -1);
    visit(1U, width - 1, k, width, k);
    visit(2U, k, width - 1, k, width);
    visit(3U, 0, k, -1, k);
  }
}

/// Least squares plane over cells that lie symmetrically about the middle: its three sums are independent.
class PlaneFit {
 public:
  explicit PlaneFit(int width) : middle_(kHalf * static_cast<float>(width - 1)) {}
  void add(int x, int y, float level) {
    const float u = static_cast<float>(x) - middle_;
    const float v = static_cast<float>(y) - middle_;
    n_ += 1;
    uu_ += u * u;
    vv_ += v * v;
    sum_ += level;
    su_ += u * level;
    sv_ += v * level;
  }
  [[nodiscard]] std::array<float, 3> plane() const { return {sum_ / n_, su_ / uu_, sv_ / vv_}; }

 private:
  float middle_;
  float n_ = 0, uu_ = 0, vv_ = 0, sum_ = 0, su_ = 0, sv_ = 0;
};

}  // namespace

ReadableFamily::ReadableFamily(const Family& family, int max_hamming)
    : id(family.id),
      width(family.width_at_border),
      bright_border(family.reversed_border),
      codes(family, max_hamming) {
  for (const BitCell& bit : family.bits) {
    margin = std::max({margin, -bit.x, -bit.y, bit.x - width + 1, bit.y - width + 1});
  }
  const int side = width + 2 * margin;
  for (int turn = 0; turn < 4; ++turn) {
    for (const BitCell& bit : family.bits) {
      int x = bit.x;
      int y = bit.y;
      for (int k = 0; k < turn; ++k) {  // TL of the print is one corner of the quad further on
        const int before = x;
        x = width - 1 - y;
        y = before;
      }
      cells[static_cast<std::size_t>(turn)].push_back(
          static_cast<std::uint16_t>((y + margin) * side + x + margin));
    }
  }
}

float& TagReader::cell(const ReadableFamily& family, int x, int y) {
  return levels_[at((y + family.margin) * side_of(family) + x + family.margin)];
}

float TagReader::sample(const ImageView& image, float u, float v) const {
  return CellView(image, px_H_cell_, sign_).level(u, v);
}

int TagReader::steps_outwards(const ImageView& image, const ReadableFamily& family) const {
  constexpr float kStep = 4;  // grey levels
  const auto width = static_cast<float>(family.width);
  int steps = 0;
  for (const float k : {0.3F * width - kHalf, 0.7F * width}) {
    const auto step = [&](float u0, float v0, float u1, float v1) {
      steps += sample(image, u1, v1) > sample(image, u0, v0) + kStep ? 1 : 0;
    };
    step(k, kHalf, k, -kHalf);
    step(k, width - kHalf, k, width + kHalf);
    step(kHalf, k, -kHalf, k);
    step(width - kHalf, k, width + kHalf, k);
  }
  return steps;
}

bool TagReader::place(const Quad& quad, const ReadableFamily& family, bool inverted) {
  sign_ = family.bright_border != inverted ? -1.0F : 1.0F;
  const int side = side_of(family);
  levels_.resize(at(side * side));  // the family before may have had fewer cells
  distances_.resize(levels_.size());
  return homography(quad, family.width, px_H_cell_);
}

int TagReader::steps_outwards(const ImageView& image, const Quad& quad, const ReadableFamily& family,
                              bool inverted) {
  return place(quad, family, inverted) ? steps_outwards(image, family) : 0;
}

TagReader::Levels TagReader::sample_border(const ImageView& image, const ReadableFamily& family) {
  const auto fill = [&](int x, int y) {
    return cell(family, x, y) = sample(image, static_cast<float>(x) + kHalf, static_cast<float>(y) + kHalf);
  };
  const int w = family.width;
  PlaneFit border(w);
  PlaneFit around(w);
  for (int y = -1; y <= w; ++y) {
    for (int x = -1; x <= w; ++x) {
      const bool outer = x == -1 || y == -1 || x == w || y == w;
      const bool inner = !outer && (x == 0 || y == 0 || x == w - 1 || y == w - 1);
      if (outer) around.add(x, y, fill(x, y));
      if (inner) border.add(x, y, fill(x, y));
    }
  }
  return {border.plane(), around.plane()};
}

std::array<int, 4> TagReader::border_pairs(const ReadableFamily& family, float step) const {
  const int side = side_of(family);
  const auto level = [&](int x, int y) {
    return levels_[at((y + family.margin) * side + x + family.margin)];
  };
  std::array<int, 4> pairs{};
  for_border_pairs(family.width, [&](std::size_t at, int x, int y, int out_x, int out_y) {
    pairs[at] += level(out_x, out_y) > level(x, y) + step ? 1 : 0;
  });
  return pairs;
}

/// Even levels, from all sides but one.
TagReader::Levels TagReader::levels_beside(const ReadableFamily& family, std::size_t covered) const {
  const int side = side_of(family);
  const auto level = [&](int x, int y) {
    return levels_[at((y + family.margin) * side + x + family.margin)];
  };
  Levels levels;
  for_border_pairs(family.width, [&](std::size_t at, int x, int y, int out_x, int out_y) {
    if (at == covered) return;
    levels.border[0] += level(x, y);
    levels.around[0] += level(out_x, out_y);
  });
  const auto count = static_cast<float>(3 * family.width);
  levels.border[0] /= count;
  levels.around[0] /= count;
  return levels;
}

void TagReader::sample_inside(const ImageView& image, const ReadableFamily& family) {
  const int w = family.width;
  for (int y = -family.margin; y < w + family.margin; ++y) {
    for (int x = -family.margin; x < w + family.margin; ++x) {
      const bool inside = x > 0 && y > 0 && x < w - 1 && y < w - 1;
      const bool outside = x < -1 || y < -1 || x > w || y > w;
      if (!inside && !outside) continue;
      cell(family, x, y) = sample(image, static_cast<float>(x) + kHalf, static_cast<float>(y) + kHalf);
    }
  }
}

std::optional<TagDetection> TagReader::read(const ImageView& image, const Quad& quad,
                                            const ReadableFamily& family, bool inverted,
                                            ReadProgress& progress) {
  constexpr int kEnoughSteps = 5;     // of 8
  constexpr float kPairStep = 0.25F;  // of the contrast
  constexpr std::array<float, 3> kSharpening = {0.25F, 0.8F, 0};
  progress = {};
  if (!place(quad, family, inverted)) return std::nullopt;
  if (steps_outwards(image, family) < kEnoughSteps) return std::nullopt;  // most quads that are no tags
  const Levels levels = sample_border(image, family);
  if (!(levels.contrast() >= static_cast<float>(options_.min_contrast))) return std::nullopt;
  const std::array<int, 4> pairs = border_pairs(family, kPairStep * levels.contrast());
  for (const int along : pairs) progress.sides_seen += 4 * along >= 3 * family.width ? 1 : 0;
  const int seen = pairs[0] + pairs[1] + pairs[2] + pairs[3];
  progress.border_seen = seen >= 3 * family.width || progress.sides_seen >= 3;
  if (!progress.border_seen) return std::nullopt;
  sample_inside(image, family);
  std::optional<TagDetection> best;
  for (const float amount : kSharpening) {
    sharpen(family, levels, amount);
    if (progress.changes == 0) progress.changes = changes_inside(family);
    const std::optional<TagDetection> found = decode(quad, family);
    if (found && (!best || found->hamming < best->hamming)) best = found;
    if ((best && best->hamming <= 1) || (!best && progress.changes < kFewChanges)) break;
  }
  if (!best && progress.changes >= kFewChanges) best = decode_known(quad, family, levels);
  if (!best && progress.changes >= kFewChanges) best = decode_in_shadow(quad, family);
  return best;
}

std::optional<TagDetection> TagReader::read_covered(const ImageView& image, const Quad& quad,
                                                    const ReadableFamily& family, bool inverted,
                                                    std::size_t covered) {
  constexpr float kPairStep = 0.25F;  // of the contrast
  constexpr float kSharpening = 0.25F;
  if (!place(quad, family, inverted)) return std::nullopt;
  (void)sample_border(image, family);
  const Levels levels = levels_beside(family, covered);
  if (!(levels.contrast() >= static_cast<float>(options_.min_contrast))) return std::nullopt;
  const std::array<int, 4> pairs = border_pairs(family, kPairStep * levels.contrast());
  for (std::size_t i = 0; i < 4; ++i) {
    if (i != covered && 4 * pairs[i] < 3 * family.width) return std::nullopt;
  }
  sample_inside(image, family);
  sharpen(family, levels, kSharpening);
  std::optional<TagDetection> found = decode(quad, family);
  if (!found) found = decode_beside(quad, family, covered);
  return found;
}

}  // namespace waymark::search
