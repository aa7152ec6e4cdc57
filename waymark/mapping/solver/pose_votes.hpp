#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/pose/agreement.hpp"

/// Initial poses from observations: votes, and which observations of a tag are confirmed by other
/// observations of it. A tag keeps its pose relative to its neighbours from image to image; a misread id does
/// not.
namespace waymark::internal {

/// A possible value of a pose.
struct Hypothesis {
  SE3 value{};
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
  double chi2 = 0;                       ///< excess over the best hypothesis
};

/// Which pose of a corner term.
enum class Role : std::uint8_t { Rig, Cam, Body, Tag };

[[nodiscard]] inline PoseIndex pose_of(const CornerTerm& term, Role role) {
  return std::array{term.rig, term.cam, term.body, term.tag}[static_cast<std::size_t>(role)];
}

/// The one or two poses cam_T_tag of a term; empty if its corners are not the image of a square.
[[nodiscard]] std::vector<Hypothesis> poses_of_square(const Bundle& bundle, const CornerTerm& term,
                                                      double corner_sigma_px);

/// Alternatives for one pose of a term, one for each combination of the hypotheses of the other three.
/// `of_poses`: hypotheses of rig, cam, body, tag (that of `role` is not read).
[[nodiscard]] Vote<SE3> vote_for(Role role, const std::array<const std::vector<Hypothesis>*, 4>& of_poses,
                                 const std::vector<Hypothesis>& squares);

/// An observation of a tag in a view. All observations of a view share a camera and a time.
struct ViewedTag {
  std::size_t view = 0;  ///< ascending with time
  std::size_t tag = 0;
  std::size_t body = 0;  ///< body of the tag; relative poses are constant only between tags of one body
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double size_px = 0;  ///< length of the longer diagonal; 0: the position in the image is not used
};

/// Motion of the camera from the previous view to this one; unknown if it was not measured.
struct ViewMotion {
  bool known = false;
  SE3 before_T_view{};
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
};

struct Confirmation {
  std::vector<char> unconfirmed{};  ///< by observation: it could have been confirmed but was not
  int min_votes = 2;  ///< this many wrong ids agree by chance in fewer than one of a hundred maps
};

/// `poses`: view_T_tag of each observation, one or two. Two observations of a tag confirm each other if one
/// of these holds:
/// - a neighbour in both views, or the motion between the views, gives the tag the same pose;
/// - the tag hardly moves in the image between successive views (misread ids come and go).
///
/// Observations that confirm each other, directly or through others, form a group. An observation is
/// unconfirmed if it is neither in the largest group of its tag nor in one of at least `min_votes`. The
/// observation of a view with no other tag and no known motion is never unconfirmed, because it cannot affect
/// other tags. O(observations * tags per view) at worst, O(observations) if ids are correct.
[[nodiscard]] Confirmation confirm_observations(const std::vector<ViewedTag>& seen,
                                                const std::vector<std::vector<Hypothesis>>& poses,
                                                const std::vector<ViewMotion>& motions);

}  // namespace waymark::internal
