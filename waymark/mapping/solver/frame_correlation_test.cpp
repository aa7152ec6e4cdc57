// Successive pictures with errors that last: how many count as one.
#include "waymark/mapping/solver/frame_correlation.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

struct Film {
  Bundle bundle{};
  std::vector<std::size_t> frames{};  ///< of each corner term
};

double counted(const Film& film) { return correlated_frames(film.bundle, film.frames); }

/// One tag before a camera, whose corners have errors of a first-order process: each is `keep` times the one
/// before and something new, and of noise of `white` of its own.
Film film_with_errors(double keep, std::size_t frames, std::uint64_t seed, double white = 0) {
  Random random(seed);
  Film film;
  Bundle& bundle = film.bundle;
  bundle.cameras.push_back(
      CameraModel::make(PinholeRadtan{.fx = 400, .fy = 400, .cx = 320, .cy = 240}, 640, 480).value());
  const PoseIndex origin = bundle.add(SE3(), true);
  const PoseIndex tag = bundle.add(SE3(SO3(), {0, 0, 2}), true);
  const auto corners = visible_corners(bundle.cameras[0], SE3(SO3(), {0, 0, 2}), 0.2).value();
  Eigen::Matrix<double, 8, 1> error = Eigen::Matrix<double, 8, 1>::Zero();
  for (std::size_t f = 0; f < frames; ++f) {
    for (Eigen::Index i = 0; i < 8; ++i)
      error[i] = keep * error[i] + std::sqrt(1 - keep * keep) * random.normal();
    CornerTerm term{.rig = origin, .cam = origin, .body = origin, .tag = tag};
    term.factor.size_m = 0.2;
    term.factor.corners_px = corners;
    for (Eigen::Index k = 0; k < 4; ++k)
      term.factor.corners_px[static_cast<std::size_t>(k)] +=
          error.segment<2>(2 * k) + white * Eigen::Vector2d(random.normal(), random.normal());
    bundle.corners.push_back(term);
    film.frames.push_back(f);
  }
  return film;
}

TEST(CorrelatedFrames, IndependentErrorsCountOneByOne) {
  EXPECT_NEAR(counted(film_with_errors(0, 2000, 1)), 1, 0.05);
}

TEST(CorrelatedFrames, ErrorsThatLastAreCountedOnce) {
  // 1 + 2 sum keep^k = (1 + keep) / (1 - keep)
  EXPECT_NEAR(counted(film_with_errors(0.8, 4000, 2)), 9, 1.2);
  EXPECT_NEAR(counted(film_with_errors(0.5, 4000, 3)), 3, 0.4);
}

TEST(CorrelatedFrames, ASmallPartThatLastsLongCountsToItsEnd) {
  // 1 + 2 share sum keep^k, with a share of a fifth: its correlation is below 0.05 from the seventh picture
  // on
  EXPECT_NEAR(counted(film_with_errors(0.8, 8000, 5, 2)), 1 + 2 * 0.2 * 0.8 / 0.2, 0.25);
}

TEST(CorrelatedFrames, AnErrorThatNeverChangesMakesOnePictureOfAll) {
  Film film = film_with_errors(0, 200, 4);
  for (CornerTerm& term : film.bundle.corners) term = film.bundle.corners.front();
  EXPECT_NEAR(counted(film), 200, 2);
}

TEST(CorrelatedFrames, NothingInUseIsNoFactor) { EXPECT_EQ(counted({}), 1); }

}  // namespace
}  // namespace waymark
