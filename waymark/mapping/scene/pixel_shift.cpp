#include "waymark/mapping/scene/pixel_shift.hpp"

#include <algorithm>
#include <limits>

namespace waymark {

std::optional<double> largest_shift_px(const Bundle& bundle, PoseIndex pose, const SE3& other) {
  std::optional<double> largest;
  for (const CornerTerm& term : bundle.corners) {
    const bool depends = term.rig == pose || term.cam == pose || term.body == pose || term.tag == pose;
    if (!term.used || !depends) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    const CornerPoses poses = poses_of(bundle, term);
    CornerPoses changed = poses;
    if (term.rig == pose) changed.map_T_rig = other;
    if (term.cam == pose) changed.rig_T_cam = other;
    if (term.body == pose) changed.map_T_body = other;
    if (term.tag == pose) changed.body_T_tag = other;
    const auto now = corner_residual(plain, bundle.cameras[term.camera], poses);
    const auto then = corner_residual(plain, bundle.cameras[term.camera], changed);
    if (!now || !then) return std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < 4; ++k)
      largest = std::max(largest.value_or(0), (*now - *then).segment<2>(2 * k).norm());
  }
  return largest;
}

}  // namespace waymark
