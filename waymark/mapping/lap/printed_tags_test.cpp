// Tags whose corners are printed aside: is their pose off by as much as is said?
#include "waymark/mapping/lap/printed_tags.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::internal {
namespace {

constexpr double kSize_m = 0.16;
constexpr double kPrinted_m = 0.0005;

/// A camera that passes a tag at known places, and the corners that it sees, free of noise; each is printed
/// elsewhere.
struct Pass {
  Bundle bundle{};
  PoseIndex tag = 0;
};

Pass pass(std::uint64_t seed) {
  Random random(seed);
  std::array<Eigen::Vector3d, 4> printed = tag_corners(kSize_m);
  for (Eigen::Vector3d& corner : printed) {
    corner.x() += random.normal(0, kPrinted_m);
    corner.y() += random.normal(0, kPrinted_m);
  }
  Pass made;
  Bundle& bundle = made.bundle;
  bundle.cameras.push_back(
      CameraModel::make(PinholeRadtan{.fx = 430, .fy = 430, .cx = 320, .cy = 240, .coefficients = 4}, 640,
                        480)
          .value());
  const PoseIndex map = bundle.add({}, true);
  const PoseIndex mounting = bundle.add({}, true);
  made.tag = bundle.add({});
  constexpr int kLooks = 12;
  for (int i = 0; i < kLooks; ++i) {
    const double nearer_m = 0.06 * i;
    const SE3 map_T_cam(SO3::exp({0.05, 0.02 * i, 0}), {-0.4 + 0.02 * i, 0.1, -1.8 + nearer_m});
    CornerTerm term{.rig = bundle.add(map_T_cam, true), .cam = mounting, .body = map, .tag = made.tag};
    term.factor.size_m = kSize_m;
    term.factor.whitening *= 5;  // of a fifth of a pixel
    for (std::size_t c = 0; c < 4; ++c)
      term.factor.corners_px.at(c) = *bundle.cameras[0].project(map_T_cam.inverse() * printed.at(c));
    bundle.corners.push_back(term);
  }
  return made;
}

TEST(PrintedTags, ArePosedAsFarOffAsIsSaid) {
  constexpr int kTags = 200;
  double chi2 = 0;
  double turned2 = 0;
  for (std::uint64_t seed = 1; seed <= kTags; ++seed) {
    Pass made = pass(seed);
    ASSERT_TRUE(solve(made.bundle).usable());
    const Vector6 off = made.bundle.poses[made.tag].value.log();
    const std::map<PoseIndex, Matrix6> P = covariance_of_print(made.bundle, kPrinted_m);
    ASSERT_EQ(P.size(), 1U);
    chi2 += off.dot(P.at(made.tag).ldlt().solve(off)) / kTags;
    turned2 += off.segment<2>(3).squaredNorm() / (2 * kTags);
  }
  std::printf("  chi2 %.2f of 6 degrees of freedom; tilted by %.1f mrad, RMS\n", chi2,
              1000 * std::sqrt(turned2));
  EXPECT_NEAR(chi2, 6, 0.9);
}

}  // namespace
}  // namespace waymark::internal
