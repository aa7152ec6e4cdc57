#pragma once

#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/pose_votes.hpp"

/// Where the search of a bundle starts when only some poses are known.
namespace waymark {

struct PlaceOptions {
  double two_poses_sigma_px = 0.5;  ///< of a corner, when the two poses of a square are compared
  int fewest_votes = 1;             ///< that must agree on a pose that is not of a single frame
  int fewest_doubtful_votes = 1;    ///< the same once votes in doubt count
  /// The poses of the square of each corner term, where they are known already.
  const std::vector<std::vector<internal::Hypothesis>>* squares = nullptr;
};

/// What is known of a pose before anything is placed.
struct KnownPose {
  bool placed = false;                   ///< its value stands near where it belongs
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
  bool moves = false;                    ///< seen in one frame only: placed as soon as anything is known
};

/// Places poses from those that are placed, through the corner terms: a term three of whose four poses are
/// placed votes for the fourth, once for each of the two poses a square has. Poses of single frames keep both
/// as long as nothing tells them apart; the others (tags, extrinsics, bodies) are placed by what most of
/// their votes agree on, the best supported first, so one bad view decides nothing; terms in doubt vote when
/// nothing else leads on. Motions (RelativeTerm) carry over frames that saw nothing. Returns which poses are
/// placed; terms that hang on others are set aside (used = false). Deterministic.
std::vector<char> place_poses(Bundle& bundle, const std::vector<KnownPose>& known,
                              const PlaceOptions& options = {});

/// Poses that most of their observations contradict are placed anew where more agree, single frames by trying
/// every pose any of their tags suggests. Observations with a squared error (8 numbers) of less than
/// `good_chi2` agree. How many poses were moved.
int replace_contradicted(Bundle& bundle, const std::vector<char>& placed, const std::vector<KnownPose>& known,
                         double good_chi2, const PlaceOptions& options = {});

}  // namespace waymark
