#include "waymark/mapping/lap/printed_tags.hpp"

#include <Eigen/Cholesky>

namespace waymark::internal {
namespace {

using Matrix8 = Eigen::Matrix<double, 8, 8>;
using PoseByPrint = Eigen::Matrix<double, 6, 8>;

/// What is summed over the observations of a tag.
struct Sums {
  Matrix6 information = Matrix6::Zero();
  PoseByPrint by_print = PoseByPrint::Zero();
};

/// Derivative of the whitened corners by where they are in the plane of the tag: x, y of each.
Matrix8 by_corners_of(const CornerTerm& term, const Eigen::Matrix<double, 8, 6>& plain,
                      const SE3& map_T_tag) {
  const Eigen::Matrix<double, 3, 2> plane = map_T_tag.rotation().matrix().leftCols<2>();
  Matrix8 J = Matrix8::Zero();
  // A corner that moves alone does what it does where the whole tag is moved.
  for (Eigen::Index c = 0; c < 8; c += 2) J.block<2, 2>(c, c) = plain.block<2, 3>(c, 0) * plane;
  return term.factor.whitening * J;
}

}  // namespace

std::map<PoseIndex, Matrix6> covariance_of_print(const Bundle& bundle, double sigma_m) {
  std::map<PoseIndex, Sums> tags;
  for (const CornerTerm& term : bundle.corners) {
    if (!term.used) continue;
    CornerFactor plain = term.factor;
    plain.whitening.setIdentity();
    plain.isotropic = true;
    const auto pose = [&](PoseIndex i) { return bundle.poses[i].value; };
    CornerJacobians J;
    J.wants_rig = J.wants_cam = J.wants_body = false;
    const CornerPoses poses{pose(term.rig), pose(term.cam), pose(term.body), pose(term.tag)};
    if (!corner_residual(plain, bundle.cameras[term.camera], poses, &J)) continue;
    const Eigen::Matrix<double, 8, 6> white = term.factor.whitening * J.tag;
    Sums& sums = tags[term.tag];
    sums.information += white.transpose() * white;
    sums.by_print += white.transpose() * by_corners_of(term, J.tag, pose(term.tag));
  }
  std::map<PoseIndex, Matrix6> covariances;
  for (const auto& [tag, sums] : tags) {
    const Eigen::LLT<Matrix6> llt(sums.information);
    if (llt.info() != Eigen::Success) continue;
    const PoseByPrint off = sigma_m * llt.solve(sums.by_print);
    covariances[tag] = off * off.transpose();
  }
  return covariances;
}

}  // namespace waymark::internal
