#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/localization/score_clusters.hpp"

#include "waymark/localization/riekf.hpp"

namespace waymark {

/// Errors of the numbers of kSystematic by which innovations are explained best.
struct SystematicFit {
  SystematicVector value = SystematicVector::Zero();
  SystematicMatrix covariance = SystematicMatrix::Zero();
};

/// Regression of innovations on errors of what the filter takes for right: score and information of a
/// likelihood of innovations (Mehra and Peschon, "An innovations approach to fault detection and diagnosis in
/// dynamic systems", Automatica 7, 1971; Basseville and Nikiforov, "Detection of Abrupt Changes", section
/// 7.2.4, additive changes seen through the filter's own dynamics). No allocation after construction.
class SystematicErrors {
 public:
  explicit SystematicErrors(int landmarks)
      : seen_(static_cast<std::size_t>(landmarks), 0), blocks_(kBlocks) {}

  /// A residual, its sensitivity (Riekf::sensitivity()), and the covariance of its innovation.
  void add(const Linearised& z, const StateBySystematic& A, const Eigen::Matrix<double, 8, 8>& S,
           SensorTime stamp);
  void clear();
  /// Whether add() counts, or passes over: a part of a drive may be held out.
  void count_in(bool counts) { counts_ = counts; }
  /// From now on what each landmark tells in each moment is kept apart: memory grows with the drive, and the
  /// covariance of fit() is that of ScoreClusters, where that is larger.
  void keep_clusters() { clusters_.emplace(); }
  /// With a prior of these standard deviations about `-away`: so far the numbers are from it already.
  /// Innovations that are near in time share errors of tags and of the motion: the covariance is also that of
  /// a sample of stretches of the drive (Liang and Zeger, "Longitudinal data analysis using generalized
  /// linear models", Biometrika 73(1), 1986), where that is larger. Nothing before there are enough. O(1).
  [[nodiscard]] std::optional<SystematicFit> fit(
      const SystematicVector& prior, const SystematicVector& away = SystematicVector::Zero()) const;
  [[nodiscard]] int count() const { return count_; }

 private:
  [[nodiscard]] SystematicVector variances_by_blocks(const SystematicFit& by_number) const;

  using Sums = ScoreSums;
  static constexpr int kFirstBlock = 128;  ///< observations
  void merge_blocks();
  static constexpr std::size_t kBlocks = 32;
  std::vector<std::uint8_t> seen_;  ///< landmarks
  std::vector<Sums> blocks_;        ///< of the drive, each of so many observations
  int per_block_ = kFirstBlock;
  int count_ = 0;
  bool counts_ = true;
  std::optional<ScoreClusters> clusters_;
};

/// What innovations show to be wrong.
enum class Suspect : std::uint8_t { Mounting, Scale, Latency };

struct SystematicVerdict {
  Suspect suspect = Suspect::Mounting;
  double chi2 = 0;  ///< of its errors being zero
  SystematicFit fit{};
  /// Second moment of the errors of mounting, scale and latency: what the stated covariance must cover.
  SystematicMatrix second_moment = SystematicMatrix::Zero();
};

/// Wald tests of mounting, scale and latency, each beside the others; the one that alone explains most is the
/// suspect. Nothing when none is significant and large enough to matter.
[[nodiscard]] std::optional<SystematicVerdict> judge_systematic(const SystematicErrors& errors);
/// The suspect with its size, and the command that mends it.
[[nodiscard]] std::string words_of(const SystematicVerdict& verdict, bool corners);

}  // namespace waymark
