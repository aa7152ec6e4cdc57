#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/localization/landmarks.hpp"
#include "waymark/localization/riekf.hpp"

namespace waymark {

/// Evidence from one observation about its landmark, at the estimate with which it was compared.
struct WatchedObservation {
  int landmark = 0;
  double nis_per_row = 0;
  bool accepted = false;
  Eigen::Vector2d map_p_implied = Eigen::Vector2d::Zero();  ///< position implied by the observation
  double range_ratio = 1;                                   ///< ratio of measured to predicted distance
  double off_direction_rad = 0;                             ///< angle to the predicted line of sight
};

/// Statistics about the observations of each landmark, and findings as text. A landmark that contradicts the
/// estimate while the others agree is excluded until it fits again.
class TagWatch {
 public:
  explicit TagWatch(const Landmarks& landmarks);

  /// Adds an observation, whether accepted or rejected.
  void add(const WatchedObservation& seen);
  /// To be called when accepted landmarks have confirmed the estimate. Contradictions since the last
  /// confirmation then count against their landmarks.
  void confirm();
  /// Discards the contradictions that have not been confirmed, because the estimate was wrong rather than the
  /// landmarks.
  void forget_pending();

  [[nodiscard]] bool usable(int landmark) const { return !at(landmark).excluded; }
  /// Findings such as "tag36h11:5 and tag36h11:6 are swapped, in the map or on the wall …", sorted by id.
  [[nodiscard]] std::vector<std::string> findings() const;
  /// Mean NIS per degree of freedom over the accepted observations; 0 if there are none.
  [[nodiscard]] double mean_nis_per_row(int landmark) const;
  [[nodiscard]] int observations(int landmark) const { return at(landmark).seen; }
  [[nodiscard]] int contradictions(int landmark) const { return at(landmark).wrong.count; }

 private:
  struct Sums {
    int count = 0;
    Eigen::Vector2d p = Eigen::Vector2d::Zero();
    double p2 = 0;
    double ratio = 0;
    double ratio2 = 0;
    double direction = 0;
    void add(const WatchedObservation& seen);
    void add(const Sums& other);
  };
  struct One {
    int seen = 0;
    int accepted = 0;
    int accepted_in_a_row = 0;
    double nis_sum = 0;
    Sums wrong{};
    Sums pending{};
    bool excluded = false;
  };
  [[nodiscard]] const One& at(int landmark) const { return all_[static_cast<std::size_t>(landmark)]; }
  [[nodiscard]] bool swapped(int a, int b) const;
  [[nodiscard]] std::string describe(int landmark) const;
  [[nodiscard]] std::optional<std::string> describe_duplicate(int landmark) const;
  [[nodiscard]] std::string name(int landmark) const;

  Landmarks landmarks_;
  std::vector<One> all_;
};

/// Detects wheels that stop within one message, faster than a robot can brake. The encoders may have failed
/// while the robot continues at its previous speed. Until tags confirm the standstill, the uncertainty of the
/// position includes the distance that the robot would have covered.
class SuddenHalt {
 public:
  /// Returns the step, including the variance that the suspicion adds to the position and, if no gyro
  /// measures it, to the heading. O(1).
  [[nodiscard]] MotionStep advance(MotionStep step);
  [[nodiscard]] bool suspected() const { return suspected_; }
  /// Reports that the tags in an image corrected the position by `moved_m`, which is nearly zero at
  /// standstill.
  void observe_correction(double moved_m);

 private:
  double speed_m_s_ = 0;  ///< during the last step with motion
  double yaw_rate_rad_s_ = 0;
  double since_s_ = 0;  ///< time since the halt, or since the latest image with tags after it
  bool suspected_ = false;
};

/// Tests whether the residuals of one landmark average out as fast as the filter assumes. The mean of n
/// whitened residuals has the covariance S - I (from lasting errors and the state) + I / n. If the filter
/// models a lasting error as noise, the means are far larger even though every single residual passes.
/// Follows Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and Navigation", section
/// 5.4.2 (tests for autocorrelation), for a filter whose innovations may be correlated. Does not allocate.
class LastingErrors {
 public:
  explicit LastingErrors(int landmarks) : all_(static_cast<std::size_t>(landmarks)) {}

  /// Adds a residual with the covariance of its innovation.
  void add(const Linearised& z, const Eigen::Matrix<double, 8, 8>& S);
  /// NIS of the means so far, divided by their degrees of freedom; empty if there are fewer than 20 means.
  [[nodiscard]] std::optional<double> mean() const;
  /// Sums over those means: twice their negative log-likelihood without its constant term, and their degrees
  /// of freedom.
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double degrees_of_freedom() const { return degrees_of_freedom_; }

 private:
  struct Sums {
    Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
    Eigen::Matrix<double, 8, 8> S = Eigen::Matrix<double, 8, 8>::Zero();
    int count = 0;
  };
  std::vector<Sums> all_;
  double nis_ = 0;
  double cost_ = 0;
  double degrees_of_freedom_ = 0;
  int means_ = 0;
};

/// Information and score for the likelihood of innovations as a function of the parameters in kSystematic.
struct ScoreSums {
  SystematicMatrix information = SystematicMatrix::Zero();
  SystematicVector score = SystematicVector::Zero();
  int count = 0;

  ScoreSums& operator+=(const ScoreSums& other);
};

/// The innovations of a drive, clustered in two ways. Innovations of the same landmark share the errors of
/// its position and print; innovations within two seconds share the errors of the motion.
class ScoreClusters {
 public:
  void add(int landmark, SensorTime stamp, const ScoreSums& score);
  /// Variance of each parameter, where `value` maximises a likelihood with this information (from all
  /// innovations and the prior). It is the variance by landmarks plus that by time minus that by both
  /// (Cameron, Gelbach and Miller, "Robust Inference With Multiway Clustering", Journal of Business and
  /// Economic Statistics 29(2), 2011, equation (2.13)), but at least the larger of the first two. Each
  /// variance is a jackknife estimate, which is not biased low if groups are few and unequal (Bell and
  /// McCaffrey, "Bias Reduction in Standard Errors for Linear Regression with Multi-Stage Samples", Survey
  /// Methodology 28(2), 2002). The variance by landmarks is zero if there are fewer than four landmarks; the
  /// same applies to intervals.
  [[nodiscard]] SystematicVector variances(const SystematicMatrix& information,
                                           const SystematicVector& value) const;

 private:
  std::map<std::pair<std::int64_t, int>, ScoreSums> sums_;  ///< keyed by interval and landmark
};

/// The errors of the parameters in kSystematic that best explain the innovations.
struct SystematicFit {
  SystematicVector value = SystematicVector::Zero();
  SystematicMatrix covariance = SystematicMatrix::Zero();
};

/// Regression of innovations on errors of the parameters that the filter assumes to be exact. Accumulates the
/// score and information for the likelihood of the innovations (Mehra and Peschon, "An innovations approach
/// to fault detection and diagnosis in dynamic systems", Automatica 7, 1971; Basseville and Nikiforov,
/// "Detection of Abrupt Changes", section 7.2.4, additive changes seen through the dynamics of the filter).
/// Does not allocate after construction.
class SystematicErrors {
 public:
  explicit SystematicErrors(int landmarks)
      : seen_(static_cast<std::size_t>(landmarks), 0), blocks_(kBlocks) {}

  /// Adds a residual with its sensitivity (Riekf::sensitivity()) and the covariance of its innovation.
  void add(const Linearised& z, const StateBySystematic& A, const Eigen::Matrix<double, 8, 8>& S,
           SensorTime stamp);
  void clear();
  /// Sets whether add() counts its arguments or ignores them, because part of a drive may be held out.
  void count_in(bool counts) { counts_ = counts; }
  /// From now on, keeps sums by landmark and interval. Memory use then grows with the drive, and the
  /// covariance from fit() is at least that of ScoreClusters.
  void keep_clusters() { clusters_.emplace(); }
  /// The maximum under a prior with these standard deviations. `away` is the difference between the current
  /// parameters and the centre of the prior. Innovations that are close in time share errors of tags and of
  /// the motion. The covariance is therefore at least that given by the scatter of blocks of the drive (Liang
  /// and Zeger, "Longitudinal data analysis using generalized linear models", Biometrika 73(1), 1986). Empty
  /// if there are fewer than 100 observations or three landmarks. O(1).
  [[nodiscard]] std::optional<SystematicFit> fit(
      const SystematicVector& prior, const SystematicVector& away = SystematicVector::Zero()) const;
  [[nodiscard]] int count() const { return count_; }

 private:
  [[nodiscard]] SystematicVector variances_by_blocks(const SystematicFit& by_number) const;

  using Sums = ScoreSums;
  static constexpr int kFirstBlock = 128;  ///< observations
  void merge_blocks();
  static constexpr std::size_t kBlocks = 32;
  std::vector<std::uint8_t> seen_;  ///< 1 if observations of the landmark have been added
  std::vector<Sums> blocks_;        ///< blocks of the drive, each with per_block_ observations
  int per_block_ = kFirstBlock;
  int count_ = 0;
  bool counts_ = true;
  std::optional<ScoreClusters> clusters_;
};

/// Parameters that can be shown to be wrong by a test of the innovations.
enum class Suspect : std::uint8_t { Mounting, Scale, CameraLatency };

struct SystematicVerdict {
  Suspect suspect = Suspect::Mounting;
  double chi2 = 0;  ///< test statistic for the hypothesis that its errors are zero
  SystematicFit fit{};
  /// Second moment of the errors of mounting, scale and latency, for inclusion in the covariance of the
  /// estimate.
  SystematicMatrix second_moment = SystematicMatrix::Zero();
};

/// Wald tests for mounting, scale and latency, each in the presence of the others. The suspect is the
/// parameter that explains the most on its own. Empty if no parameter is both significant and large enough to
/// matter.
[[nodiscard]] std::optional<SystematicVerdict> test_systematic(const SystematicErrors& errors);
/// The finding as text: the suspect, its size, and the command that corrects it.
[[nodiscard]] std::string describe(const SystematicVerdict& verdict, bool corners);

}  // namespace waymark
