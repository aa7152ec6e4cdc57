#pragma once

#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

/// Initial poses for a bundle in which only some poses are known.
namespace waymark {

struct PlaceOptions {
  double two_poses_sigma_px = 0.5;  ///< corner noise assumed when the two poses of a square are compared
  int min_votes = 1;              ///< votes that must agree on a pose that does not belong to a single frame
  int min_unconfirmed_votes = 1;  ///< the same once unconfirmed terms vote
  /// The poses of the square of each corner term, if they are available.
  const std::vector<std::vector<internal::Hypothesis>>* squares = nullptr;
};

/// Prior information on a pose.
struct KnownPose {
  bool placed = false;                   ///< its value is a usable start
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
  bool moves = false;                    ///< pose of a single frame: placed as soon as one vote exists
};

/// Initialises poses from those that are placed, through the corner terms. If three of the four poses of a
/// term are placed, it votes for the fourth, once for each of the two poses of its square.
/// - Poses of single frames keep both hypotheses until one is ruled out.
/// - Other poses (tags, extrinsics, bodies) get the value that most of their votes agree on, the best
/// supported first, so a single bad view is never decisive.
/// - Unconfirmed terms vote only if no other term can place a pose.
/// - Motions (RelativeTerm) bridge frames without observations.
/// Returns which poses are placed. Terms with an unplaced pose are excluded (used = false). Deterministic.
std::vector<char> place_poses(Bundle& bundle, const std::vector<KnownPose>& known,
                              const PlaceOptions& options = {});

/// Re-initialises poses that are inconsistent with most of their observations, if another pose has more
/// support. For single frames, tries every pose that any of their tags suggests. Observations with a squared
/// error below `good_chi2` (8 degrees of freedom) count as support. Returns the number of poses moved.
int replace_contradicted(Bundle& bundle, const std::vector<char>& placed, const std::vector<KnownPose>& known,
                         double good_chi2, const PlaceOptions& options = {});

}  // namespace waymark
