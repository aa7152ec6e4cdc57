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

/// A pose that observations have proposed, and who is for it.
struct Candidate {
  SE2 map_T_base{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< left tangent in map
  std::array<int, 4> landmarks{};                        ///< distinct ones that agree
  int distinct = 0;
  int support = 0;  ///< observations that agree
  int against = 0;  ///< since it is known
  std::int64_t age = 0;
  bool points_only = false;  ///< proposed by two points, whose distance alone speaks for it

  void add_landmark(int landmark);
};

/// Where a robot may be that does not know: candidates proposed by single observations, carried along by the
/// motion, and accepted when distinct landmarks agree. One tag alone is never accepted: its number may be
/// misread, it may hang elsewhere, and a flat square has two poses. Fixed size, no allocation.
class PoseHypotheses {
 public:
  explicit PoseHypotheses(const RiekfOptions& options);

  void propagate(const Eigen::Vector3d& twist, const Eigen::Vector3d& variances);
  void observe(std::span<const Observation> seen, const Landmarks& landmarks, const MountedSensor& sensor);
  /// The candidate that can be accepted: `tags` distinct landmarks agree, more is for it than against, and no
  /// other comes near. Points need one more when `contradicted`: an estimate that speaks against it.
  [[nodiscard]] const Candidate* acceptable(bool contradicted) const;
  /// The one with most support, to show something; nullptr when there is none.
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
  Lost,       ///< no estimate: no two landmarks agreed yet
  Uncertain,  ///< an estimate that is contradicted
  Certain,
};

/// Everything that going back in time must bring back.
struct TrackState {
  RiekfState filter{};
  TrackMode mode = TrackMode::Lost;
  SensorTime stamp{};
  bool started = false;  ///< the stamp means something
  SensorTime frame_stamp = SensorTime::min();
  std::uint64_t frame_number = 0;
  bool given = false;  ///< the start is somebody's word, and no tag has confirmed it yet
  bool contradicted = false;
  SensorTime contradicted_since{};
  int contradicting_frames = 0;   ///< in a row, up to the newest
  int agreeing_frames = 0;        ///< since it became uncertain
  std::array<int, 2> agreeing{};  ///< landmarks that agreed since
  int agreeing_distinct = 0;
  int starts = 0;
  bool no_way = false;        ///< odometry tells of none since the step before …
  bool wheels_stuck = false;  ///< … and tags show that the robot moves all the same
  SuddenHalt halt{};
  PoseHypotheses pose_hypotheses;
};

/// One step of a run, for a smoother: what was predicted from the step before, and what looks made of it.
struct TraceStep {
  SensorTime stamp{};
  int chain = 0;  ///< a new start begins a new chain
  bool certain = false;
  StateMatrix transition = StateMatrix::Identity();
  StateMatrix motion_in_common = StateMatrix::Zero();  ///< Riekf::last_motion_in_common()
  SE2 predicted{};                                     ///< covariances: but for the errors that stay
  SlowVector predicted_slow = SlowVector::Zero();
  StateMatrix predicted_P = StateMatrix::Zero();
  SE2 filtered{};
  SlowVector filtered_slow = SlowVector::Zero();
  StateMatrix filtered_P = StateMatrix::Zero();
  Eigen::Matrix3d lasting_P = Eigen::Matrix3d::Zero();  ///< what those errors add to that of the pose
};

/// The filter with what makes it survive: gates, contradiction, cold start, watching the tags. Time goes
/// forwards only; see RiekfLocalizer for samples that come late.
class Tracker {
 public:
  Tracker(Landmarks landmarks, MountedSensor sensor, const RiekfOptions& options, ErrorState error);

  void advance(const MotionStep& step, SensorTime to);
  /// A look at the time the track is at.
  void process(FrameObservations& frame);
  void start_at(SensorTime stamp);
  /// Starts from a pose that somebody gives, with deviations of x, y [m] and yaw [rad]. It is certain when
  /// the first tags agree, and given up at once when they do not.
  void start_from(const SE2& map_T_base, double sigma_m, double sigma_rad);
  /// The same in the middle of a run. What was learnt of motion and tags is kept.
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
  /// Starts that were given in the middle of a run.
  [[nodiscard]] int restarts() const { return restarts_; }
  /// Starts that were given and given up.
  [[nodiscard]] int refused_starts() const { return refused_starts_; }
  /// NIS of means over many observations of one tag, over their degrees of freedom: 1 when errors that stay
  /// are known to stay, more when they are taken for noise that averages away. Nothing before there are
  /// enough.
  [[nodiscard]] std::optional<double> lasting_nis() const { return lasting_.mean(); }
  [[nodiscard]] const LastingErrors& lasting() const { return lasting_; }
  /// What accepted observations tell of errors of mounting, scale and latency.
  [[nodiscard]] SystematicErrors& systematic() { return systematic_; }
  [[nodiscard]] const SystematicErrors& systematic() const { return systematic_; }
  /// Mounting, scale or latency, when the innovations show one of them to be wrong.
  [[nodiscard]] const std::optional<SystematicVerdict>& suspect() const { return suspect_; }
  /// What an earlier run over the same drive showed: the covariance covers it, from the start.
  void suspect(const SystematicVerdict& verdict) {
    suspect_ = verdict;
    suspected_before_ = true;
  }
  /// Odometry that tells of a standstill is right, whatever tags say: for who judges by other means who
  /// moved.
  void trust_standstill() { trusts_standstill_ = true; }
  /// A number that was suspected is another now: what was learnt of it counts no more.
  void forget_systematic();
  [[nodiscard]] bool sees_corners() const { return sees_corners_; }
  /// Keeps every step from now on, …
  void keep_trace() { tracing_ = true; }
  /// … or those of the last moments, with memory taken now: so long, and what samples may be late.
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
  /// Where the landmark would be by an observation that is rejected.
  void report_contradiction(const FrameObservations& frame, const Observation& observation);
  void search(const FrameObservations& frame);
  void learn_systematic(const Linearised& z, int place);
  void keep_step(SensorTime stamp);
  void keep_filtered();
  void check_sound();

  Landmarks landmarks_;
  MountedSensor sensor_;
  RiekfOptions options_;
  std::array<double, 9> gates_{};  ///< by degrees of freedom
  Riekf filter_;
  TrackState state_;
  TagWatch watch_;
  Riekf::Batch batch_{};
  std::array<Observation, FrameObservations::kMaxObservations> usable_{};
  std::array<Linearised, FrameObservations::kMaxObservations>
      accepted_linearised_{};  ///< what is accepted, at the estimate it was judged by
  std::vector<NisRecord> comparisons_;
  RiekfState before_detection_{};
  bool trusts_standstill_ = false;
  bool tracing_ = false;
  std::optional<Duration> trace_kept_{};  ///< nothing: all of it
  std::vector<TraceStep> trace_;
  int broken_ = 0;
  int refused_starts_ = 0;
  int restarts_ = 0;
  LastingErrors lasting_;
  SystematicErrors systematic_;
  std::optional<SystematicVerdict> suspect_{};
  bool suspected_before_ = false;
  int next_verdict_ = 0;  ///< at so many observations
  bool sees_corners_ = false;
};

}  // namespace waymark
