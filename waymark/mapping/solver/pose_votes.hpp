#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/pose/agreement.hpp"

/// What observations say of poses before anything is placed: votes, and which observations of a tag are
/// confirmed by other observations of it (a tag keeps its place among its neighbours from picture to picture,
/// a misread id does not).
namespace waymark::internal {

/// A value a pose may have.
struct Hypothesis {
  SE3 value{};
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
  double chi2 = 0;                       ///< how much worse than the best one
};

/// Which pose of a corner term.
enum class Role : std::uint8_t { Rig, Cam, Body, Tag };

[[nodiscard]] inline PoseIndex pose_of(const CornerTerm& term, Role role) {
  return std::array{term.rig, term.cam, term.body, term.tag}[static_cast<std::size_t>(role)];
}

/// The one or two poses cam_T_tag of a term; none when its corners are no image of a square.
[[nodiscard]] std::vector<Hypothesis> poses_of_square(const Bundle& bundle, const CornerTerm& term,
                                                      double corner_sigma_px);

/// What a term says about one of its poses, for every combination of what the other three may be.
/// `of_poses`: hypotheses of rig, cam, body, tag (that of `role` is not read).
[[nodiscard]] Vote<SE3> vote_for(Role role, const std::array<const std::vector<Hypothesis>*, 4>& of_poses,
                                 const std::vector<Hypothesis>& squares);

/// A tag in a view. Observations of a view share a camera and a time.
struct ViewedTag {
  std::size_t view = 0;  ///< ascending with time
  std::size_t tag = 0;
  std::size_t body = 0;  ///< the tag is on; only tags of a body keep their places to each other
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double size_px = 0;  ///< of its diagonals, the longer; 0: where it is in the image is not considered
};

/// Where a view's camera is from that of the view before; nothing where nobody measured the motion.
struct ViewMotion {
  bool known = false;
  SE3 before_T_view{};
  Matrix6 covariance = Matrix6::Zero();  ///< left tangent
};

struct Confirmation {
  std::vector<char> doubtful{};  ///< by observation: it could have been confirmed and was not
  int fewest_votes = 2;          ///< so many wrong ids agree by chance in less than one map of a hundred
};

/// `poses`: view_T_tag of each observation, one or two. Two observations of a tag confirm each other when a
/// neighbour that both views show, or the motion between them, puts it in the same place, or when it hardly
/// moves in the image from one view to the next (misread ids come and go); those that hang together so are a
/// group. In doubt is what is not in the largest group of its tag nor in one of at least
/// `fewest_votes`. A view that shows nothing else and whose motion is not known cannot mislead: its
/// observation is never in doubt. O(observations * tags of a view) at worst, O(observations) where ids are
/// right.
[[nodiscard]] Confirmation confirm_observations(const std::vector<ViewedTag>& seen,
                                                const std::vector<std::vector<Hypothesis>>& poses,
                                                const std::vector<ViewMotion>& motions);

}  // namespace waymark::internal
