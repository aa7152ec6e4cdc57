#include "waymark/mapping/scene/pixel_shift.hpp"

#include <algorithm>
#include <limits>

namespace waymark {

std::optional<double> largest_shift_px(const Bundle& bundle, PoseIndex pose, const SE3& other) {
  std::optional<double> largest;
  const auto value = [&](PoseIndex i, bool changed) {
    return changed && i == pose ? other : bundle.poses[i].value;
  };
  for (const CornerTerm& term : bundle.corners) {
    const bool depends = term.rig == pose || term.cam == pose || term.body == pose || term.tag == pose;
    if (!term.used || !depends) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    const auto residual = [&](bool changed) {
      return corner_residual(plain, bundle.cameras[term.camera],
                             {value(term.rig, changed), value(term.cam, changed), value(term.body, changed),
                              value(term.tag, changed)});
    };
    const auto now = residual(false);
    const auto then = residual(true);
    if (!now || !then) return std::numeric_limits<double>::infinity();
    for (Eigen::Index k = 0; k < 4; ++k)
      largest = std::max(largest.value_or(0), (*now - *then).segment<2>(2 * k).norm());
  }
  return largest;
}

}  // namespace waymark
