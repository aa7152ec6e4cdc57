#pragma once

#include <cstddef>
#include <optional>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/alignment.hpp"
#include "waymark/evaluation/error_statistics.hpp"

/// How good a trajectory is against another that is known at each time.
namespace waymark {

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
