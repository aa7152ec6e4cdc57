#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/pose/agreement.hpp"

/// Votes of observations for initial poses, and a test of which observations of a tag are confirmed by other
/// observations of the same tag. A tag keeps its pose relative to its neighbours from image to image; a
/// misread id does not.
namespace waymark::internal {

/// A possible value of a pose.
struct Hypothesis {
  SE3 value{};
  Matrix6 covariance = Matrix6::Zero();  ///< in the left tangent
  double chi2 = 0;                       ///< excess over the chi2 of the best hypothesis
};

/// The poses of a corner term.
enum class Role : std::uint8_t { Rig, Cam, Body, Tag };

[[nodiscard]] inline PoseIndex pose_of(const CornerTerm& term, Role role) {
  return std::array{term.rig, term.cam, term.body, term.tag}[static_cast<std::size_t>(role)];
}

/// The one or two poses cam_T_tag of a term; empty if its corners cannot be the image of a square.
[[nodiscard]] std::vector<Hypothesis> poses_of_square(const Bundle& bundle, const CornerTerm& term,
                                                      double corner_sigma_px);

/// Alternatives for one pose of a term, one for each combination of the hypotheses of the other three.
/// `of_poses`: the hypotheses for rig, cam, body and tag (those for `role` are not read).
[[nodiscard]] Vote<SE3> vote_for(Role role, const std::array<const std::vector<Hypothesis>*, 4>& of_poses,
                                 const std::vector<Hypothesis>& squares);

/// An observation of a tag in a view. All observations in a view share a camera and a time.
struct ViewedTag {
  std::size_t view = 0;  ///< ascending in time
  std::size_t tag = 0;
  /// The body that the tag is on; relative poses are constant only between tags on the same body.
  std::size_t body = 0;
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double size_px = 0;  ///< length of the longer diagonal; 0 if the position in the image is not to be used
};

/// Motion of the camera from the previous view to this one; unknown if it was not measured.
struct ViewMotion {
  bool known = false;
  SE3 before_T_view{};
  Matrix6 covariance = Matrix6::Zero();  ///< in the left tangent
};

struct Confirmation {
  /// For each observation, whether it could have been confirmed but was not.
  std::vector<char> unconfirmed{};
  std::vector<std::size_t> groups{};  ///< for each observation, the first one of its group
  int min_votes = 2;  ///< this many wrong ids agree by chance in less than one map in a hundred
};

/// `poses`: the one or two poses view_T_tag of each observation. Two observations of a tag confirm each other
/// if at least one of these conditions holds:
/// - the tag has the same pose according to a neighbour in both views or to the motion between the views;
/// - the tag hardly moves in the image between successive views (misread ids come and go).
///
/// Two observations in one view never do, because they show two tags. If a view shows a tag several times,
/// only the one that fits best confirms an observation in another view.
///
/// Observations that confirm each other, directly or through others, form a group. A group has at most one
/// observation in each view. An observation is
/// unconfirmed if it is neither in the largest group of its tag nor in a group of at least `min_votes`. An
/// observation in a view with no other tag and no known motion is never unconfirmed, because it cannot affect
/// other tags. O(observations * tags per view) in the worst case, O(observations) if the ids are correct.
[[nodiscard]] Confirmation confirm_observations(const std::vector<ViewedTag>& seen,
                                                const std::vector<std::vector<Hypothesis>>& poses,
                                                const std::vector<ViewMotion>& motions);

}  // namespace waymark::internal
