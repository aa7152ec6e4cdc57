#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// What a list of errors amounts to, in their unit. All 0 when there is none.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double p95 = 0;  ///< 95 of 100 are no larger
  double max = 0;
};

/// Of the absolute values. O(n log n).
[[nodiscard]] ErrorStatistics statistics_of(std::vector<double> errors);

/// What may be moved before errors are measured. An answer in the map's own frame needs None; a trajectory in
/// a frame of its own (odometry) can be judged by its shape only.
enum class AlignmentKind : std::uint8_t { None, Se2, Se3, Sim3 };

/// "none", "se2", "se3", "sim3".
[[nodiscard]] std::string_view to_string(AlignmentKind kind);
[[nodiscard]] std::optional<AlignmentKind> alignment_kind(std::string_view word);

/// ref_p = scale * ref_R_est * est_p + ref_t.
struct Alignment {
  double scale = 1;
  SE3 ref_T_est{};

  [[nodiscard]] SE3 operator()(const SE3& est_T_base) const {
    return {ref_T_est.rotation() * est_T_base.rotation(),
            scale * (ref_T_est.rotation() * est_T_base.translation()) + ref_T_est.translation()};
  }
};

/// The alignment with the least sum of squared distances of positions (Umeyama, "Least-Squares Estimation of
/// Transformation Parameters Between Two Point Patterns", 1991, equations 40-42), as evo finds it
/// with its options align and correct_scale; se2 turns about z and shifts in x and y only. Fails
/// (InvalidArgument) on fewer than three pairs or positions that do not spread enough to tell a rotation.
/// O(pairs).
[[nodiscard]] Result<Alignment> align(const std::vector<PosePair>& pairs, AlignmentKind kind);

// How far a trajectory is from a path that is known without times: a tape on the floor, a route.

/// Corners of a path on the floor, joined by straight lines [m].
struct FloorPath {
  std::vector<Eigen::Vector2d> corners{};
  bool closed = false;  ///< from the last back to the first
};

struct PathScores {
  ErrorStatistics distance_m{};  ///< from the nearest point of the path
  /// Signed distances (left of it is positive) from the line of the side that points most as the robot does,
  /// however far it is: what one reads off by hand when each side is judged for itself.
  ErrorStatistics side_m{};
  double side_mean_m = 0;  ///< of the signed distances: an offset to one hand shows here
};

/// Nothing when the path has fewer than two corners or there is no estimate. O(estimates * corners).
[[nodiscard]] std::optional<PathScores> score_path(const EstimatedTrajectory& estimated,
                                                   const FloorPath& path);

/// The way of a trajectory, a corner each `step_m` or more.
[[nodiscard]] FloorPath floor_path(const Trajectory& trajectory, double step_m);

// How good a trajectory is against another that is known at each time.

struct TrajectoryScoreOptions {
  double rpe_delta_s = 1;
  double rpe_delta_m = 0;
  double max_gap_s = 0.5;
  double jump_m = 0.10;
  double jump_deg = 5;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.rpe_delta_s,
          Field{"rpe_delta_s", "Duration of the motions whose relative pose error (RPE) is computed.", 1e-3,
                1e6});
    visit(
        self.rpe_delta_m,
        Field{
            "rpe_delta_m",
            "Length of the motions whose relative pose error is computed; 0: motions are chosen by duration.",
            0, 1e6});
    visit(self.max_gap_s,
          Field{"max_gap_s", "Longest gap between two poses of the truth that is interpolated.", 1e-3, 1e6});
    visit(self.jump_m,
          Field{"jump_m",
                "Position step between consecutive estimates, beyond the true motion, that counts as a jump.",
                0});
    visit(self.jump_deg,
          Field{"jump_deg",
                "Rotation between consecutive estimates, beyond the true motion, that counts as a jump.", 0,
                180});
  }
};

/// How consistent the covariance of the estimate was with its errors, in x, y and yaw. Normalised estimation
/// error squared: e' P^-1 e (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and
/// Navigation", section 5.4.2).
struct Consistency {
  std::size_t count = 0;    ///< estimates that said a covariance that is one
  double nees_mean = 0;     ///< 3 when consistent; more: too small a covariance, less: too large
  double nees_median = 0;   ///< 2.37 when consistent
  double inside_95 = 0;     ///< share within the ellipsoid that 95 % should be in
  std::size_t refused = 0;  ///< whose covariance is not positive definite
};

/// Errors of the motion over a stretch (evo's relative pose error, translation part and rotation angle).
struct RelativeErrors {
  ErrorStatistics translation_m{};
  ErrorStatistics rotation_deg{};
};

struct TrajectoryScores {
  Alignment alignment{};
  ErrorStatistics ate_m{};  ///< distance in space at the same time, after alignment
  ErrorStatistics rotation_deg{};
  ErrorStatistics heading_deg{};  ///< yaw alone
  RelativeErrors relative{};
  std::optional<Consistency> consistency{};  ///< nothing when no estimate said what it doubts
  std::size_t jumps = 0;
  double end_error_m = 0;  ///< of the last estimate
};

/// Scores estimates against where the reference was, pairs as pair_by_time makes them. Fails when there is
/// none, or they do not align. O(pairs log pairs).
[[nodiscard]] Result<TrajectoryScores> score_trajectory(const std::vector<PosePair>& pairs,
                                                        AlignmentKind kind,
                                                        const TrajectoryScoreOptions& options = {});

/// From one pair to the next: how often the estimate moved otherwise than the reference by more than the
/// options allow. Over gaps nothing is counted.
[[nodiscard]] std::size_t count_jumps(const std::vector<PosePair>& pairs,
                                      const TrajectoryScoreOptions& options);

/// The share of [from, to] in which there is an estimate within the gap allowed.
[[nodiscard]] double covered_share(const EstimatedTrajectory& estimated, SensorTime from, SensorTime to,
                                   Duration max_gap);

}  // namespace waymark
