#include "waymark/localization/innovation_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/geometry/planar.hpp"
#include "waymark/localization/innovation_cost.hpp"
#include "waymark/localization/kept_numbers.hpp"

namespace waymark {
namespace {

using internal::Cost;
using internal::kBlocks;

using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1>;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic>;

double& number(CalibratedNumbers& numbers, std::size_t at) { return numbers[at]; }

constexpr CalibratedNumbers kSteps{0.01, 0.01, 0.01, 0.01, 0.02, 0.01, 0.01, 0.01};

/// Gradient and Hessian by differences.
struct Quadratic {
  Vector g;
  Matrix H;
};

Quadratic differentiate(Cost& cost, const CalibratedNumbers& at, double here,
                        const std::vector<std::size_t>& what) {
  const auto n = static_cast<Eigen::Index>(what.size());
  Quadratic q{Vector::Zero(n), Matrix::Zero(n, n)};
  Vector forwards(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t a = what[static_cast<std::size_t>(i)];
    CalibratedNumbers moved = at;
    number(moved, a) = at[a] + kSteps[a];
    forwards[i] = cost(moved);
    number(moved, a) = at[a] - kSteps[a];
    const double backwards = cost(moved);
    q.g[i] = (forwards[i] - backwards) / (2 * kSteps[a]);
    q.H(i, i) = (forwards[i] - 2 * here + backwards) / (kSteps[a] * kSteps[a]);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const std::size_t a = what[static_cast<std::size_t>(i)];
      const std::size_t b = what[static_cast<std::size_t>(j)];
      CalibratedNumbers moved = at;
      number(moved, a) += kSteps[a];
      number(moved, b) += kSteps[b];
      const double both = cost(moved);
      q.H(i, j) = q.H(j, i) = (both - forwards[i] - forwards[j] + here) / (kSteps[a] * kSteps[b]);
    }
  }
  return q;
}

/// How much the stretches of the drive disagree: the covariance of the gradient by the scatter of theirs.
/// Neighbouring innovations share the errors of the tags they see, so that their number says too much (Huber,
/// "The behavior of maximum likelihood estimates under nonstandard conditions", 1967; White, "Maximum
/// Likelihood Estimation of Misspecified Models", Econometrica 50(1), 1982).
Matrix scatter_of_gradient(Cost& cost, const CalibratedNumbers& at, const std::vector<std::size_t>& what) {
  Matrix g(kBlocks, static_cast<Eigen::Index>(what.size()));
  for (Eigen::Index i = 0; i < g.cols(); ++i) {
    const std::size_t a = what[static_cast<std::size_t>(i)];
    CalibratedNumbers moved = at;
    number(moved, a) = at[a] + kSteps[a];
    static_cast<void>(cost(moved));
    g.col(i) = cost.blocks();
    number(moved, a) = at[a] - kSteps[a];
    static_cast<void>(cost(moved));
    g.col(i) = (g.col(i) - cost.blocks()) / (2 * kSteps[a]);
  }
  const Matrix centred = g.rowwise() - g.colwise().mean();
  return centred.transpose() * centred * (static_cast<double>(kBlocks) / (kBlocks - 1));
}

/// What is asked for and can be told at all: with a gyro the wheels do not turn the robot, without one there
/// is none.
std::vector<std::size_t> sought(std::span<const Sample> samples, const InnovationFitOptions& fit) {
  const bool gyro =
      std::ranges::any_of(samples, [](const Sample& s) { return std::holds_alternative<ImuSample>(s); });
  const auto without = static_cast<std::size_t>(gyro ? Calibrated::YawGain : Calibrated::GyroGain);
  std::vector<std::size_t> what;
  for (std::size_t i = 0; i < kCalibrated; ++i)
    if (fit.seek[i] && i != without) what.push_back(i);
  return what;
}

/// Further from the start than this is no robot, but a search gone astray.
bool credible(const CalibratedNumbers& numbers, const CalibratedNumbers& start,
              const CalibratedNumbers& prior) {
  constexpr double kMostSigma = 3;
  for (std::size_t i = 0; i < kCalibrated; ++i)
    if (std::abs(numbers[i] - start[i]) > kMostSigma * prior[i]) return false;
  return true;
}

/// What the drive does not tell, whose cost does not curve upwards, stays as it was given.
void leave_untold(Quadratic& q, const std::vector<std::size_t>& what, const CalibratedNumbers& prior) {
  for (Eigen::Index i = 0; i < q.H.rows(); ++i) {
    const double least = 2 / std::pow(prior[what[static_cast<std::size_t>(i)]], 2);
    if (q.H(i, i) > least) continue;
    q.g[i] = 0;
    q.H.row(i).setZero();
    q.H.col(i).setZero();
  }
}

/// The Hessian of a likelihood near its top is positive definite; that of a run with gates need not be.
Matrix made_definite(Matrix H, const std::vector<std::size_t>& what, const CalibratedNumbers& prior) {
  for (Eigen::Index i = 0; i < H.rows(); ++i) {
    const double least = 2 / std::pow(prior[what[static_cast<std::size_t>(i)]], 2);
    H(i, i) = std::max(H(i, i), least);
  }
  for (int round = 0; round < 30 && Eigen::LLT<Matrix>(H).info() != Eigen::Success; ++round) {
    const Vector diagonal = H.diagonal();
    H *= 0.8;
    H.diagonal() = diagonal;
  }
  return H;
}

/// The covariance of the numbers. Innovations of a robot that stands and of tags that stay wrong are not
/// independent: where their scatter says more than their number, it counts.
Matrix trusted(const Matrix& inverse, const Matrix& scatter) {
  const Matrix by_number = 2 * inverse;
  const Matrix by_scatter = inverse * scatter * inverse;
  const Vector more = (by_scatter.diagonal().array() / by_number.diagonal().array()).max(1).sqrt();
  return more.asDiagonal() * by_number * more.asDiagonal();
}

/// What the drive does not tell from what was given stays that: others gave it who knew more.
void move_what_is_told(const Matrix& P, const std::vector<std::size_t>& what, const CalibratedNumbers& start,
                       double keep_sigma, InnovationFit& result) {
  Vector change(static_cast<Eigen::Index>(what.size()));
  for (std::size_t i = 0; i < what.size(); ++i)
    change[static_cast<Eigen::Index>(i)] = result.value[what[i]] - start[what[i]];
  const std::vector<bool> kept = keep_given(P, keep_sigma, change);
  for (std::size_t i = 0; i < what.size(); ++i) {
    result.value[what[i]] = start[what[i]] + change[static_cast<Eigen::Index>(i)];
    result.kept[what[i]] = kept[i];
  }
}

}  // namespace

std::string_view to_string(Calibrated what) {
  constexpr std::array<std::string_view, kCalibrated> kNames = {
      "mounting_x_m", "mounting_y_m", "mounting_yaw_rad", "odometry_scale",
      "yaw_gain",     "gyro_gain",    "camera_latency_s", "sight_scale"};
  return kNames.at(static_cast<std::size_t>(what));
}

MountedSensor calibrated_sensor(const MountedSensor& eye, const CalibratedNumbers& numbers) {
  MountedSensor moved = eye;
  const SE3& T = eye.base_T_sensor;
  moved.base_T_sensor = SE3(SO3::exp({0, 0, numbers[2]}) * T.rotation(),
                            T.translation() + Eigen::Vector3d(numbers[0], numbers[1], 0));
  return moved;
}

RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers) {
  RiekfOptions out = options;
  out.odometry_scale = numbers[3];
  out.yaw_gain = numbers[4];
  out.gyro_gain = numbers[5];
  out.camera_latency_s = numbers[6];
  out.sight_scale = numbers[7];
  return out;
}

Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples, const Landmarks& landmarks,
                                               const MountedSensor& eye, const RiekfOptions& options,
                                               const InnovationFitOptions& fit) {
  InnovationFit result;
  result.value = {0,
                  0,
                  0,
                  options.odometry_scale,
                  options.yaw_gain,
                  options.gyro_gain,
                  options.camera_latency_s,
                  options.sight_scale};
  const CalibratedNumbers start = result.value;
  const std::vector<std::size_t> what = sought(samples, fit);
  Cost cost(samples, landmarks, eye, options, result.value, fit);
  double here = cost(result.value);
  constexpr std::size_t kFewest = 50;
  if (!cost.stopped && cost.sightings < kFewest)
    return fail(ErrorCode::InvalidArgument, "too few sightings of the map to calibrate by", {},
                "Drive past the tags of the map, with turns, for half a minute or more.");
  result.cost_before = cost.per_row();
  Matrix H;
  for (int iteration = 0; iteration < fit.iterations && !cost.stopped; ++iteration) {
    Quadratic q = differentiate(cost, result.value, here, what);
    leave_untold(q, what, fit.prior);
    H = made_definite(q.H, what, fit.prior);
    const Vector step = -Eigen::LLT<Matrix>(H).solve(q.g);
    bool better = false;
    for (double share = 1; share > 0.05 && !better; share /= 2) {
      CalibratedNumbers tried = result.value;
      for (std::size_t i = 0; i < what.size(); ++i)
        tried[what[i]] += share * step[static_cast<Eigen::Index>(i)];
      if (!credible(tried, start, fit.prior)) continue;
      const double there = cost(tried);
      if (there >= here) continue;
      better = result.improved = true;
      here = there;
      result.value = tried;
    }
    if (!better) break;
  }
  const Matrix inverse = Eigen::LLT<Matrix>(H).solve(Matrix::Identity(H.rows(), H.cols()));
  const Matrix P = trusted(inverse, scatter_of_gradient(cost, result.value, what));
  move_what_is_told(P, what, start, fit.keep_sigma, result);
  static_cast<void>(cost(result.value));
  if (cost.stopped) return fail(ErrorCode::InvalidArgument, "stopped before the search ended");
  result.cost_after = cost.per_row();
  result.runs = cost.runs;
  for (std::size_t i = 0; i < what.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    result.sigma[what[i]] = std::min(std::sqrt(P(at, at)), fit.prior[what[i]]);
    result.known[what[i]] = result.sigma[what[i]] < 0.5 * fit.prior[what[i]];
  }
  return result;
}

}  // namespace waymark
