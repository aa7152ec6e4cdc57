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
using Vector8 = Eigen::Matrix<double, 8, 1>;
using Matrix8 = Eigen::Matrix<double, 8, 8>;

/// A step between two cells.
struct Step {
  Vector8 row;        ///< derivatives of its offset with respect to the parameters of displacement()
  double offset = 0;  ///< [cell] from its expected position, along its normal
  bool visible = false;
};

/// Displacement of the point (u, v), -1 to 1 inside the border, with respect to eight parameters: those of a
/// homography of the plane, to first order.
Eigen::Matrix<double, 2, 8> displacement(double u, double v) {
  Eigen::Matrix<double, 2, 8> rows;
  rows << 1, u, v, 0, 0, 0, u * u, u * v,  //
      0, 0, 0, 1, u, v, u * v, v * v;
  return rows;
}

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
    step.row = displacement(2 * x / width_ - 1, 2 * y / width_ - 1).row(axis).transpose();
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
  Vector8 x = Vector8::Zero();
  Matrix8 information = Matrix8::Identity();
  double near = 0;     ///< sum of the weights
  double squares = 0;  ///< weighted sum of squared residuals
};

StepFit reweighted(const Steps& steps, const StepFit& before, double scale) {
  StepFit fit;
  fit.information *= 1e-3;
  Vector8 right = Vector8::Zero();
  for (std::size_t i = 0; i < steps.count; ++i) {
    const Step& step = steps.all[i];
    if (!step.visible) continue;
    const double residual = step.offset - step.row.dot(before.x);
    const double weight = tukey(residual, scale);
    fit.information += weight * step.row * step.row.transpose();
    right += weight * step.offset * step.row;
    fit.near += weight;
    fit.squares += weight * residual * residual;
  }
  fit.x = fit.information.ldlt().solve(right);
  return fit;
}

/// The given corners are right unless clearly more steps agree on others. Covers and shadows have edges that
/// some steps are mistaken for.
StepFit best_fit(const Steps& steps) {
  constexpr int kPasses = 4;
  constexpr double kWide = 0.6;  // cells
  constexpr double kNarrow = 0.25;
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

}  // namespace

StepPlacement place_by_steps(const ImageView& image, const PrintedTag& print, const Quad& corners_px) {
  const CellColors colors(print);
  const StepReader reader(image, corners_px, colors.width());
  Steps steps;
  read_steps(reader, colors, steps);
  const StepFit fit = best_fit(steps);
  const double w = colors.width();
  const std::array<Vector2d, 4> unit = {Vector2d(-1, -1), {1, -1}, {1, 1}, {-1, 1}};
  StepPlacement result;
  double worst = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Matrix<double, 2, 8> rows = displacement(unit[k].x(), unit[k].y());
    const Vector2d cells = (0.5 * w) * (unit[k] + Vector2d(1, 1));
    result.shift_px[k] = reader.place(cells + rows * fit.x) - corners_px[k];
    worst = std::max(worst, (rows * fit.information.ldlt().solve(rows.transpose())).diagonal().maxCoeff());
  }
  constexpr int kUnknowns = 8;
  const double sigma_cells = std::sqrt(fit.squares / std::max(1.0, fit.near - kUnknowns) * worst);
  result.sigma_px = sigma_cells * mean_side_px(corners_px) / w;
  result.share = fit.near / std::max<double>(1, static_cast<double>(steps.count));
  return result;
}

bool contradicts(const StepPlacement& steps, const CornerCovariance& covariance_px2) {
  constexpr double kSigmas = 3;
  constexpr double kLeastShare = 0.4;
  if (!(steps.share >= kLeastShare)) return true;
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
