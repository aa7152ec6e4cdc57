#pragma once

#include <cstddef>
#include <vector>

#include "waymark/mapping/scene/scene_map.hpp"

/// Odometry between frames is measured, so it can be wrong: a wheel slips, or a person moves the robot. Here,
/// it is compared with the observations. The unit is a span: the steps of odometry between two successive
/// frames in which observations in use place the body. Observations do not show which step of a span is
/// wrong.
namespace waymark {

/// Whether the map contains odometry that the search may reject.
[[nodiscard]] bool has_odometry(const SceneMap& map);

/// Applies the robust loss of the search to odometry, and keeps its given noise for
/// multiply_odometry_noise().
void judge_odometry(SceneMap& map);

/// Changes the noise of odometry to `ratio` times its present noise, but to no less than the given noise.
/// Returns the factor by which the noise has changed.
double multiply_odometry_noise(SceneMap& map, double ratio);

/// The ratio of actual to present noise of odometry, if observations alone determine the motion of most
/// spans; otherwise, it is too small. It is the median over the spans; 1 if there are fewer than 20.
[[nodiscard]] double rough_odometry_ratio(const SceneMap& map);

/// The ratio of actual to present noise of odometry. The redundancy of each component of each span is taken
/// from the covariance, and components with a small redundancy are omitted (Foerstner, "Ein Verfahren zur
/// Schaetzung von Varianz- und Kovarianzkomponenten", 1979, with a median instead of a mean). It is 1 for
/// fewer than 20 spans with redundant components. Costs one covariance().
[[nodiscard]] double odometry_ratio(const SceneMap& map);

/// Whether a map whose search trusted odometry suggests that odometry is wrong: a span contradicts the
/// observations, many observations are rejected, or those of several tags in successive frames.
[[nodiscard]] bool contradicts_odometry(const SceneMap& map, double outlier_chi2);

struct ExplanationOptions {
  double corner_ratio = 1, odometry_ratio = 1;  ///< noise to compute with, relative to that of the map
  double outlier_chi2 = 26.1;
  bool trusts_odometry = false;
};

/// Rejected observations of one tag cost no more than this number, because the tag may have been moved, or
/// another tag may have its id.
inline constexpr int kMaxRejectedOfTag = 20;

/// The cost of one rejected observation.
[[nodiscard]] double cost_of_rejected(double outlier_chi2);

/// Half the excess of chi-square over its expected value. Rejected observations of one tag cost no more than
/// kMaxRejectedOfTag of them. Unless odometry is trusted, spans that contradict the observations cost as much
/// as 25 of them, so one tag cannot refute odometry, but two can. A second such time costs as much as 75,
/// because two motions that return to the same place may be tags of the same number. Each further one
/// costs 20. Spans that follow each other closely, as during a slip, cost 2 each.
[[nodiscard]] double cost_of_explanation(const SceneMap& map, const ExplanationOptions& options);

/// Spans before and after some frames may contradict the observations, although the odometry from the first
/// to the last of these spans does not. The observations in these frames are then wrong. Places the frames by
/// odometry and stops using these observations.
void restore_contradicted_frames(SceneMap& map);

/// Rejects spans that contradict the observations, and uses those again that do not. A span that alone
/// connects tags is never rejected. Returns whether anything has changed.
bool gate_odometry(SceneMap& map);

/// Fills in the rejected odometry and the tags that odometry alone connects.
void report_odometry(const SceneRecording& recording, SceneMap& map);

}  // namespace waymark
