#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "waymark/localization/method.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/timeline.hpp"
#include "waymark/localization/watches.hpp"

namespace waymark {

/// A pose hypothesis proposed by observations, with the evidence for it.
struct Candidate {
  SE2 map_T_base{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< left tangent in map
  std::array<int, 4> landmarks{};                        ///< distinct landmarks that agree
  int distinct = 0;
  int support = 0;  ///< number of observations that agree
  int against = 0;  ///< number of observations that have disagreed since it was proposed
  std::int64_t age = 0;
  bool points_only = false;  ///< proposed by two points, with only their distance as evidence

  void add_landmark(int landmark);
};

/// Pose hypotheses for use while the pose is unknown. Single observations propose them, the motion propagates
/// them, and one is accepted when distinct landmarks agree on it. One tag alone is never enough: its number
/// may have been misread, it may have been moved, and a planar square has two poses. Has a fixed size and
/// does not allocate.
class PoseHypotheses {
 public:
  explicit PoseHypotheses(const RiekfOptions& options);

  void propagate(const Eigen::Vector3d& twist, const Eigen::Vector3d& variances);
  void observe(std::span<const Observation> seen, const Landmarks& landmarks, const MountedSensor& sensor);
  /// The candidate that can be accepted; nullptr if there is none. The required number of distinct landmarks
  /// must agree with it, more observations must agree than disagree, and no other candidate may be close in
  /// score. Points need one more landmark if `contradicted` is set, that is, if an existing estimate
  /// disagrees.
  [[nodiscard]] const Candidate* acceptable(bool contradicted) const;
  /// The candidate with the most support, for display; nullptr if there is none.
  [[nodiscard]] const Candidate* best() const;
  void clear() { count_ = 0; }

 private:
  static constexpr std::size_t kMaxCandidates = 24;
  [[nodiscard]] bool support(Candidate& candidate, const Observation& observation, const Guesses& guesses,
                             const Landmarks& landmarks, const MountedSensor& sensor) const;
  void propose(const Guess& guess, int landmark, int other);

  RiekfOptions options_;
  double gate3_;
  double gate2_;
  std::array<Candidate, kMaxCandidates> all_{};
  std::size_t count_ = 0;
  std::int64_t clock_ = 0;
};

enum class TrackMode : std::uint8_t {
  Lost,       ///< no estimate: no two landmarks have agreed yet
  Uncertain,  ///< the estimate is contradicted
  Certain,
};

/// The complete state that is restored by a rewind.
struct TrackState {
  RiekfState filter{};
  TrackMode mode = TrackMode::Lost;
  SensorTime stamp{};
  bool started = false;  ///< the stamp is valid
  SensorTime frame_stamp = SensorTime::min();
  std::uint64_t frame_number = 0;
  bool given = false;  ///< the start pose was given, and no tag has confirmed it yet
  bool contradicted = false;
  SensorTime contradicted_since{};
  int contradicting_frames = 0;   ///< number of consecutive contradicting frames, up to the newest
  int agreeing_frames = 0;        ///< number since it became uncertain
  std::array<int, 2> agreeing{};  ///< landmarks that have agreed since then
  int agreeing_distinct = 0;
  int starts = 0;
  bool no_translation = false;  ///< the latest odometry step contains no translation
  bool wheels_stuck = false;    ///< odometry reports no motion, but tags show that the robot is moving
  SuddenHalt halt{};
  PoseHypotheses pose_hypotheses;
};

/// One step of a run, for use by a smoother: the prediction from the previous step and the result of the
/// update.
struct TraceStep {
  SensorTime stamp{};
  int chain = 0;  ///< a new start begins a new chain
  bool certain = false;
  StateMatrix transition = StateMatrix::Identity();
  StateMatrix motion_cross_covariance = StateMatrix::Zero();  ///< Riekf::last_motion_cross_covariance()
  SE2 predicted{};  ///< covariances are conditional on the considered errors
  SlowVector predicted_slow = SlowVector::Zero();
  StateMatrix predicted_P = StateMatrix::Zero();
  SE2 filtered{};
  SlowVector filtered_slow = SlowVector::Zero();
  StateMatrix filtered_P = StateMatrix::Zero();
  Eigen::Matrix3d lasting_P = Eigen::Matrix3d::Zero();  ///< pose covariance added by the considered errors
};

/// The filter with gating, contradiction tests, initialisation and tag watch. Time only moves forward;
/// RiekfLocalizer handles late samples.
class Tracker {
 public:
  Tracker(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options, ErrorState error);

  void advance(const MotionStep& step, SensorTime to);
  /// Processes a frame whose stamp is the current time of the track.
  void process(FrameObservations& frame);
  void start_at(SensorTime stamp);
  /// Starts from a given pose with the standard deviations of x, y [m] and yaw [rad]. The pose becomes
  /// certain when the first tags agree, and is dropped as soon as they do not.
  void start_from(const SE2& map_T_base, double sigma_m, double sigma_rad);
  /// Restarts from a given pose during a run. Estimates of slow motion errors and tag statistics are kept.
  void restart_from(const GivenPose& given);

  [[nodiscard]] const TrackState& state() const { return state_; }
  void save(TrackState& to) const;
  void restore(const TrackState& from);

  [[nodiscard]] std::optional<LocalizationEstimate> estimate() const;
  [[nodiscard]] const Landmarks& landmarks() const { return landmarks_; }
  [[nodiscard]] const MountedSensor& mounted_sensor() const { return sensor_; }
  [[nodiscard]] const RiekfOptions& options() const { return options_; }
  [[nodiscard]] const TagWatch& watch() const { return watch_; }
  [[nodiscard]] const RiekfState& filter_state() const { return filter_.state(); }
  [[nodiscard]] std::vector<NisRecord>& comparisons() { return comparisons_; }
  [[nodiscard]] const std::vector<NisRecord>& comparisons() const { return comparisons_; }
  [[nodiscard]] int broken() const { return broken_; }
  /// Number of poses that were given during the run.
  [[nodiscard]] int restarts() const { return restarts_; }
  /// Number of given poses that were refuted by tags.
  [[nodiscard]] int refused_starts() const { return refused_starts_; }
  /// NIS of means over many observations of one tag, divided by their degrees of freedom. It is about 1 if
  /// lasting errors are modelled as such, and larger if they are modelled as noise that averages out. Empty
  /// until there are enough means.
  [[nodiscard]] std::optional<double> lasting_nis() const { return lasting_.mean(); }
  [[nodiscard]] const LastingErrors& lasting() const { return lasting_; }
  /// Evidence from accepted observations about errors of mounting, scale and latency.
  [[nodiscard]] SystematicErrors& systematic() { return systematic_; }
  [[nodiscard]] const SystematicErrors& systematic() const { return systematic_; }
  /// The parameter (mounting, scale or latency) that is wrong according to the innovations, if any.
  [[nodiscard]] const std::optional<SystematicVerdict>& suspect() const { return suspect_; }
  /// Sets the verdict from an earlier run over the same drive, so that the covariance includes the error from
  /// the start.
  void suspect(const SystematicVerdict& verdict) {
    suspect_ = verdict;
    suspected_before_ = true;
  }
  /// Accepts a standstill reported by odometry even if tags contradict it. For callers that detect motion by
  /// other means.
  void trust_standstill() { trust_standstill_ = true; }
  /// Discards the evidence about systematic errors, for use after one of the suspected parameters has
  /// changed.
  void forget_systematic();
  [[nodiscard]] bool sees_corners() const { return sees_corners_; }
  /// Keeps every step of the run from now on.
  void keep_trace() { tracing_ = true; }
  /// Keeps the steps from the last `lag`, plus the time by which samples may be late. Memory is allocated
  /// here.
  void keep_trace(Duration lag);
  [[nodiscard]] const std::vector<TraceStep>& trace() const { return trace_; }

 private:
  struct Verdict {
    std::array<const Observation*, FrameObservations::kMaxObservations> accepted{};
    std::size_t accepted_count = 0;
    std::size_t rejected_count = 0;
  };
  [[nodiscard]] Verdict gate(FrameObservations& frame);
  void detect_stuck_wheels(const FrameObservations& frame, double since_s);
  [[nodiscard]] bool all_fit(const FrameObservations& frame, bool most_contradict);
  void update(const Verdict& verdict);
  void update_mode(const Verdict& verdict, const FrameObservations& frame);
  void count_agreement(const Verdict& verdict);
  void count_contradiction(const FrameObservations& frame);
  void report(const FrameObservations& frame, const Observation& observation, const Linearised& z, double nis,
              bool accepted, int place);
  /// Records the position that a rejected observation implies for its landmark.
  void report_contradiction(const FrameObservations& frame, const Observation& observation);
  void search(const FrameObservations& frame);
  void learn_systematic(const Linearised& z, int place);
  void keep_step(SensorTime stamp);
  void keep_filtered();
  void check_sound();

  Landmarks landmarks_;
  MountedSensor sensor_;
  RiekfOptions options_;
  std::array<double, 9> gates_{};  ///< indexed by degrees of freedom
  Riekf filter_;
  TrackState state_;
  TagWatch watch_;
  Riekf::Batch batch_{};
  std::array<Observation, FrameObservations::kMaxObservations> usable_{};
  std::array<Linearised, FrameObservations::kMaxObservations>
      accepted_linearised_{};  ///< accepted observations, linearised at the estimate used for gating
  std::vector<NisRecord> comparisons_;
  RiekfState before_detection_{};
  bool trust_standstill_ = false;
  bool tracing_ = false;
  std::optional<Duration> trace_kept_{};  ///< if empty, the whole run is kept
  std::vector<TraceStep> trace_;
  int broken_ = 0;
  int refused_starts_ = 0;
  int restarts_ = 0;
  LastingErrors lasting_;
  SystematicErrors systematic_;
  std::optional<SystematicVerdict> suspect_{};
  bool suspected_before_ = false;
  int next_verdict_ = 0;  ///< number of observations after which the next test runs
  bool sees_corners_ = false;
};

}  // namespace waymark
