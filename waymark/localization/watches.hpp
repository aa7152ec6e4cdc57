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

/// What an observation says about the landmark, at the estimate it was compared with.
struct WatchedObservation {
  int landmark = 0;
  double nis_per_row = 0;
  bool accepted = false;
  Eigen::Vector2d map_p_implied = Eigen::Vector2d::Zero();  ///< where the landmark would be
  double range_ratio = 1;                                   ///< distance as measured over as expected
  double off_direction_rad = 0;                             ///< beside the expected line of sight
};

/// Statistics of what each landmark of the map is seen to do, and what they mean in words. A landmark that
/// contradicts while the others agree is not used any more, until it fits again.
class TagWatch {
 public:
  explicit TagWatch(const Landmarks& landmarks);

  /// Of an observation that was accepted, or of one that was not.
  void add(const WatchedObservation& seen);
  /// The estimate was confirmed by landmarks that were accepted: what contradicted since the last time was
  /// really wrong.
  void confirm();
  /// The estimate was wrong, not the landmarks.
  void forget_pending();

  [[nodiscard]] bool usable(int landmark) const { return !at(landmark).excluded; }
  /// "tag36h11:5 and tag36h11:6 are swapped in the map …"; in order of id.
  [[nodiscard]] std::vector<std::string> findings() const;
  /// Mean NIS over its degrees of freedom of the observations that were accepted; 0 when there are none.
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

/// Wheels that stop within one message, harder than a robot can: their encoders may have failed, and the
/// robot may go on as fast as it went. Until tags have said that it stands, its way is uncertain by as much.
class SuddenHalt {
 public:
  /// The step with the variance that the suspicion adds: of the position, and of the heading where no gyro
  /// tells of it. Constant time.
  [[nodiscard]] MotionStep advance(MotionStep step);
  [[nodiscard]] bool suspected() const { return suspected_; }
  /// Tags of a picture corrected the position by so much: by almost nothing where the robot stands.
  void observe_correction(double moved_m);

 private:
  double speed_m_s_ = 0;  ///< of the last step that told of a way
  double yaw_rate_rad_s_ = 0;
  double since_s_ = 0;  ///< the halt, or the newest picture with tags after it
  bool suspected_ = false;
};

/// Do residuals of one landmark average away as fast as the filter believes? The mean of n whitened residuals
/// has the covariance S - I (what stays, or is the state's) + I / n; a filter that takes a lasting error for
/// noise finds means far beyond that although every single residual looks right. After Bar-Shalom, Li and
/// Kirubarajan, "Estimation with Applications to Tracking and Navigation", section 5.4.2 (tests on
/// autocorrelation), for a filter whose innovations may be correlated. No allocation.
class LastingErrors {
 public:
  explicit LastingErrors(int landmarks) : all_(static_cast<std::size_t>(landmarks)) {}

  /// A residual and the covariance of its innovation.
  void add(const Linearised& z, const Eigen::Matrix<double, 8, 8>& S);
  /// NIS of the means so far over their degrees of freedom; nothing when they are few.
  [[nodiscard]] std::optional<double> mean() const;
  /// Sums over those means: twice their negative log-likelihood, without its constant, and degrees of
  /// freedom.
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double freedom() const { return freedom_; }

 private:
  struct Sums {
    Eigen::Matrix<double, 8, 1> residual = Eigen::Matrix<double, 8, 1>::Zero();
    Eigen::Matrix<double, 8, 8> S = Eigen::Matrix<double, 8, 8>::Zero();
    int count = 0;
  };
  std::vector<Sums> all_;
  double nis_ = 0;
  double cost_ = 0;
  double freedom_ = 0;
  int means_ = 0;
};

/// What some innovations tell of the numbers of kSystematic: information and score of their likelihood.
struct ScoreSums {
  SystematicMatrix information = SystematicMatrix::Zero();
  SystematicVector score = SystematicVector::Zero();
  int count = 0;

  ScoreSums& operator+=(const ScoreSums& other);
};

/// Innovations of a drive in two kinds of groups: those of one landmark share the error with which it hangs
/// and was printed as long as it is seen, and those of one moment share the errors of the motion.
class ScoreClusters {
 public:
  void add(int landmark, SensorTime stamp, const ScoreSums& score);
  /// Of each number, where `value` is the maximum of a likelihood of this information, all innovations and
  /// what was known before included: the variance by landmarks plus that by moments less that by what is
  /// both (Cameron, Gelbach and Miller, "Robust Inference With Multiway Clustering", Journal of Business and
  /// Economic Statistics 29(2), 2011, equation (2.13)), at least either of the first two. Each is that of the
  /// jackknife, which few groups, and unlike ones, do not make too small (Bell and McCaffrey, "Bias Reduction
  /// in Standard Errors for Linear Regression with Multi-Stage Samples", Survey Methodology 28(2), 2002).
  /// Landmarks, or moments, of which there are fewer than four count as nothing.
  [[nodiscard]] SystematicVector variances(const SystematicMatrix& information,
                                           const SystematicVector& value) const;

 private:
  std::map<std::pair<std::int64_t, int>, ScoreSums> sums_;  ///< by moment and landmark
};

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
enum class Suspect : std::uint8_t { Mounting, Scale, CameraLatency };

struct SystematicVerdict {
  Suspect suspect = Suspect::Mounting;
  double chi2 = 0;  ///< of its errors being zero
  SystematicFit fit{};
  /// Second moment of the errors of mounting, scale and latency: what the stated covariance must cover.
  SystematicMatrix second_moment = SystematicMatrix::Zero();
};

/// Wald tests of mounting, scale and latency, each beside the others; the one that alone explains most is the
/// suspect. Nothing when none is significant and large enough to matter.
[[nodiscard]] std::optional<SystematicVerdict> test_systematic(const SystematicErrors& errors);
/// The suspect with its size, and the command that mends it.
[[nodiscard]] std::string describe(const SystematicVerdict& verdict, bool corners);

}  // namespace waymark
