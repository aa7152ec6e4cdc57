#include "waymark/tags/detector/tag_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "waymark/families/hamming.hpp"

namespace waymark::search {

CodeIndex::CodeIndex(const Family& family, int max_distance)
    : codes_(family.codes), max_distance_(max_distance) {
  assert(max_distance >= 0 && max_distance <= 3);
  constexpr unsigned kMaxBits = 16;  // maximum bits per piece; further bits are ignored
  const auto bits = static_cast<unsigned>(family.bits.size());
  const unsigned count = static_cast<unsigned>(max_distance) + 1;
  for (unsigned i = 0; i < count; ++i) {
    const unsigned begin = bits * i / count;
    const unsigned width = std::min(bits * (i + 1) / count - begin, kMaxBits);
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

bool homography(const Quad& q, int width, Eigen::Matrix3f& px_H_cell) {
  const Eigen::Vector2f u = q[1] - q[2];
  const Eigen::Vector2f v = q[3] - q[2];
  const Eigen::Vector2f s = q[0] - q[1] + q[2] - q[3];
  const float det = u.x() * v.y() - u.y() * v.x();
  if (std::abs(det) < 1e-6F) return false;
  const float g = (s.x() * v.y() - s.y() * v.x()) / det;
  const float h = (u.x() * s.y() - u.y() * s.x()) / det;
  const float scale = 1 / static_cast<float>(width);
  px_H_cell.col(0) << (q[1] - q[0] + g * q[1]) * scale, g * scale;
  px_H_cell.col(1) << (q[3] - q[0] + h * q[3]) * scale, h * scale;
  px_H_cell.col(2) << q[0], 1;
  return true;
}

namespace {

constexpr std::size_t kMaxRingCells = 80;  // as many as surround a border of 19 cells
constexpr std::size_t kMinArcCells = 3;

/// The cells around the border, in clockwise order.
struct Ring {
  std::array<Eigen::Vector2i, kMaxRingCells> cell;
  std::array<float, kMaxRingCells + 1> sum{}, squares{};  ///< cumulative sums of the levels before each cell
  std::size_t count = 0;

  explicit Ring(const CellLevels& cells) {
    const int w = cells.width;
    for (int k = -1; k < w; ++k) add(cells, k, -1);
    for (int k = -1; k < w; ++k) add(cells, w, k);
    for (int k = w; k > -1; --k) add(cells, k, w);
    for (int k = w; k > -1; --k) add(cells, -1, k);
  }

  void add(const CellLevels& cells, int x, int y) {
    const float level = cells.at(x, y);
    cell[count] = {x, y};
    sum[count + 1] = sum[count] + level;
    squares[count + 1] = squares[count] + level * level;
    ++count;
  }
  /// The point midway between the centres of a cell and the previous one.
  [[nodiscard]] Eigen::Vector2f before(std::size_t i) const {
    const Eigen::Vector2i both = cell[i] + cell[(i + count - 1) % count];
    return 0.5F * both.cast<float>() + Eigen::Vector2f(0.5F, 0.5F);
  }
};

/// Divides the ring into the cells in [begin, end) and all others.
struct Arcs {
  std::size_t begin = 0, end = 0;
  float error = 0;  ///< sum of squared deviations from the means of the two arcs
};

std::optional<Arcs> best_arcs(const Ring& ring) {
  const std::size_t n = ring.count;
  const float all = ring.sum[n];
  const float squares = ring.squares[n];
  std::optional<Arcs> best;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + kMinArcCells; j < n && n - (j - i) >= kMinArcCells; ++j) {
      const auto inside = static_cast<float>(j - i);
      const float sum = ring.sum[j] - ring.sum[i];
      const float rest = all - sum;
      const float error = squares - sum * sum / inside - rest * rest / (static_cast<float>(n) - inside);
      if (!best || error < best->error) best = Arcs{i, j, error};
    }
  }
  return best;
}

/// Mean level of the cells in an arc, without those at its ends, which are partly in the shadow.
float mean_of(const Ring& ring, std::size_t begin, std::size_t count) {
  float sum = 0;
  for (std::size_t k = 1; k + 1 < count; ++k) {
    const std::size_t i = (begin + k) % ring.count;
    sum += ring.sum[i + 1] - ring.sum[i];
  }
  return sum / static_cast<float>(count - 2);
}

/// Mean levels of the border's cells on either side of the edge. Returns false if there are none on one side.
bool border_levels(const CellLevels& cells, ShadowEdge& edge) {
  std::array<float, 2> count{};
  const int last = cells.width - 1;
  for (int y = 0; y <= last; ++y) {
    for (int x = 0; x <= last; ++x) {
      if (x != 0 && y != 0 && x != last && y != last) continue;
      const float lit = edge.lit(x, y);
      if (lit > 0 && lit < 1) continue;
      const std::size_t side = lit > 0 ? 1 : 0;
      edge.border.at(side) += cells.at(x, y);
      count.at(side) += 1;
    }
  }
  if (count[0] == 0 || count[1] == 0) return false;
  edge.border = {edge.border[0] / count[0], edge.border[1] / count[1]};
  return true;
}

}  // namespace

float ShadowEdge::lit(int x, int y) const {
  const Eigen::Vector2f middle(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
  return std::clamp(normal.dot(middle) - offset + 0.5F, 0.0F, 1.0F);
}

float ShadowEdge::level_if_lit(float level, int x, int y) const {
  const float light = lit(x, y);
  const float black = border[0] + light * (border[1] - border[0]);
  const float white = around[0] + light * (around[1] - around[0]);
  return border[1] + (level - black) * (around[1] - border[1]) / (white - black);
}

std::optional<ShadowEdge> find_shadow_edge(const CellLevels& cells, float min_contrast) {
  constexpr float kMaxUnexplained = 0.4F;  // maximum share of the sum of squares that remains unexplained
  constexpr float kMinEdgeCells = 2;       // distance between the ends of the edge
  const int around = 4 * (cells.width + 1);
  if (cells.width < 2 || static_cast<std::size_t>(around) > kMaxRingCells) return std::nullopt;
  const Ring ring(cells);
  const std::optional<Arcs> arcs = best_arcs(ring);
  const auto n = static_cast<float>(ring.count);
  const float whole = ring.squares[ring.count] - ring.sum[ring.count] * ring.sum[ring.count] / n;
  if (!arcs || !(arcs->error < kMaxUnexplained * whole)) return std::nullopt;
  const Eigen::Vector2f from = ring.before(arcs->begin);
  const Eigen::Vector2f to = ring.before(arcs->end % ring.count);
  if ((to - from).norm() < kMinEdgeCells) return std::nullopt;
  const std::size_t inside = arcs->end - arcs->begin;
  const float arc = mean_of(ring, arcs->begin, inside);
  const float rest = mean_of(ring, arcs->end, ring.count - inside);
  ShadowEdge edge;
  // The arc is on the left when facing from its begin to its end, because the ring is clockwise.
  const Eigen::Vector2f along = (to - from).normalized();
  edge.normal = Eigen::Vector2f(along.y(), -along.x()) * (arc > rest ? 1.0F : -1.0F);
  edge.offset = edge.normal.dot(from);
  edge.around = {std::min(arc, rest), std::max(arc, rest)};
  if (!border_levels(cells, edge)) return std::nullopt;
  for (const std::size_t side : {0U, 1U})
    if (!(edge.around.at(side) - edge.border.at(side) >= min_contrast)) return std::nullopt;
  return edge;
}

float evidence_bits(std::span<const float> distances, std::span<const std::uint16_t> cells,
                    std::uint64_t wrong_bits) {
  constexpr float kSteepness = 8;     // 2 mu^2 / sigma^2 for levels at +-mu with noise of mu / 2
  constexpr float kOutliers = 0.06F;  // share of cells changed by dirt, gloss or a shadow
  float mean = 0;
  for (const std::uint16_t at : cells) mean += std::abs(distances[at]);
  mean /= static_cast<float>(cells.size());
  if (!(mean > 0)) return 0;
  float evidence = 0;
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const bool wrong = ((wrong_bits >> (cells.size() - 1 - k)) & 1U) != 0;
    const float towards = std::abs(distances[cells[k]]) * (wrong ? -1.0F : 1.0F);
    const float likely = 1 / (1 + std::exp(-kSteepness * towards / mean));
    evidence += std::log2(kOutliers + (1 - kOutliers) * 2 * likely);
  }
  return evidence;
}

namespace {

constexpr float kHalf = 0.5F;

/// Calls visit(side, inner x, inner y, outer x, outer y) for each cell along the border and the adjacent cell
/// outside it. Side i follows corner i of the quad.
template <class Visit>
void for_border_pairs(int width, Visit&& visit) {
  for (int k = 0; k < width; ++k) {
    visit(0U, k, 0, k, -1);
    visit(1U, width - 1, k, width, k);
    visit(2U, k, width - 1, k, width);
    visit(3U, 0, k, -1, k);
  }
}

/// Least squares plane over cells that are symmetric about the centre, so its three sums are independent.
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
      for (int k = 0; k < turn;
           ++k) {  // a turn moves the TL corner of the print to the next corner of the quad
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
  constexpr float kStep = 4;  // in grey levels
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
  levels_.resize(at(side * side));  // the previous family may have had fewer cells
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

/// Constant levels, computed from all sides except the covered one.
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

std::optional<TagReader::Levels> TagReader::see_border(const ImageView& image, const Quad& quad,
                                                       const ReadableFamily& family, bool inverted,
                                                       ReadProgress& progress) {
  constexpr int kMinSteps = 5;        // out of 8
  constexpr float kPairStep = 0.25F;  // share of the contrast
  progress = {};
  if (!place(quad, family, inverted)) return std::nullopt;
  if (steps_outwards(image, family) < kMinSteps) return std::nullopt;  // rejects most quads that are not tags
  const Levels levels = sample_border(image, family);
  if (!(levels.contrast() >= static_cast<float>(options_.min_contrast))) return std::nullopt;
  const std::array<int, 4> pairs = border_pairs(family, kPairStep * levels.contrast());
  for (const int along : pairs) progress.sides_seen += 4 * along >= 3 * family.width ? 1 : 0;
  const int seen = pairs[0] + pairs[1] + pairs[2] + pairs[3];
  progress.border_seen = seen >= 3 * family.width || progress.sides_seen >= 3;
  if (!progress.border_seen) return std::nullopt;
  sample_inside(image, family);
  return levels;
}

std::optional<TagDetection> TagReader::read(const ImageView& image, const Quad& quad,
                                            const ReadableFamily& family, bool inverted,
                                            ReadProgress& progress) {
  constexpr std::array<float, 3> kSharpening = {0.25F, 0.8F, 0};
  const std::optional<Levels> seen = see_border(image, quad, family, inverted, progress);
  if (!seen) return std::nullopt;
  const Levels& levels = *seen;
  std::optional<TagDetection> best;
  for (const float amount : kSharpening) {
    sharpen(family, levels, amount);
    if (progress.changes == 0) progress.changes = changes_inside(family);
    const std::optional<TagDetection> found = decode(quad, family);
    if (found && (!best || found->hamming < best->hamming)) best = found;
    if ((best && best->hamming <= 1) || (!best && progress.changes < kMinChanges)) break;
  }
  if (!best && progress.changes >= kMinChanges) best = decode_known(quad, family, levels);
  if (!best && progress.changes >= kMinChanges) best = decode_in_shadow(quad, family);
  return best;
}

std::optional<TagDetection> TagReader::read_overexposed(const ImageView& image, const Quad& quad,
                                                        const ReadableFamily& family, bool inverted) {
  constexpr std::array<float, 2> kSharpening = {0.25F, 0.8F};
  constexpr float kShare = 0.85F;  // of the range, from dark to bright
  ReadProgress progress;
  const std::optional<Levels> levels = see_border(image, quad, family, inverted, progress);
  if (!levels) return std::nullopt;
  for (const float amount : kSharpening) {
    sharpen(family, *levels, amount, sign_ > 0 ? kShare : 1 - kShare);
    if (changes_inside(family) < kMinChanges) continue;
    const std::optional<TagDetection> found = decode(quad, family);
    if (found && found->hamming == 0) return found;
  }
  return std::nullopt;
}

std::optional<TagDetection> TagReader::read_covered(const ImageView& image, const Quad& quad,
                                                    const ReadableFamily& family, bool inverted,
                                                    std::size_t covered) {
  constexpr float kPairStep = 0.25F;  // share of the contrast
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

// Decoding of the cell levels.

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

/// Computes the distances of the cells from the threshold, after moving the level of each cell away from the
/// mean of its neighbours. The threshold is at a `share` of the way from the border to its surroundings.
void TagReader::sharpen(const ReadableFamily& family, const Levels& levels, float amount, float share) {
  const int side = side_of(family);
  const float middle = 0.5F * static_cast<float>(side - 1);
  Plane mean{};
  for (std::size_t i = 0; i < 3; ++i) mean[i] = (1 - share) * levels.border[i] + share * levels.around[i];
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

/// Whether all bits to be corrected were nearly undecided. `margin` receives the mean distance of the known
/// bits from the threshold, with wrong bits counted as negative.
bool TagReader::all_nearly_undecided(const ReadableFamily& family, std::size_t turn, std::uint64_t wrong_bits,
                                     std::uint64_t known_bits, float& margin) const {
  constexpr float kUndecided = 0.8F;  // relative to the mean distance of the correct bits
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

/// In the signed levels, the border is always low. A bit of value 1 is printed in the opposite colour to a
/// dark border, or in the same colour as a bright one; this also holds for inverted tags.
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
    if (!all_nearly_undecided(family, turn, wrong, ~std::uint64_t{0}, margin) ||
        !(margin >= static_cast<float>(options_.min_margin)))
      continue;
    best = turned(quad, turn, {family.id, near->number}, near->distance, margin);
  }
  return best;
}

std::optional<TagDetection> TagReader::decode_known(const Quad& quad, const ReadableFamily& family,
                                                    const Levels& levels) {
  constexpr std::array<float, 2> kSharpening = {0.25F, 0.8F};
  constexpr int kMaxWrong = 4;
  constexpr float kTurns = 4;
  // By the bound of evidence_bits(), random bits pass in at most one of 2^14 quads with a border, for any
  // number of hypotheses. The actual rate is lower: if all levels are certain, two wrong bits can be accepted
  // out of 36 for 44 known tags, and 1.7 in a million quads pass. For comparison, with one corrected bit, 1.3
  // in a million pass as some tag of tag36h11.
  constexpr float kMinEvidenceBits = 14;
  if (family.known.empty()) return std::nullopt;
  const auto hypotheses = static_cast<float>(family.known.size() * kSharpening.size()) * kTurns;
  float most = kMinEvidenceBits + std::log2(hypotheses);
  std::optional<TagDetection> best;
  for (const float amount : kSharpening) {
    sharpen(family, levels, amount);
    for (std::size_t turn = 0; turn < family.cells.size(); ++turn) {
      const std::uint64_t code = code_of(family, turn);
      for (const int number : family.known) {
        const std::uint64_t wrong = code ^ waymark::family(family.id).codes[static_cast<std::size_t>(number)];
        if (std::popcount(wrong) > kMaxWrong) continue;
        const float evidence = evidence_bits(distances_, family.cells[turn], wrong);
        float margin = 0;
        (void)all_nearly_undecided(family, turn, wrong, ~std::uint64_t{0}, margin);
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
      level = edge->level_if_lit(level, x, y);
    }
  }
  sharpen(family, {{edge->border[1], 0, 0}, {edge->around[1], 0, 0}}, kSharpening);
  return decode(quad, family);
}

std::optional<TagDetection> TagReader::decode_beside(const Quad& quad, const ReadableFamily& family,
                                                     std::size_t covered) {
  constexpr int kMinDistance = 5;  // between any two codes, over the remaining bits
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
    if (waymark::family(family.id).min_hamming - left_out < kMinDistance) return std::nullopt;
    const std::optional<int> number = family.codes.find_exact(code_of(family, turn), known);
    float margin = 0;
    if (!number || !all_nearly_undecided(family, turn, 0, known, margin) ||
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
