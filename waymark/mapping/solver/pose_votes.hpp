#pragma once

#include <array>
#include <optional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/pose/agreement.hpp"

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

}  // namespace waymark::internal
