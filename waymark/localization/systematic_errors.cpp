#include "waymark/localization/systematic_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/angles.hpp"

namespace waymark {

void SystematicErrors::add(const Linearised& z, const StateBySystematic& A,
                           const Eigen::Matrix<double, 8, 8>& S, SensorTime stamp) {
  if (!counts_) return;
  const Eigen::LLT<Eigen::Matrix<double, 8, 8>> llt(S);
  if (llt.info() != Eigen::Success) return;
  const StateBySystematic white_A = llt.matrixL().solve(A);
  const Eigen::Matrix<double, 8, 1> white_r = llt.matrixL().solve(z.residual);
  if (!white_A.allFinite() || !white_r.allFinite()) return;
  if (count_ == per_block_ * static_cast<int>(kBlocks)) merge_blocks();
  const Sums told{white_A.transpose().lazyProduct(white_A), white_A.transpose().lazyProduct(white_r), 1};
  blocks_[static_cast<std::size_t>(count_ / per_block_)] += told;
  if (clusters_) clusters_->add(z.landmark, stamp, told);
  ++count_;
  seen_[static_cast<std::size_t>(z.landmark)] = 1;
}

/// Half as many, twice as long.
void SystematicErrors::merge_blocks() {
  for (std::size_t i = 0; i < kBlocks / 2; ++i) {
    Sums both = blocks_[2 * i];
    both += blocks_[2 * i + 1];
    blocks_[i] = both;
  }
  std::fill(blocks_.begin() + kBlocks / 2, blocks_.end(), Sums{});
  per_block_ *= 2;
}

void SystematicErrors::clear() {
  std::ranges::fill(seen_, std::uint8_t{0});
  std::ranges::fill(blocks_, Sums{});
  per_block_ = kFirstBlock;
  count_ = 0;
  if (clusters_) clusters_.emplace();
}

std::optional<SystematicFit> SystematicErrors::fit(const SystematicVector& prior,
                                                   const SystematicVector& away) const {
  constexpr int kFewest = 100;
  constexpr int kFewestLandmarks = 3;
  SystematicMatrix information = prior.cwiseAbs2().cwiseInverse().asDiagonal();
  SystematicVector score = -information.diagonal().cwiseProduct(away);
  for (const Sums& sums : blocks_) {
    information += sums.information;
    score += sums.score;
  }
  if (count_ < kFewest || std::ranges::count(seen_, 1) < kFewestLandmarks) return std::nullopt;
  const Eigen::LLT<SystematicMatrix> llt(information);
  if (llt.info() != Eigen::Success) return std::nullopt;
  SystematicFit fit{.value = llt.solve(score)};
  fit.covariance = llt.solve(SystematicMatrix::Identity());
  const SystematicVector apart =
      clusters_ ? clusters_->variances(information, fit.value) : variances_by_blocks(fit);
  const SystematicVector more = (apart.array() / fit.covariance.diagonal().array()).max(1).sqrt();
  fit.covariance = (more.asDiagonal() * fit.covariance * more.asDiagonal()).eval();
  return fit;
}

/// Of a sample of stretches; zero where they are too few.
SystematicVector SystematicErrors::variances_by_blocks(const SystematicFit& by_number) const {
  constexpr double kFewestBlocks = 4;
  double blocks = 0;
  SystematicMatrix scatter = SystematicMatrix::Zero();
  for (const Sums& sums : blocks_) {
    const SystematicVector s = sums.score - sums.information * by_number.value;
    scatter += s * s.transpose();
    blocks += sums.count > 0 ? 1 : 0;
  }
  if (blocks < kFewestBlocks) return SystematicVector::Zero();
  const SystematicMatrix P = by_number.covariance * scatter * by_number.covariance;
  return blocks / (blocks - 1) * P.diagonal();
}

namespace {

/// Rows of kSystematic that are one suspect.
struct Group {
  Suspect suspect;
  Eigen::Index first;
  Eigen::Index size;
};

constexpr std::array kGroups{Group{Suspect::Mounting, 0, 6}, Group{Suspect::Scale, 6, 1},
                             Group{Suspect::Latency, 7, 1}};
/// Of the numbers of a sensor [m, rad, 1, s]: smaller errors do no harm that the stated covariance would not
/// cover.
constexpr std::array kMatters{0.008, 0.008, 0.008, 0.01, 0.01, 0.01, 0.006, 0.01};

/// The largest chi-square, of one degree of freedom, of the numbers of a group that are large enough to
/// matter.
double wald(const SystematicFit& fit, const Group& group) {
  double most = 0;
  for (Eigen::Index i = group.first; i < group.first + group.size; ++i) {
    if (std::abs(fit.value[i]) > kMatters[static_cast<std::size_t>(i)])
      most = std::max(most, fit.value[i] * fit.value[i] / fit.covariance(i, i));
  }
  return most;
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
  constexpr double kSignificant = 30;
  std::optional<SystematicVerdict> verdict;
  double most = 0;
  for (const Group& group : kGroups) {
    const double chi2 = wald(*fit, group);
    if (chi2 < kSignificant) continue;
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
