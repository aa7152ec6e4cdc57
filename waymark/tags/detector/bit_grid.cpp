#include "waymark/tags/detector/bit_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Cholesky>

#include "waymark/families/family.hpp"
#include "waymark/tags/detector/tag_reader.hpp"
#include "waymark/tags/refinement/bent_sheet.hpp"

namespace waymark::search {
namespace {

constexpr int kPerCell = 4;  // profile samples per cell
constexpr std::uint8_t kUnknownCell = 2;

float sign_of(const ReadableFamily& family, bool inverted) {
  return family.bright_border != inverted ? -1.0F : 1.0F;
}

/// The amount of change inside the quad along one axis, at k / kPerCell cells.
void changes_across(const CellView& view, int width, int axis, std::vector<float>& profile) {
  const int count = width * kPerCell;
  profile.assign(static_cast<std::size_t>(count), 0.0F);
  const Eigen::Vector3f step = view.step(axis) / static_cast<float>(kPerCell);
  for (int line = 1; line + 1 < width; ++line) {
    const float along = static_cast<float>(line) + 0.5F;
    constexpr float kBegin = -0.5F / kPerCell;
    Eigen::Vector3f place = axis == 0 ? view.place(kBegin, along) : view.place(along, kBegin);
    float before = view.level(place);
    for (int k = 0; k < count; ++k) {
      place += step;
      const float here = view.level(place);
      profile[static_cast<std::size_t>(k)] += std::abs(here - before);
      before = here;
    }
  }
}

float between(const std::vector<float>& profile, float cells) {
  const float at = std::clamp(cells * kPerCell, 0.0F, static_cast<float>(profile.size() - 1) - 0.001F);
  const auto low = static_cast<std::size_t>(at);
  const float share = at - static_cast<float>(low);
  return profile[low] + share * (profile[low + 1] - profile[low]);
}

/// Change at the cell boundaries minus change at the cell centres, assuming that the side at 0 is `missing`
/// cells off.
float fit_of(const std::vector<float>& profile, int width, float missing, bool from_the_far_side) {
  const auto w = static_cast<float>(width);
  const float scale = w / (w - missing);
  float sum = 0;
  for (int k = 2; k < width; ++k) {
    const auto place = [&](float cell) {
      const float seen = (cell - missing) * scale;
      return from_the_far_side ? w - seen : seen;
    };
    sum += between(profile, place(static_cast<float>(k))) -
           between(profile, place(static_cast<float>(k) - 0.5F));
  }
  return sum;
}

/// The quad with one side made parallel to the opposite one, at the same mean distance.
Quad with_side_parallel(const Quad& quad, std::size_t side) {
  const std::size_t next = (side + 1) % 4;
  const Eigen::Vector2f& from = quad[(side + 3) % 4];
  const Eigen::Vector2f& to = quad[(side + 2) % 4];
  const float a = cross_at(from, to, quad[side]);
  const float b = cross_at(from, to, quad[next]);
  if (a == 0 || b == 0) return quad;
  Quad out = quad;
  out[side] = from + 0.5F * (a + b) / a * (quad[side] - from);
  out[next] = to + 0.5F * (a + b) / b * (quad[next] - to);
  return out;
}

}  // namespace

Quad with_side_moved(const Quad& quad, std::size_t side, float by_cells, int width) {
  Eigen::Matrix3f px_H_cell;
  if (!homography(quad, width, px_H_cell)) return quad;
  const auto w = static_cast<float>(width);
  const float by = by_cells * w / (w - by_cells);  // in cells of the uncorrected quad
  Quad out = quad;
  const std::array<Eigen::Vector2f, 4> corner = {Eigen::Vector2f(0, 0), Eigen::Vector2f(w, 0),
                                                 Eigen::Vector2f(w, w), Eigen::Vector2f(0, w)};
  const std::array<Eigen::Vector2f, 4> outwards = {Eigen::Vector2f(0, -by), Eigen::Vector2f(by, 0),
                                                   Eigen::Vector2f(0, by), Eigen::Vector2f(-by, 0)};
  for (const std::size_t i : {side, (side + 1) % 4}) {
    const Eigen::Vector2f cell = corner.at(i) + outwards.at(side);
    const Eigen::Vector3f p = px_H_cell * Eigen::Vector3f(cell.x(), cell.y(), 1);
    out[i] = p.head<2>() / p.z();
  }
  return out;
}

MisplacedSides BitGrid::misplaced_sides(const ImageView& image, const Quad& quad,
                                        const ReadableFamily& family, bool inverted) {
  constexpr float kMinMissing = -0.6F;
  constexpr float kMaxMissing = 2.0F;
  constexpr float kStep = 0.1F;
  constexpr float kMaxInPlaceOffset = 0.15F;
  constexpr float kMinImprovement = 1.15F;
  MisplacedSides found;
  Eigen::Matrix3f px_H_cell;
  std::array<float, 2> as_it_is{};
  if (!homography(quad, family.width, px_H_cell)) return found;
  for (int axis = 0; axis < 2; ++axis) {
    changes_across(CellView(image, px_H_cell, sign_of(family, inverted)), family.width, axis, profile_);
    as_it_is.at(static_cast<std::size_t>(axis)) = fit_of(profile_, family.width, 0, false);
  }
  const float least = (kMinImprovement - 1) * (as_it_is[0] + as_it_is[1]);
  for (std::size_t side = 0; side < 4; ++side) {
    MisplacedSide best{with_side_parallel(quad, side), side, 0, 0};
    if (!homography(best.quad, family.width, px_H_cell)) continue;
    const std::size_t axis = 1 - side % 2;
    changes_across(CellView(image, px_H_cell, sign_of(family, inverted)), family.width,
                   static_cast<int>(axis), profile_);
    const bool far = side == 1 || side == 2;
    for (float missing = kMinMissing; missing < kMaxMissing; missing += kStep) {
      const float fit = fit_of(profile_, family.width, missing, far) - as_it_is.at(axis);
      if (fit > best.fit) best = {best.quad, side, missing, fit};
    }
    const bool moved = best.quad[side] != quad[side] || std::abs(best.missing) >= kMaxInPlaceOffset;
    if (moved && best.fit >= least) found.sides.at(found.count++) = best;
  }
  const auto end = found.sides.begin() + static_cast<std::ptrdiff_t>(found.count);
  std::sort(found.sides.begin(), end,
            [](const MisplacedSide& a, const MisplacedSide& b) { return a.fit > b.fit; });
  return found;
}

void BitGrid::color(const ReadableFamily& family, int number) {
  const int side = side_of(family);
  const int w = family.width;
  // The print determines only the border, the ring around it and the bits. The hole of tagCustom48h12 may be
  // white, black or contain another tag, so the steps next to it are not used.
  high_.assign(at(side * side), kUnknownCell);
  for (int y = -1; y <= w; ++y) {
    for (int x = -1; x <= w; ++x) {
      const bool ring = x < 0 || y < 0 || x >= w || y >= w;
      const bool border = !ring && (x == 0 || y == 0 || x == w - 1 || y == w - 1);
      if (ring || border) high_[at((y + family.margin) * side + x + family.margin)] = ring ? 1 : 0;
    }
  }
  const std::uint64_t code = waymark::family(family.id).codes[static_cast<std::size_t>(number)];
  const std::vector<std::uint16_t>& cells = family.cells[0];
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const bool one = ((code >> (cells.size() - 1 - k)) & 1U) != 0;
    high_[cells[k]] = one != family.bright_border ? 1 : 0;
  }
}

void BitGrid::measure(const ImageView& image, const Quad& quad, const ReadableFamily& family, float sign) {
  constexpr int kSamples = 8;
  constexpr float kReach = 0.44F;  // cells to either side
  constexpr float kApart = 2 * kReach / (kSamples - 1);
  constexpr float kLeastWeight = 9;
  steps_.clear();
  Eigen::Matrix3f px_H_cell;
  if (!homography(quad, family.width, px_H_cell)) return;
  const CellView view(image, px_H_cell, sign);
  const int side = side_of(family);
  const int w = family.width;
  const auto high = [&](int x, int y) { return high_[at((y + family.margin) * side + x + family.margin)]; };
  const auto differ = [](std::uint8_t a, std::uint8_t b) {
    return a != b && a != kUnknownCell && b != kUnknownCell;
  };
  const auto add = [&](int axis, int x, int y, bool rises) {
    const float edge = static_cast<float>(axis == 0 ? x : y);
    const float along = static_cast<float>(axis == 0 ? y : x) + 0.5F;
    const Eigen::Vector3f step = view.step(axis) * kApart;
    Eigen::Vector3f place = axis == 0 ? view.place(edge - kReach, along) : view.place(along, edge - kReach);
    float before = view.level(place);
    float weight = 0;
    float moment = 0;
    for (int k = 1; k < kSamples; ++k) {
      place += step;
      const float here = view.level(place);
      const float rise = std::max(0.0F, rises ? here - before : before - here);
      before = here;
      weight += rise * rise;
      moment += rise * rise * (static_cast<float>(k) - 0.5F);
    }
    if (weight < kLeastWeight) return;
    const bool outer = axis == 0 ? x == 0 || x == w : y == 0 || y == w;
    steps_.push_back({axis == 0 ? edge : along, axis == 0 ? along : edge, axis,
                      moment / weight * kApart - kReach, std::sqrt(weight), outer, rises});
  };
  for (int k = 0; k < w; ++k) {
    for (int edge = 0; edge <= w; ++edge) {
      if (differ(high(edge - 1, k), high(edge, k))) add(0, edge, k, high(edge, k) != 0);
      if (differ(high(k, edge - 1), high(k, edge))) add(1, k, edge, high(k, edge) != 0);
    }
  }
}

namespace {

using Vector8 = Eigen::Matrix<float, 8, 1>;

/// Derivatives of a displacement along an axis with respect to a small homography.
Vector8 displacement(int axis, float u, float v) {
  Vector8 r = Vector8::Zero();
  if (axis == 0) {
    r << 1, u, v, 0, 0, 0, u * u, u * v;
  } else {
    r << 0, 0, 0, 1, u, v, u * v, v * v;
  }
  return r;
}

/// Moves the corners of a quad by a small homography. Returns false if the result is not finite.
bool move_corners(int width, const Vector8& x, Quad& quad) {
  if (!x.allFinite()) return false;
  Eigen::Matrix3f px_H_cell;
  if (!homography(quad, width, px_H_cell)) return false;
  const float half = 0.5F * static_cast<float>(width);
  const std::array<Eigen::Vector2f, 4> corner = {Eigen::Vector2f(-1, -1), Eigen::Vector2f(1, -1),
                                                 Eigen::Vector2f(1, 1), Eigen::Vector2f(-1, 1)};
  for (std::size_t i = 0; i < 4; ++i) {
    const float u = corner.at(i).x();
    const float v = corner.at(i).y();
    const Eigen::Vector3f p = px_H_cell * Eigen::Vector3f(half * (1 + u) + displacement(0, u, v).dot(x),
                                                          half * (1 + v) + displacement(1, u, v).dot(x), 1);
    quad[i] = p.head<2>() / p.z();
    if (!quad[i].allFinite()) return false;
  }
  return true;
}

}  // namespace

/// One Gauss-Newton step for a small homography, with Tukey weights.
bool BitGrid::correct(const ReadableFamily& family, bool with_border, Quad& quad) const {
  constexpr float kBeyond = 0.3F;  // in cells; steps farther away have no weight
  Eigen::Matrix<float, 8, 8> normal = Eigen::Matrix<float, 8, 8>::Identity() * 1e-3F;
  Vector8 right = Vector8::Zero();
  const float half = 0.5F * static_cast<float>(family.width);
  for (const Step& step : steps_) {
    if (step.outer && !with_border) continue;
    const float far = step.outer ? step.offset / kBeyond : 0;
    if (std::abs(far) >= 1) continue;
    const float weight = step.weight * (1 - far * far) * (1 - far * far);
    const Vector8 r = displacement(step.axis, step.u / half - 1, step.v / half - 1);
    normal += weight * r * r.transpose();
    right += weight * step.offset * r;
  }
  return move_corners(family.width, normal.ldlt().solve(right), quad);
}

/// One step for a small homography and the spread of white [cell], which moves the steps where white begins
/// and those where it ends in opposite directions. `spread` receives the latter.
bool BitGrid::correct_with_spread(const ReadableFamily& family, float& spread, Quad& quad) const {
  using Vector9 = Eigen::Matrix<float, 9, 1>;
  Eigen::Matrix<float, 9, 9> normal = Eigen::Matrix<float, 9, 9>::Identity() * 1e-3F;
  Vector9 right = Vector9::Zero();
  const float half = 0.5F * static_cast<float>(family.width);
  for (const Step& step : steps_) {
    Vector9 r;
    r << displacement(step.axis, step.u / half - 1, step.v / half - 1), step.rises ? -1.0F : 1.0F;
    normal += step.weight * r * r.transpose();
    right += step.weight * step.offset * r;
  }
  const Vector9 x = normal.ldlt().solve(right);
  spread = x[8];
  return move_corners(family.width, x.head<8>(), quad);
}

bool BitGrid::align_overexposed(const ImageView& image, const ReadableFamily& family, bool inverted,
                                TagDetection& tag) {
  constexpr int kRounds = 4;
  constexpr float kMinSpreadPx = 0.5F;
  constexpr float kMaxSpreadCells = 0.45F;  // the steps are searched for within 0.44 cells
  constexpr float kSharp = 0.2F;            // as for other tags
  constexpr float kMinShareInPlace = 0.7F;
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = tag.corners_px[i].cast<float>();
  const float sign = sign_of(family, inverted);
  color(family, tag.tag.number);
  float spread = 0;
  for (int round = 0; round < kRounds; ++round) {
    measure(image, quad, family, sign);
    if (!correct_with_spread(family, spread, quad) || !(area(quad) > 0)) return false;
  }
  const float cell_px = std::sqrt(area(quad)) / static_cast<float>(family.width);
  if (spread * cell_px < kMinSpreadPx || spread > kMaxSpreadCells) return false;
  measure(image, quad, family, sign);
  float near = 0;
  float all = 0;
  for (const Step& step : steps_) {
    all += step.weight;
    near += std::abs(step.offset + (step.rises ? spread : -spread)) < kSharp ? step.weight : 0;
  }
  if (near < kMinShareInPlace * all) return false;
  for (std::size_t i = 0; i < 4; ++i) tag.corners_px[i] = quad[i].cast<double>();
  return true;
}

namespace {

/// Moves the corners to the intersections of the border's sides if these are curved and the bits agree with
/// the curves. The corners of a bent tag must not be extrapolated from its bits.
bool follow_curves(const ImageView& image, bool inverted, TagDetection& tag) {
  constexpr double kLeastBulgePx = 0.3;  // a plane places less curved tags well enough
  const auto bend = refinement::find_bend(image, {tag.tag, inverted}, tag.corners_px, kLeastBulgePx);
  if (!bend || !bend->confirmed) return false;
  tag.corners_px = bend->border.corners_px;
  return true;
}

}  // namespace

bool BitGrid::align_corners(const ImageView& image, const ReadableFamily& family, bool inverted,
                            TagDetection& tag) {
  constexpr float kMaxShiftCells = 0.3F;    // maximum shift of a corner [cell]
  constexpr float kMaxShiftPx = 0.75F;      // or in pixels
  constexpr float kMayBeCurved = 0.4F;      // share of that shift above which the sides may be curved
  constexpr float kSharp = 0.2F;            // in cells; a step nearer than this counts as in place
  constexpr float kMinShareInPlace = 0.7F;  // minimum share of the weight of all steps
  Quad quad;
  for (std::size_t i = 0; i < 4; ++i) quad[i] = tag.corners_px[i].cast<float>();
  const float sign = sign_of(family, inverted);
  color(family, tag.tag.number);
  const float cell_px = std::sqrt(std::abs(area(quad))) / static_cast<float>(family.width);
  measure(image, quad, family, sign);
  Quad moved = quad;
  if (!correct(family, false, moved)) return false;
  float farthest = 0;
  for (std::size_t i = 0; i < 4; ++i) farthest = std::max(farthest, (moved[i] - quad[i]).norm());
  const float allowed = std::max(kMaxShiftPx, kMaxShiftCells * cell_px);
  if (farthest >= kMayBeCurved * allowed && follow_curves(image, inverted, tag)) return true;
  if (farthest < allowed) return true;
  for (const bool with_border : {false, false, true, true}) {
    measure(image, moved, family, sign);
    if (!correct(family, with_border, moved) || !(area(moved) > 0)) return false;
  }
  measure(image, moved, family, sign);
  float near = 0;
  float all = 0;
  for (const Step& step : steps_) {
    if (step.outer) continue;
    all += step.weight;
    near += std::abs(step.offset) < kSharp ? step.weight : 0;
  }
  if (near < kMinShareInPlace * all) return false;
  for (std::size_t i = 0; i < 4; ++i) tag.corners_px[i] = moved[i].cast<double>();
  follow_curves(image, inverted, tag);  // the plane is near enough to the border of a bent tag
  return true;
}

}  // namespace waymark::search
