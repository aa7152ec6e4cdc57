#include "waymark/tags/pattern_fit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

namespace waymark::refinement {
namespace {

using Local = Eigen::Matrix<double, kPatchParameters, kPatchParameters>;
using LocalVector = Eigen::Matrix<double, 1, kPatchParameters>;

/// What all patches of a tag have in common at one estimate.
struct Frame {
  Eigen::Matrix3d x_H_tag, tag_H_x;
  double half_cells = 4;
  double blur_x = 0;  ///< blur in units of x
  Eigen::Matrix2d blur_x2;
  std::array<double, 9> cell_H_x_rows{};
  PatchPoint point{};
};

Frame frame_at(const Pattern& pattern, const TagPixels& pixels, const TagVector& x) {
  Frame frame;
  frame.x_H_tag = homography_of(x);
  frame.tag_H_x = frame.x_H_tag.inverse();
  frame.tag_H_x /= frame.tag_H_x(2, 2);
  frame.half_cells = 0.5 * pattern.cells;
  Eigen::Matrix3d cell_H_x = frame.tag_H_x;
  cell_H_x.row(0) = frame.half_cells * (frame.tag_H_x.row(0) + frame.tag_H_x.row(2));
  cell_H_x.row(1) = frame.half_cells * (frame.tag_H_x.row(1) + frame.tag_H_x.row(2));
  for (int i = 0; i < 9; ++i) {
    frame.cell_H_x_rows[static_cast<std::size_t>(i)] = cell_H_x(i / 3, i % 3);
    frame.point.cell_H_x[i] = static_cast<float>(cell_H_x(i / 3, i % 3));
  }
  frame.blur_x = std::exp(x[kLogBlur]) / pixels.unit_px;
  const double e1 = x[kStretch];
  const double e2 = x[kStretch + 1];
  frame.blur_x2 << 1 + e1, e2, e2, 1 - e1;
  frame.blur_x2 *= frame.blur_x * frame.blur_x;
  // Planes in cells instead of -1 to 1.
  const auto plane = [&](int at, float& middle, float& along, float& across) {
    along = static_cast<float>(x[at + 1] / frame.half_cells);
    across = static_cast<float>(x[at + 2] / frame.half_cells);
    middle = static_cast<float>(x[at] - x[at + 1] - x[at + 2]);
  };
  plane(kBlackPlane, frame.point.black, frame.point.black_u, frame.point.black_v);
  plane(kStepPlane, frame.point.step, frame.point.step_u, frame.point.step_v);
  frame.point.growth = static_cast<float>(std::expm1(x[kTagGrowth]));
  return frame;
}

/// Derivatives of x and y at a place of the tag by kHomography.
Eigen::Matrix<double, 2, 8> by_homography(double u, double v, double w, double x, double y) {
  Eigen::Matrix<double, 2, 8> J;
  J << u, v, 1, 0, 0, 0, -x * u, -x * v,  //
      0, 0, 0, u, v, 1, -y * u, -y * v;
  return J / w;
}

struct PatchPlace {
  double u = 0, v = 0, w = 1;  ///< of the tag, -1 to 1
  Eigen::Matrix2d cell_J_x;    ///< derivative of cells by x, y
};

PatchPlace place_of(const Frame& frame, const Patch& patch, double lens) {
  PatchPlace place;
  const Eigen::Vector3d t =
      frame.tag_H_x * Eigen::Vector3d(patch.x + lens * patch.bend.x(), patch.y + lens * patch.bend.y(), 1);
  place.u = t.x() / t.z();
  place.v = t.y() / t.z();
  place.w = frame.x_H_tag(2, 0) * place.u + frame.x_H_tag(2, 1) * place.v + 1;
  place.cell_J_x.row(0) = frame.tag_H_x.row(0).head<2>() - place.u * frame.tag_H_x.row(2).head<2>();
  place.cell_J_x.row(1) = frame.tag_H_x.row(1).head<2>() - place.v * frame.tag_H_x.row(2).head<2>();
  place.cell_J_x *= frame.half_cells / t.z();
  return place;
}

/// Covariance of the blur in cells.
Eigen::Matrix2d blur_at(const Frame& frame, const PatchPlace& place) {
  Eigen::Matrix2d blur = place.cell_J_x * frame.blur_x2 * place.cell_J_x.transpose();
  blur.diagonal() = blur.diagonal().cwiseMax(1e-6);
  return blur;
}

/// The pattern of a patch moves along u and v with the homography and the lens.
Eigen::Matrix<double, 2, 9> moved_by_tag(const Patch& patch, const PatchPlace& place) {
  Eigen::Matrix<double, 2, 9> J;
  J.leftCols<8>() = -place.cell_J_x * by_homography(place.u, place.v, place.w, patch.x, patch.y);
  J.col(8) = place.cell_J_x * patch.bend;
  return J;
}

/// The blur along u and v and their covariance by kLogBlur and kStretch.
Eigen::Matrix3d blur_by_tag(const Frame& frame, const PatchPlace& place, const Eigen::Matrix2d& blur) {
  const double square = frame.blur_x * frame.blur_x;
  const Eigen::Matrix2d& J = place.cell_J_x;
  Eigen::Matrix3d by;
  for (int axis = 0; axis < 2; ++axis) {
    by(axis, 0) = 1;
    by(axis, 1) = 0.5 * square / blur(axis, axis) * (J(axis, 0) * J(axis, 0) - J(axis, 1) * J(axis, 1));
    by(axis, 2) = square / blur(axis, axis) * J(axis, 0) * J(axis, 1);
  }
  by(2, 0) = 2 * blur(0, 1);
  by(2, 1) = square * (J(0, 0) * J(1, 0) - J(0, 1) * J(1, 1));
  by(2, 2) = square * (J(0, 0) * J(1, 1) + J(0, 1) * J(1, 0));
  return by;
}

/// How what acts on a patch follows from the parameters of the tag: a sparse matrix, applied by its blocks.
struct Chain {
  Eigen::Matrix<double, 2, 9> moved;  ///< by kHomography and kLens
  Eigen::RowVector3d plane;           ///< of the levels
  Eigen::Matrix3d blur;
  int side = -1;

  /// rows * chain, for rows that are derivatives by what acts on a patch.
  template <int kRows>
  [[nodiscard]] Eigen::Matrix<double, kRows, kTagParameters> applied(
      const Eigen::Matrix<double, kRows, kPatchParameters>& rows) const {
    Eigen::Matrix<double, kRows, kTagParameters> out;
    const Eigen::Matrix<double, kRows, 9> place = rows.template middleCols<2>(kAlong).lazyProduct(moved);
    out.template leftCols<8>() = place.template leftCols<8>();
    out.col(kLens) = place.col(8);
    out.template middleCols<3>(kBlackPlane) = rows.col(kBlack).lazyProduct(plane);
    out.template middleCols<3>(kStepPlane) = rows.col(kStep).lazyProduct(plane);
    out.col(kTagGrowth) = rows.col(kGrowth);
    out.template middleCols<3>(kLogBlur) = rows.template middleCols<3>(kBlurAlong).lazyProduct(blur);
    out.template middleCols<4>(kRim).setZero();
    if (side >= 0) out.col(kRim + side) = rows.col(kBeyond);
    return out;
  }
};

}  // namespace

Eigen::Matrix3d homography_of(const TagVector& x) {
  Eigen::Matrix3d H;
  H << x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], 1;
  return H;
}

Matrix8 corners_by_homography(const TagVector& x) {
  Matrix8 J;
  const Eigen::Matrix3d H = homography_of(x);
  for (int k = 0; k < 4; ++k) {
    const double u = k == 1 || k == 2 ? 1 : -1;
    const double v = k >= 2 ? 1 : -1;
    const Eigen::Vector3d p = H * Eigen::Vector3d(u, v, 1);
    J.middleRows<2>(2 * k) = by_homography(u, v, p.z(), p.x() / p.z(), p.y() / p.z());
  }
  return J;
}

void measure_patches(const Pattern& pattern, const TagPixels& pixels, TagFitState& state,
                     SumPatch sum_patch) {
  Frame frame = frame_at(pattern, pixels, state.x);
  for (int p = 0; p < pixels.patches; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const Patch& patch = pixels.patch[at];
    const PatchPlace place = place_of(frame, patch, state.x[kLens]);
    const Eigen::Matrix2d blur = blur_at(frame, place);
    frame.point.inverse_blur_u = static_cast<float>(1 / std::sqrt(blur(0, 0)));
    frame.point.inverse_blur_v = static_cast<float>(1 / std::sqrt(blur(1, 1)));
    frame.point.blur_uv = static_cast<float>(blur(0, 1));
    for (std::size_t row = 0; row < 3; ++row) {  // the lens moves the pixels of a patch together
      const double* H = &frame.cell_H_x_rows[3 * row];
      frame.point.cell_H_x[3 * row + 2] =
          static_cast<float>(H[2] + state.x[kLens] * (H[0] * patch.bend.x() + H[1] * patch.bend.y()));
    }
    frame.point.beyond = patch.side >= 0 ? static_cast<float>(state.x[kRim + patch.side]) : 0.0F;
    sum_patch(pixels.rows(patch), patch.window, frame.point, state.sums[at]);
  }
}

TagEquations equations_of(const Pattern& pattern, const TagPixels& pixels, bool with_information,
                          TagFitState& state) {
  TagEquations equations;
  const Frame frame = frame_at(pattern, pixels, state.x);
  for (int p = 0; p < pixels.patches; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const Patch& patch = pixels.patch[at];
    const PatchSums& sums = state.sums[at];
    state.patch_gradient[at].setZero();
    if (patch.weight <= 0) continue;
    Local local;
    LocalVector gradient;
    for (int i = 0; i < kPatchParameters; ++i) {
      gradient[i] = patch.weight * static_cast<double>(sums.gradient[i]);
      for (int k = i; k < kPatchParameters; ++k)
        local(i, k) = local(k, i) = patch.weight * static_cast<double>(sums.information[i][k]);
    }
    const PatchPlace place = place_of(frame, patch, state.x[kLens]);
    const Chain chain{moved_by_tag(patch, place), Eigen::RowVector3d(1, place.u, place.v),
                      blur_by_tag(frame, place, blur_at(frame, place)), patch.side};
    state.patch_gradient[at] = chain.applied<1>(gradient).transpose();
    if (with_information) {
      const Eigen::Matrix<double, kTagParameters, kPatchParameters> half =
          chain.applied<kPatchParameters>(local).transpose();
      equations.information += chain.applied<kTagParameters>(half);
    }
    equations.gradient += state.patch_gradient[at];
    equations.cost += patch.weight * static_cast<double>(sums.cost);
    equations.pixels += patch.weight * static_cast<double>(sums.pixels);
  }
  return equations;
}

void add_priors(const TagPriors& priors, const TagVector& x, TagMatrix& information, TagVector& gradient) {
  const double step = std::max(5.0, std::abs(x[kStepPlane]));
  const auto expect = [&](int i, double value, double sigma) {
    information(i, i) += 1 / (sigma * sigma);
    gradient[i] += (value - x[i]) / (sigma * sigma);
  };
  for (const int i : {1, 2}) {
    expect(kBlackPlane + i, 0, priors.black_slope * step);
    expect(kStepPlane + i, 0, priors.step_slope * step);
  }
  expect(kTagGrowth, 0, priors.growth);
  expect(kLogBlur, std::log(priors.blur_px), priors.log_blur);
  expect(kStretch, 0, priors.stretch);
  expect(kStretch + 1, 0, priors.stretch);
  for (int k = 0; k < 4; ++k) expect(kRim + k, 0, priors.rim);
  expect(kLens, 0, 1);
}

}  // namespace waymark::refinement
