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

/// Statistics of a list of errors, in the unit of the errors. All are 0 for an empty list.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double p95 = 0;  ///< 95th percentile
  double max = 0;
};

/// Statistics of the absolute values of the errors. O(n log n).
[[nodiscard]] ErrorStatistics statistics_of(std::vector<double> errors);

/// Alignment applied before errors are measured. An estimate in the map frame needs None; for a trajectory in
/// its own frame (odometry), only the shape can be compared.
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

/// The alignment that minimises the sum of squared distances between positions (Umeyama, "Least-Squares
/// Estimation of Transformation Parameters Between Two Point Patterns", 1991, equations 40-42), as in evo
/// with the options align and correct_scale. For se2, it only rotates about z and translates in x and y.
/// Fails (InvalidArgument) if there are fewer than three pairs or the positions are not spread out enough to
/// determine a rotation. O(pairs).
[[nodiscard]] Result<Alignment> align(const std::vector<PosePair>& pairs, AlignmentKind kind);

// Distance between a trajectory and a path without timestamps, e.g. tape on the floor or a route.

/// Corners of a path on the floor, connected by straight lines [m].
struct FloorPath {
  std::vector<Eigen::Vector2d> corners{};
  bool closed = false;  ///< whether the last corner is connected to the first
};

struct PathScores {
  ErrorStatistics distance_m{};  ///< distance to the nearest point on the path
  /// Signed distances (positive to the left) from the line through the side whose direction is closest to the
  /// heading of the robot, however far away it is. These are the values one reads off by hand when evaluating
  /// each side separately.
  ErrorStatistics side_m{};
  double side_mean_m = 0;  ///< mean of the signed distances, which reveals a constant offset to one side
};

/// `nullopt` if the path has fewer than two corners or there are no estimates. O(estimates * corners).
[[nodiscard]] std::optional<PathScores> score_path(const EstimatedTrajectory& estimated,
                                                   const FloorPath& path);

/// The path of a trajectory, with corners at least `step_m` apart.
[[nodiscard]] FloorPath floor_path(const Trajectory& trajectory, double step_m);

// Errors of a trajectory relative to another one, both with timestamps.

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

/// Consistency between the covariance of the estimate and its errors in x, y and yaw. Normalised estimation
/// error squared: e' P^-1 e (Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and
/// Navigation", section 5.4.2).
struct Consistency {
  std::size_t count = 0;    ///< number of estimates with a positive definite covariance
  double nees_mean = 0;     ///< 3 if consistent; larger if the covariance is too small
  double nees_median = 0;   ///< 2.37 if consistent
  double inside_95 = 0;     ///< fraction within the 95 % ellipsoid
  std::size_t refused = 0;  ///< number of estimates whose covariance is not positive definite
};

/// Errors of the motion over a given duration or length (evo's relative pose error: translation part and
/// rotation angle).
struct RelativeErrors {
  ErrorStatistics translation_m{};
  ErrorStatistics rotation_deg{};
};

struct TrajectoryScores {
  Alignment alignment{};
  ErrorStatistics ate_m{};  ///< 3D distance at equal times, after alignment
  ErrorStatistics rotation_deg{};
  ErrorStatistics heading_deg{};  ///< error in yaw alone
  RelativeErrors relative{};
  std::optional<Consistency> consistency{};  ///< `nullopt` if no estimate has a covariance
  std::size_t jumps = 0;
  double end_error_m = 0;  ///< position error of the last estimate
};

/// Scores estimates relative to a reference, using the `pairs` returned by pair_by_time(). Fails if there are
/// no pairs or the alignment fails. O(pairs log pairs).
[[nodiscard]] Result<TrajectoryScores> score_trajectory(const std::vector<PosePair>& pairs,
                                                        AlignmentKind kind,
                                                        const TrajectoryScoreOptions& options = {});

/// Number of steps between consecutive pairs in which the motion of the estimate differs from that of the
/// reference by more than the options allow. Gaps are not counted.
[[nodiscard]] std::size_t count_jumps(const std::vector<PosePair>& pairs,
                                      const TrajectoryScoreOptions& options);

/// The fraction of [from, to] that is covered by estimates no further apart than the maximum gap.
[[nodiscard]] double covered_share(const EstimatedTrajectory& estimated, SensorTime from, SensorTime to,
                                   Duration max_gap);

}  // namespace waymark
