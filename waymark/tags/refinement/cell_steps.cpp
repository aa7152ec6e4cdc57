#include "waymark/tags/refinement/cell_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "waymark/tags/refinement/cell_colors.hpp"

namespace waymark::refinement {
namespace {

using Eigen::Vector2d;
constexpr int kUnknowns = 12;  ///< eight of a homography, four that bend the tag
constexpr int kFlat = 8;       ///< those of a homography come first
constexpr int kPerAxis = 7;    ///< the displacement along an axis depends on these
constexpr int kFlatPerAxis = 5;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Information = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Row = Eigen::Matrix<double, kPerAxis, 1>;

/// The parameters on which the displacement along each axis depends.
constexpr std::array<std::array<int, kPerAxis>, 2> kAxisParameters = {
    {{0, 1, 2, 6, 7, 8, 9}, {3, 4, 5, 6, 7, 10, 11}}};

/// Displacement along an axis of the point (u, v), -1 to 1 inside the border, with respect to
/// kAxisParameters: to first order that of a homography, then bow and squeeze of the tag.
Row displacement(double u, double v, int axis) {
  Row row;
  if (axis == 0) {
    row << 1, u, v, u * u, u * v, v * v, u * v * v;
  } else {
    row << 1, u, v, u * v, v * v, u * u, u * u * v;
  }
  return row;
}

/// The same for both axes and all parameters.
Eigen::Matrix<double, 2, kUnknowns> displacement(double u, double v) {
  Eigen::Matrix<double, 2, kUnknowns> rows = Eigen::Matrix<double, 2, kUnknowns>::Zero();
  for (int axis = 0; axis < 2; ++axis) {
    const Row row = displacement(u, v, axis);
    for (int i = 0; i < kPerAxis; ++i)
      rows(axis, kAxisParameters[static_cast<std::size_t>(axis)][static_cast<std::size_t>(i)]) = row[i];
  }
  return rows;
}

/// A step between two cells.
struct Step {
  Row row = Row::Zero();  ///< derivatives of its offset with respect to the parameters of its axis
  int axis = 0;
  double offset = 0;  ///< [cell] from its expected position, along its normal
  bool visible = false;
};

constexpr int kMaxSteps = 2 * kMaxCells * (kMaxCells + 1);

struct Steps {
  std::array<Step, kMaxSteps> all{};
  std::size_t count = 0;
};

class StepReader {
 public:
  StepReader(const ImageView& image, const Quad& corners_px, int width)
      : image_(image), px_H_unit_(homography_of_unit_square(corners_px)), width_(width) {}

  /// The step at (x, y) [cells] whose normal is along `axis` (0: x). `change` is its sign along that axis.
  [[nodiscard]] Step read(double x, double y, int axis, int change) const {
    constexpr int kSamples = 13;
    constexpr double kReach = 0.45;   // cells
    constexpr double kLeastRise = 6;  // grey levels; less could be noise
    const Vector2d along = axis == 0 ? Vector2d(1, 0) : Vector2d(0, 1);
    const Vector2d middle(x, y);
    const Vector2d from = place(middle - kReach * along);
    const Vector2d to = place(middle + kReach * along);
    Step step;
    step.axis = axis;
    step.row = displacement(2 * x / width_ - 1, 2 * y / width_ - 1, axis);
    if (!inside(from) || !inside(to)) return step;
    double before = 0;
    double weight = 0;
    double moment = 0;
    double rise_of_all = 0;
    for (int k = 0; k < kSamples; ++k) {
      const double at = -kReach + 2 * kReach * k / (kSamples - 1);
      const Vector2d px = place(middle + at * along);
      const double here = change * sample_bilinear(image_, px.x(), px.y());
      if (k > 0) {
        const double rise = std::max(0.0, here - before);
        weight += rise * rise;
        moment += rise * rise * (at - kReach / (kSamples - 1));
        rise_of_all += here - before;
      }
      before = here;
    }
    step.visible = rise_of_all > kLeastRise && weight > 0;
    if (step.visible) step.offset = moment / weight;
    return step;
  }

  [[nodiscard]] Vector2d place(const Vector2d& cell) const {
    const Vector2d unit = cell / width_;
    return (px_H_unit_ * unit.homogeneous()).hnormalized();
  }

  /// Derivatives of place().
  [[nodiscard]] Eigen::Matrix2d px_J_cell(const Vector2d& cell) const {
    const Eigen::Vector3d p = px_H_unit_ * (cell / width_).homogeneous();
    const Eigen::Matrix<double, 3, 2> J = px_H_unit_.leftCols<2>() / width_;
    return (J.topRows<2>() - p.hnormalized() * J.row(2)) / p.z();
  }

 private:
  [[nodiscard]] bool inside(const Vector2d& px) const {
    return px.x() >= 0 && px.y() >= 0 && px.x() <= image_.width && px.y() <= image_.height;
  }

  const ImageView& image_;
  Eigen::Matrix3d px_H_unit_;
  double width_;
};

void read_steps(const StepReader& reader, const CellColors& colors, Steps& steps) {
  const int w = colors.width();
  const auto add = [&](double x, double y, int axis, int change) {
    if (change != 0 && steps.count < steps.all.size())
      steps.all[steps.count++] = reader.read(x, y, axis, change);
  };
  for (int k = 0; k < w; ++k) {
    for (int edge = 0; edge <= w; ++edge) {
      add(edge, k + 0.5, 0, colors.change(edge - 1, k, edge, k));
      add(k + 0.5, edge, 1, colors.change(k, edge - 1, k, edge));
    }
  }
}

/// Tukey's weight of a residual.
double tukey(double residual, double scale) {
  const double far = residual / scale;
  return std::abs(far) < 1 ? (1 - far * far) * (1 - far * far) : 0;
}

/// A robust fit of the displacement to the steps, in cells.
struct StepFit {
  Unknowns x = Unknowns::Zero();
  Information information = Information::Identity();
  double near = 0;     ///< sum of the weights
  double squares = 0;  ///< weighted sum of squared residuals
  int unknowns = kFlat;
};

/// Normal equations of the parameters of one axis.
struct AxisSums {
  Eigen::Matrix<double, kPerAxis, kPerAxis> information = Eigen::Matrix<double, kPerAxis, kPerAxis>::Zero();
  Row right = Row::Zero();
};

Row of_axis(const Unknowns& x, std::size_t axis) {
  Row own;
  for (int i = 0; i < kPerAxis; ++i) own[i] = x[kAxisParameters[axis][static_cast<std::size_t>(i)]];
  return own;
}

template <int kUsed>
void add_step(const Step& step, double weight, AxisSums& sums) {
  const auto row = step.row.head<kUsed>();
  const Eigen::Matrix<double, kUsed, 1> weighted = weight * row;
  sums.information.topLeftCorner<kUsed, kUsed>() += weighted * row.transpose();
  sums.right.head<kUsed>() += step.offset * weighted;
}

void solve(const std::array<AxisSums, 2>& sums, StepFit& fit) {
  constexpr double kPrior = 1e-3;
  constexpr double kBendPrior = 0.05;
  fit.information.setZero();
  Unknowns right = Unknowns::Zero();
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (int i = 0; i < kPerAxis; ++i) {
      const int row = kAxisParameters[axis][static_cast<std::size_t>(i)];
      right[row] += sums[axis].right[i];
      for (int j = 0; j < kPerAxis; ++j)
        fit.information(row, kAxisParameters[axis][static_cast<std::size_t>(j)]) +=
            sums[axis].information(i, j);
    }
  }
  fit.information.diagonal().array() += kPrior;
  fit.x.setZero();
  if (fit.unknowns == kFlat) {
    fit.x.head<kFlat>() = fit.information.topLeftCorner<kFlat, kFlat>().ldlt().solve(right.head<kFlat>());
  } else {
    fit.information.diagonal().tail<kUnknowns - kFlat>().array() += kBendPrior;
    fit.x = fit.information.ldlt().solve(right);
  }
}

/// `unknowns` is kFlat or kUnknowns.
StepFit reweighted(const Steps& steps, const StepFit& before, double scale, int unknowns = kFlat) {
  StepFit fit;
  fit.unknowns = unknowns;
  const std::array<Row, 2> x = {of_axis(before.x, 0), of_axis(before.x, 1)};
  std::array<AxisSums, 2> sums;
  for (std::size_t i = 0; i < steps.count; ++i) {
    const Step& step = steps.all[i];
    if (!step.visible) continue;
    const auto axis = static_cast<std::size_t>(step.axis);
    const double residual = step.offset - step.row.dot(x[axis]);
    const double weight = tukey(residual, scale);
    if (weight <= 0) continue;
    if (unknowns == kFlat) {
      add_step<kFlatPerAxis>(step, weight, sums[axis]);
    } else {
      add_step<kPerAxis>(step, weight, sums[axis]);
    }
    fit.near += weight;
    fit.squares += weight * residual * residual;
  }
  solve(sums, fit);
  return fit;
}

constexpr double kWide = 0.6;  // cells
constexpr double kNarrow = 0.25;

/// The given corners are right unless clearly more steps agree on others. Covers and shadows have edges that
/// some steps are mistaken for.
StepFit best_flat_fit(const Steps& steps) {
  constexpr int kPasses = 4;
  constexpr double kClearlyMore = 0.05;  // of the steps
  StepFit here;
  StepFit anywhere;
  for (int pass = 0; pass < kPasses; ++pass) anywhere = reweighted(steps, anywhere, kWide);
  for (int pass = 0; pass < kPasses; ++pass) {
    here = reweighted(steps, here, kNarrow);
    anywhere = reweighted(steps, anywhere, kNarrow);
  }
  return anywhere.near > here.near + kClearlyMore * static_cast<double>(steps.count) ? anywhere : here;
}

/// Mean of the squared distances [cell^2] of the visible steps, limited to kNarrow.
double mean_loss(const Steps& steps, const StepFit& fit) {
  const std::array<Row, 2> x = {of_axis(fit.x, 0), of_axis(fit.x, 1)};
  double sum = 0;
  double visible = 0;
  for (std::size_t i = 0; i < steps.count; ++i) {
    const Step& step = steps.all[i];
    if (!step.visible) continue;
    const double residual = step.offset - step.row.dot(x[static_cast<std::size_t>(step.axis)]);
    sum += std::min(residual * residual, kNarrow * kNarrow);
    visible += 1;
  }
  return sum / std::max(1.0, visible);
}

enum class Bending : std::uint8_t { Possible, Known };

/// A bent tag if that explains the steps clearly better than a flat one.
StepFit best_fit(const Steps& steps, Bending bending) {
  constexpr std::array<double, 7> kScales = {1.2, kWide, kWide, kWide, kNarrow, kNarrow, kNarrow};
  constexpr double kFlatLoss = 6e-4;  // cells^2
  constexpr double kClearlyLess = 0.3;
  const StepFit flat = best_flat_fit(steps);
  const double loss = mean_loss(steps, flat);
  if (bending == Bending::Possible && loss < kFlatLoss) return flat;
  StepFit bent;
  for (const double scale : kScales) bent = reweighted(steps, bent, scale, kUnknowns);
  return bending == Bending::Known || mean_loss(steps, bent) < kClearlyLess * loss ? bent : flat;
}

StepPlacement place_once(const ImageView& image, const PrintedTag& print, const Quad& corners_px,
                         Bending bending) {
  const CellColors colors(print);
  const StepReader reader(image, corners_px, colors.width());
  Steps steps;
  read_steps(reader, colors, steps);
  const StepFit fit = best_fit(steps, bending);
  const double w = colors.width();
  const std::array<Vector2d, 4> unit = {Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}};
  StepPlacement result;
  double worst = 0;
  Information inverse = Information::Zero();
  if (fit.unknowns == kFlat) {
    inverse.topLeftCorner<kFlat, kFlat>() = fit.information.topLeftCorner<kFlat, kFlat>().inverse();
  } else {
    inverse = fit.information.inverse();
  }
  Eigen::Matrix<double, 8, kUnknowns> M;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Matrix<double, 2, kUnknowns> rows = displacement(unit[k].x(), unit[k].y());
    const Vector2d cells = (0.5 * w) * (unit[k] + Vector2d(1, 1));
    result.shift_px[k] = reader.place(cells + rows * fit.x) - corners_px[k];
    worst = std::max(worst, (rows * inverse * rows.transpose()).diagonal().maxCoeff());
    M.middleRows<2>(2 * static_cast<Eigen::Index>(k)) = reader.px_J_cell(cells) * rows;
  }
  const double variance = fit.squares / std::max(1.0, fit.near - fit.unknowns);
  const double sigma_cells = std::sqrt(variance * worst);
  result.covariance_px2 = variance * M * inverse * M.transpose();
  result.cell_px = mean_side_px(corners_px) / w;
  result.sigma_px = sigma_cells * result.cell_px;
  result.share = fit.near / std::max<double>(1, static_cast<double>(steps.count));
  result.bent = fit.unknowns > kFlat;
  return result;
}

}  // namespace

StepPlacement place_by_steps(const ImageView& image, const PrintedTag& print, const Quad& corners_px) {
  const StepPlacement first = place_once(image, print, corners_px, Bending::Possible);
  if (!first.bent) return first;
  // The sides of a bent tag are far from straight lines, so many of its steps were out of reach.
  Quad moved = corners_px;
  for (std::size_t k = 0; k < 4; ++k) moved[k] += first.shift_px[k];
  if (!is_convex(moved)) return first;
  StepPlacement result = place_once(image, print, moved, Bending::Known);
  for (std::size_t k = 0; k < 4; ++k) result.shift_px[k] += first.shift_px[k];
  return result;
}

bool enough_steps(const StepPlacement& steps) {
  constexpr double kLeastShare = 0.4;
  return steps.share >= kLeastShare;
}

bool agree(const StepPlacement& steps) {
  constexpr double kSigmaPx = 0.2;  // of small or noisy tags
  constexpr double kSigmaCells = 0.03;
  return steps.sigma_px < std::max(kSigmaPx, kSigmaCells * steps.cell_px);
}

bool contradicts(const StepPlacement& steps, const CornerCovariance& covariance_px2) {
  constexpr double kSigmas = 3;
  if (!enough_steps(steps)) return true;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto at = 2 * static_cast<Eigen::Index>(k);
    const Eigen::Matrix2d covariance =
        covariance_px2.block<2, 2>(at, at) + steps.sigma_px * steps.sigma_px * Eigen::Matrix2d::Identity();
    const Vector2d& shift = steps.shift_px[k];
    if (!(shift.dot(covariance.llt().solve(shift)) < kSigmas * kSigmas)) return true;
  }
  return false;
}

}  // namespace waymark::refinement
