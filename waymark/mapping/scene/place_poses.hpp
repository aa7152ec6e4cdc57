#pragma once

#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

/// Computes initial poses for a bundle in which only some poses are known.
namespace waymark {

struct PlaceOptions {
  /// Corner noise that is assumed when the two poses of a square are compared.
  double two_poses_sigma_px = 0.5;
  int min_votes = 1;              ///< votes that must agree on a pose that does not belong to a single frame
  int min_unconfirmed_votes = 1;  ///< the same, once unconfirmed terms vote
  /// Motions carry the pose of a frame to frames that see no placed tag, until the standard deviations of
  /// the position and rotation reach these.
  double max_carried_m = 2.0, max_carried_rad = 0.3;
  /// The poses of each corner term's square, if they are available.
  const std::vector<std::vector<internal::Hypothesis>>* squares = nullptr;
};

/// Prior information on a pose.
struct KnownPose {
  bool placed = false;                   ///< its value is usable as a start
  Matrix6 covariance = Matrix6::Zero();  ///< in the left tangent
  bool moves = false;  ///< the pose belongs to a single frame, so it is placed as soon as there is one vote
};

/// Initialises poses from those that have been placed, using the corner terms. If three of the four poses of
/// a term are placed, it votes for the fourth, once for each of the two poses of its square.
/// - Poses of single frames keep both hypotheses until one is ruled out.
/// - Other poses (tags, extrinsics, bodies) are given the value that most of their votes agree on, with the
/// best-supported poses first, so that a single bad view is never decisive.
/// - Motions (RelativeTerm) carry poses to frames that see no placed tag, if no observation can place a pose.
///   The tags in these frames are then placed, those that are determined best first.
/// - Unconfirmed terms vote only if no other term or motion can place a pose.
/// Returns which poses are placed. Terms with an unplaced pose are excluded (used = false). Deterministic.
std::vector<char> place_poses(Bundle& bundle, const std::vector<KnownPose>& known,
                              const PlaceOptions& options = {});

/// Re-initialises poses that are inconsistent with most of their observations, if another pose has more
/// support. For the pose of a single frame, tries every pose that any tag in it suggests. Observations with a
/// squared error below `good_chi2` (8 degrees of freedom) count as support. Returns the number of poses
/// moved.
int replace_contradicted(Bundle& bundle, const std::vector<char>& placed, const std::vector<KnownPose>& known,
                         double good_chi2, const PlaceOptions& options = {});

}  // namespace waymark
