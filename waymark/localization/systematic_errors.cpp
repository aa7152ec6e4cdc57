#include "waymark/localization/systematic_errors.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"

namespace waymark {

void SystematicErrors::add(const Linearised& z, const StateBySystematic& A,
                           const Eigen::Matrix<double, 8, 8>& S) {
  if (!counts_) return;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(S);
  if (llt.info() != Eigen::Success) return;
  const StateBySystematic white_A = llt.matrixL().solve(A);
  const Eigen::Matrix<double, 8, 1> white_r = llt.matrixL().solve(z.residual);
  if (!white_A.allFinite() || !white_r.allFinite()) return;
  Sums& sums = all_[static_cast<std::size_t>(z.landmark)];
  sums.information += white_A.transpose().lazyProduct(white_A);
  sums.score += white_A.transpose().lazyProduct(white_r);
  ++sums.count;
  ++count_;
}

void SystematicErrors::clear() {
  all_.assign(all_.size(), {});
  count_ = 0;
}

std::optional<SystematicFit> SystematicErrors::fit(const SystematicVector& prior,
                                                   const SystematicVector& away) const {
  constexpr int kFewest = 100;
  constexpr int kFewestLandmarks = 3;
  int landmarks = 0;
  SystematicMatrix information = prior.cwiseAbs2().cwiseInverse().asDiagonal();
  SystematicVector score = -information.diagonal().cwiseProduct(away);
  for (const Sums& sums : all_) {
    information += sums.information;
    score += sums.score;
    landmarks += sums.count > 0 ? 1 : 0;
  }
  if (count_ < kFewest || landmarks < kFewestLandmarks) return std::nullopt;
  const Eigen::LLT<SystematicMatrix> llt(information);
  if (llt.info() != Eigen::Success) return std::nullopt;
  SystematicFit fit{.value = llt.solve(score)};
  SystematicMatrix scatter = SystematicMatrix::Zero();
  for (const Sums& sums : all_) {
    const SystematicVector s = sums.score - sums.information * fit.value;
    scatter += s * s.transpose();
  }
  const SystematicMatrix by_number = llt.solve(SystematicMatrix::Identity());
  const SystematicMatrix by_landmark = landmarks / (landmarks - 1.0) * by_number * scatter * by_number;
  const SystematicVector more = (by_landmark.diagonal().array() / by_number.diagonal().array()).max(1).sqrt();
  fit.covariance = more.asDiagonal() * by_number * more.asDiagonal();
  return fit;
}

namespace {

/// Rows of kSystematic that are one suspect.
struct Group {
  Suspect suspect;
  Eigen::Index first;
  Eigen::Index size;
  double significant;  ///< chi-square
};

constexpr std::array kGroups{Group{Suspect::Mounting, 0, 6, 50}, Group{Suspect::Scale, 6, 1, 30},
                             Group{Suspect::Latency, 7, 1, 30}};

/// Smaller errors than these do no harm that the stated covariance would not cover.
bool matters(Suspect suspect, const SystematicVector& value) {
  switch (suspect) {
    case Suspect::Mounting:
      return value.head<3>().norm() > 0.008 || value.segment<3>(3).norm() > 0.01;
    case Suspect::Scale:
      return std::abs(value[6]) > 0.006;
    case Suspect::Latency:
      return std::abs(value[7]) > 0.01;
  }
  return false;
}

double wald(const SystematicFit& fit, const Group& group) {
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;  // no allocation
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6>;
  const Vector value = fit.value.segment(group.first, group.size);
  const Matrix P = fit.covariance.block(group.first, group.first, group.size, group.size);
  const Vector solved = P.ldlt().solve(value);
  return value.dot(solved);
}

SystematicVector prior_of_any_robot() {
  return (SystematicVector() << 0.1, 0.1, 0.05, 0.1, 0.1, 0.1, 0.05, 0.1, 0.05, 0.05).finished();
}

/// What a suspect explains when all others are right.
double explained_alone(const SystematicErrors& errors, const Group& group) {
  constexpr double kRight = 1e-9;
  SystematicVector prior = prior_of_any_robot();
  for (Eigen::Index i = 0; i < 8; ++i)
    if (i < group.first || i >= group.first + group.size) prior[i] = kRight;
  const auto fit = errors.fit(prior);
  return fit ? wald(*fit, group) : 0;
}

}  // namespace

std::optional<SystematicVerdict> judge_systematic(const SystematicErrors& errors) {
  const auto fit = errors.fit(prior_of_any_robot());
  if (!fit) return std::nullopt;
  std::optional<SystematicVerdict> verdict;
  double most = 0;
  for (const Group& group : kGroups) {
    const double chi2 = wald(*fit, group);
    if (chi2 < group.significant || !matters(group.suspect, fit->value)) continue;
    const double alone = explained_alone(errors, group);
    if (verdict && alone <= most) continue;
    most = alone;
    verdict = SystematicVerdict{.suspect = group.suspect, .chi2 = chi2, .fit = *fit};
  }
  if (!verdict) return verdict;
  constexpr Eigen::Index kOfSensor = 8;
  verdict->second_moment.topLeftCorner<kOfSensor, kOfSensor>() =
      (fit->covariance + fit->value * fit->value.transpose()).topLeftCorner<kOfSensor, kOfSensor>();
  return verdict;
}

std::string words_of(const SystematicVerdict& verdict, bool corners) {
  const SystematicVector& v = verdict.fit.value;
  switch (verdict.suspect) {
    case Suspect::Mounting:
      return fmt::format(
          "the innovations show a wrong sensor mounting: by about x {:.0f} mm, y {:.0f} mm, yaw {:.1f} deg, "
          "pitch "
          "{:.1f} deg. Run `waymark calibrate robot` and give the result with --calibration",
          1000 * v[0], 1000 * v[1], to_degrees(v[5]), to_degrees(v[4]));
    case Suspect::Scale:
      return fmt::format(
          "the innovations show a wrong {}: by about {:+.1f} %. Run `waymark calibrate {}` and give the "
          "result "
          "with --calibration",
          corners ? "focal length, or wrong tag sizes" : "scale of the measured distances", 100 * v[6],
          corners ? "camera" : "robot");
    case Suspect::Latency:
      return fmt::format(
          "the innovations show a wrong camera latency: by about {:+.0f} ms. Run `waymark calibrate "
          "robot` and "
          "give the result with --calibration, or set --camera-latency-s",
          1000 * v[7]);
  }
  return {};
}

}  // namespace waymark
