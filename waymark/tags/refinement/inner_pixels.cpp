#include "waymark/tags/refinement/inner_pixels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "waymark/families/family.hpp"
#include "waymark/tags/refinement/lens_bends.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;

constexpr double kRimCells = 0.6;  ///< pixels nearer to the border edges are left to the fit of the border

/// The share of white (0 or 1) in each cell inside the border square of a tag and in two rows around it; 0.5
/// if unknown.
class BitCells {
 public:
  static constexpr int kAround = 2;

  /// The id must exist in the family. O(cells).
  explicit BitCells(const PrintedTag& print) : cells_(family(print.id.family).width_at_border) {
    const TagId& id = print.id;
    const Family& table = family(id.family);
    const float border = print.bright_border() ? 1.0F : 0.0F;
    for (int y = -kAround; y < cells_ + kAround; ++y)
      for (int x = -kAround; x < cells_ + kAround; ++x) {
        const int inside = std::min({x, y, cells_ - 1 - x, cells_ - 1 - y});
        white(x, y) = inside < 0 ? 1.0F - border : inside == 0 ? border : 0.5F;
      }
    const std::uint64_t code = table.codes[static_cast<std::size_t>(id.number)];
    for (std::size_t bit = 0; bit < table.bits.size(); ++bit) {
      const auto [x, y] = table.bits[bit];
      if (x < 0 || y < 0 || x >= cells_ || y >= cells_) continue;
      const bool one = ((code >> (table.bits.size() - 1 - bit)) & 1U) != 0;
      white(x, y) = one != print.inverted ? 1.0F : 0.0F;
    }
    find_unknown();
  }

  /// Four cells of a row, from column x.
  [[nodiscard]] const float* row(int x, int y) const { return &white_[at(x, y)]; }
  /// Whether all 4 x 4 cells from (x, y) are known.
  [[nodiscard]] bool known(int x, int y) const {
    if (!some_unknown_) return true;
    for (int down = 0; down < 4; ++down)
      for (int right = 0; right < 4; ++right)
        if (white_[at(x + right, y + down)] == 0.5F) return false;
    return true;
  }

 private:
  static constexpr std::size_t kStride = kMaxCells + 2 * kAround;
  static std::size_t at(int x, int y) {
    return static_cast<std::size_t>(y + kAround) * kStride + static_cast<std::size_t>(x + kAround);
  }
  float& white(int x, int y) { return white_[at(x, y)]; }
  void find_unknown() {
    for (int y = 0; y < cells_; ++y)
      for (int x = 0; x < cells_; ++x) some_unknown_ = some_unknown_ || white(x, y) == 0.5F;
  }

  int cells_ = 0;
  bool some_unknown_ = false;
  std::array<float, kStride * kStride> white_{};
};

/// The lines between cells, as functions of the position relative to `middle_px` in float precision.
struct CellLines {
  Eigen::Matrix3f cell_H_middle;
  Vector2d middle_px;
};

CellLines lines_of(const TagBands& tag) {
  CellLines lines;
  lines.middle_px = 0.25 * (tag.edges[0].from + tag.edges[1].from + tag.edges[2].from + tag.edges[3].from);
  Eigen::Matrix3d to_px = Eigen::Matrix3d::Identity();
  to_px.topRightCorner<2, 1>() = lines.middle_px;
  lines.cell_H_middle = (tag.edges[0].cell_H_px * to_px).cast<float>();
  return lines;
}

/// Positions of pixels relative to the cells.
struct Places {
  std::array<Lanes, 2> cell;         ///< u and v
  std::array<Lanes, 2> px_per_cell;  ///< across the lines u = const and v = const
  Lanes skew;                        ///< cosine of the angle between the normals of these lines
};

Places locate(const CellLines& lines, const Lanes& x, const Lanes& y) {
  const Eigen::Matrix3f& H = lines.cell_H_middle;
  const Lanes w = H(2, 0) * x + H(2, 1) * y + H(2, 2);
  const Lanes inverse_w = w.inverse();
  Places places;
  std::array<std::array<Lanes, 2>, 2> normal;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    places.cell[axis] = (H(row, 0) * x + H(row, 1) * y + H(row, 2)) * inverse_w;
    const Lanes slope_x = H(row, 0) - places.cell[axis] * H(2, 0);
    const Lanes slope_y = H(row, 1) - places.cell[axis] * H(2, 1);
    const Lanes inverse_norm = (slope_x.square() + slope_y.square()).sqrt().inverse();
    places.px_per_cell[axis] = w.abs() * inverse_norm;
    normal[axis] = {slope_x * inverse_norm, slope_y * inverse_norm};
  }
  places.skew = normal[0][0] * normal[1][0] + normal[0][1] * normal[1][1];
  return places;
}

/// -1 to 1 along the cells.
Lanes along(const Lanes& cell, int cells) { return 2.0F / static_cast<float>(cells) * cell - 1.0F; }

/// Displacement of the print relative to the homography given by the corners. It is due to the lens or, if
/// the lens is unknown, to the radial distortion that the curvature of the edges suggests. The rest of their
/// curvature is added.
class Bends {
 public:
  Bends(const TagBands& tag, const TagEstimate& estimate) : tag_(tag) {
    for (std::size_t k = 0; k < 4; ++k) bend_px_[k] = estimate.edges[k][kBend];
    if (tag.lens || !any(bend_px_)) return;
    field_ = radial_field(tag.edges, bend_px_);
    for (std::size_t k = 0; k < 4; ++k) bend_px_[k] -= bulge_px(*field_, tag.edges[k]);
  }

  [[nodiscard]] bool matter() const {
    const auto is_large = [](const Vector2d& off) { return off.cwiseAbs().maxCoeff() > kNegligiblePx; };
    return field_ || any(bend_px_) || (tag_.lens && std::ranges::any_of(tag_.lens->off_px, is_large));
  }

  /// Where pixels would be without the displacement. `x` and `y` are relative to the middle of the tag [px],
  /// `places` is where they are in the print.
  [[nodiscard]] std::array<Lanes, 2> removed(const Lanes& x, const Lanes& y, const Places& places,
                                             int cells) const {
    const Lanes s = along(places.cell[0], cells);
    const Lanes t = along(places.cell[1], cells);
    std::array<Lanes, 2> out = {x, y};
    const auto remove = [&](std::size_t k, const Lanes& weight) {
      for (const int i : {0, 1})
        out[static_cast<std::size_t>(i)] -=
            static_cast<float>(0.5 * bend_px_[k] * tag_.edges[k].normal[i]) * weight;
    };
    remove(0, (1 - t) * (1 - s * s));
    remove(2, (1 + t) * (1 - s * s));
    remove(1, (1 + s) * (1 - t * t));
    remove(3, (1 - s) * (1 - t * t));
    if (field_) {
      const auto sides = static_cast<float>(1 / field_->side_px);
      const auto off = field_->at(Lanes(sides * x), Lanes(sides * y));
      for (std::size_t i = 0; i < 2; ++i) out[i] -= off[i];
    }
    if (tag_.lens) remove_lens(s, t, out);
    return out;
  }

 private:
  static constexpr double kNegligiblePx = 0.02;

  static bool any(const std::array<double, 4>& bends) {
    return std::ranges::any_of(bends, [](double bend) { return std::abs(bend) > kNegligiblePx; });
  }

  void remove_lens(const Lanes& s, const Lanes& t, std::array<Lanes, 2>& out) const {
    for (Eigen::Index lane = 0; lane < kLanes; ++lane) {
      const Vector2d off = tag_.lens->at(static_cast<double>(s[lane]), static_cast<double>(t[lane]));
      out[0][lane] -= static_cast<float>(off.x());
      out[1][lane] -= static_cast<float>(off.y());
    }
  }

  const TagBands& tag_;
  std::optional<RadialField> field_{};
  std::array<double, 4> bend_px_{};  ///< outward bulge of each edge that neither lens nor field explains
};

double area_px2(const TagBands& tag) {
  double twice = 0;
  for (const EdgeFrame& edge : tag.edges) twice += edge.from.x() * edge.to.y() - edge.from.y() * edge.to.x();
  return 0.5 * twice;
}

/// Visits all pixels of the tag, or `most` of them distributed evenly over it (Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", 2018).
template <class Visit>
void each_pixel(const TagBands& tag, int cells, int most, const Visit& visit) {
  if (area_px2(tag) < 1.9 * most) {
    Vector2d low = tag.edges[0].from;
    Vector2d high = low;
    for (const EdgeFrame& edge : tag.edges) {
      low = low.cwiseMin(edge.from);
      high = high.cwiseMax(edge.from);
    }
    for (int y = static_cast<int>(low.y()); y < high.y(); ++y)
      for (int x = static_cast<int>(low.x()); x < high.x(); ++x) visit(x, y);
    return;
  }
  const Eigen::Matrix3d px_H_cell = tag.edges[0].cell_H_px.inverse();
  const double side = cells - 2 * kRimCells;
  const auto next = [](double& at, double step) {
    at += step;
    if (at >= 1) at -= 1;
    return at;
  };
  double right = 0;
  double down = 0;
  for (int i = 0; i < most; ++i) {
    const double u = kRimCells + side * next(right, 0.7548776662466927);
    const double v = kRimCells + side * next(down, 0.5698402909980532);
    const Vector2d px = (px_H_cell * Eigen::Vector3d(u, v, 1)).hnormalized();
    visit(static_cast<int>(std::floor(px.x())), static_cast<int>(std::floor(px.y())));
  }
}

/// The nearest integer of a positive number. std::lround() is a function call.
int nearest(float x) {
  const int below = static_cast<int>(x);
  return x - static_cast<float>(below) < 0.5F ? below : below + 1;
}

/// Collects pixels and writes them to blocks, kLanes at a time.
class InnerReader {
 public:
  InnerReader(const ImageView& image, const PrintedTag& print, const TagBands& tag,
              const TagEstimate& estimate, InnerPixels& pixels)
      : image_(image),
        estimate_(estimate),
        pixels_(pixels),
        pattern_(print),
        cells_(family(print.id.family).width_at_border),
        bends_(tag, estimate),
        is_bent_(bends_.matter()),
        lines_(lines_of(tag)) {
    pixels_.count = 0;
  }

  void add(int x, int y) {
    if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return;
    level_[waiting_] = static_cast<float>(image_.row(y)[x]);
    x_[static_cast<Eigen::Index>(waiting_)] = static_cast<float>(x + 0.5 - lines_.middle_px.x());
    y_[static_cast<Eigen::Index>(waiting_)] = static_cast<float>(y + 0.5 - lines_.middle_px.y());
    if (++waiting_ == kLanes) flush();
  }

  /// Writes the pixels that still wait, and fills the last block up.
  void finish() {
    flush();
    if (pixels_.count % kLanes == 0) return;  // the last block is full, or no pixel was read
    fill_up(pixels_.block[pixels_.blocks() - 1], pixels_.count % kLanes);
    complete(pixels_.block[pixels_.blocks() - 1]);
  }

 private:
  void flush() {
    for (std::size_t lane = waiting_; lane < kLanes; ++lane)
      x_[static_cast<Eigen::Index>(lane)] = y_[static_cast<Eigen::Index>(lane)] = 0;
    Places places = locate(lines_, x_, y_);
    std::array<bool, kLanes> is_inside{};
    for (std::size_t lane = 0; lane < waiting_; ++lane) is_inside[lane] = inside(places, lane);
    if (is_bent_) places = unbent(places);
    const Lanes illumination = 1.0F + static_cast<float>(estimate_.illumination_per_px.x()) * x_ +
                               static_cast<float>(estimate_.illumination_per_px.y()) * y_;
    for (std::size_t lane = 0; lane < waiting_; ++lane)
      if (is_inside[lane]) put(places, lane, level_[lane] / illumination[static_cast<Eigen::Index>(lane)]);
    waiting_ = 0;
  }

  [[nodiscard]] bool inside(const Places& places, std::size_t lane) const {
    const auto at = static_cast<Eigen::Index>(lane);
    const auto low = static_cast<float>(kRimCells);
    const float high = static_cast<float>(cells_) - low;
    return places.cell[0][at] > low && places.cell[0][at] < high && places.cell[1][at] > low &&
           places.cell[1][at] < high;
  }

  /// The places in the print without the curvature of its lines.
  [[nodiscard]] Places unbent(const Places& places) const {
    const std::array<Lanes, 2> at = bends_.removed(x_, y_, places, cells_);
    return locate(lines_, at[0], at[1]);
  }

  /// Puts a pixel into the next lane, unless a cell around it is unknown or all blocks are full.
  void put(const Places& places, std::size_t from, float value) {
    const auto at = static_cast<Eigen::Index>(from);
    const float u = places.cell[0][at];
    const float v = places.cell[1][at];
    // Curved lines may move a pixel out of the cells.
    if (!(u > 0) || !(v > 0) || !(u < static_cast<float>(cells_)) || !(v < static_cast<float>(cells_)))
      return;
    const std::array<int, 2> first = {nearest(u) - 1, nearest(v) - 1};
    if (!pattern_.known(first[0] - 1, first[1] - 1)) return;
    if (pixels_.count == InnerPixels::kMaxBlocks * kLanes) return;
    InnerBlock& block = pixels_.block[static_cast<std::size_t>(pixels_.count / kLanes)];
    const int lane = pixels_.count % kLanes;
    for (int row = 0; row < 4; ++row) {
      const float* white = pattern_.row(first[0] - 1, first[1] - 1 + row);
      for (int column = 0; column < 4; ++column) block.white[row][column][lane] = white[column];
    }
    // The position is that of the first line until all lanes are complete.
    block.place[0][0][lane] = static_cast<float>(first[0]);
    block.place[1][0][lane] = static_cast<float>(first[1]);
    block.s[lane] = u;
    block.t[lane] = v;
    block.px_per_cell[0][lane] = places.px_per_cell[0][at];
    block.px_per_cell[1][lane] = places.px_per_cell[1][at];
    block.skew[lane] = places.skew[at];
    block.value[lane] = value;
    block.weight[lane] = 1;
    ++pixels_.count;
    if (lane == kLanes - 1) complete(block);
  }

  /// Computes the distances of the lines from the positions of the pixels, and scales all positions.
  void complete(InnerBlock& block) const {
    for (int axis = 0; axis < 2; ++axis) {
      float* cell = axis == 0 ? block.s : block.t;
      const Lanes at = load<Lanes>(cell);
      const Lanes first = load<Lanes>(block.place[axis][0]);
      const Lanes px_per_cell = load<Lanes>(block.px_per_cell[axis]);
      for (int i = 0; i < 3; ++i) {
        const Lanes line = first + static_cast<float>(i);
        store<Lanes>((at - line) * px_per_cell, block.past_px[axis][i]);
        store<Lanes>(along(line, cells_), block.place[axis][i]);
      }
      store<Lanes>(along(at, cells_), cell);
    }
  }

  /// Lanes without a pixel have weight 0, but must be finite.
  static void fill_up(InnerBlock& block, int used) {
    const auto repeat = [used](float* lanes) { std::fill(lanes + used, lanes + kLanes, lanes[0]); };
    for (float* lanes : {block.value, block.s, block.t, block.skew, block.px_per_cell[0],
                         block.px_per_cell[1], block.place[0][0], block.place[1][0]})
      repeat(lanes);
    for (auto& row : block.white)
      for (auto& cell : row) repeat(cell);
    std::fill(block.weight + used, block.weight + kLanes, 0.0F);
  }

  const ImageView& image_;
  const TagEstimate& estimate_;
  InnerPixels& pixels_;
  BitCells pattern_;
  int cells_;
  Bends bends_;
  bool is_bent_;
  CellLines lines_;
  std::size_t waiting_ = 0;
  std::array<float, kLanes> level_{};
  Lanes x_ = Lanes::Zero();  ///< relative to the middle of the tag
  Lanes y_ = Lanes::Zero();
};

}  // namespace

void read_inner_pixels(const ImageView& image, const PrintedTag& print, const TagBands& tag,
                       const TagEstimate& estimate, int most, InnerPixels& pixels) {
  InnerReader reader(image, print, tag, estimate, pixels);
  each_pixel(tag, family(print.id.family).width_at_border, most, [&](int x, int y) { reader.add(x, y); });
  reader.finish();
}

}  // namespace waymark::refinement
