// Tests the number of successive images with persistent errors that count as one. Then compares the
// covariance estimated from the stretches of a drive with the actual errors over many draws.
#include "waymark/mapping/solver/correlated_errors.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

struct Film {
  Bundle bundle{};
  std::vector<std::size_t> frames{};  ///< frame of each corner term
};

double counted(const Film& film) { return correlated_frames(film.bundle, film.frames); }

/// One tag in front of a camera. The error of each corner is a first-order process (`keep` times the previous
/// error, plus a new one) plus white noise with standard deviation `white`.
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

TEST(CorrelatedFrames, IndependentErrorsGiveAFactorOfOne) {
  EXPECT_NEAR(counted(film_with_errors(0, 2000, 1)), 1, 0.05);
}

TEST(CorrelatedFrames, PersistentErrorsGiveTheirAutocorrelationTime) {
  // 1 + 2 sum keep^k = (1 + keep) / (1 - keep)
  EXPECT_NEAR(counted(film_with_errors(0.8, 4000, 2)), 9, 1.2);
  EXPECT_NEAR(counted(film_with_errors(0.5, 4000, 3)), 3, 0.4);
}

TEST(CorrelatedFrames, ASmallPersistentPartIsCountedInFull) {
  // 1 + 2 share sum keep^k with share = 1/5; the correlation is below 0.05 from the seventh image on.
  EXPECT_NEAR(counted(film_with_errors(0.8, 8000, 5, 2)), 1 + 2 * 0.2 * 0.8 / 0.2, 0.25);
}

TEST(CorrelatedFrames, AConstantErrorMakesAllImagesCountAsOne) {
  Film film = film_with_errors(0, 200, 4);
  for (CornerTerm& term : film.bundle.corners) term = film.bundle.corners.front();
  EXPECT_NEAR(counted(film), 200, 2);
}

TEST(CorrelatedFrames, TheOrderOfTermsDoesNotMatter) {
  Film film = film_with_errors(0.5, 500, 6);
  for (std::size_t& frame : film.frames) frame += frame / 100 * 7;  // with gaps
  const double in_order = counted(film);
  Film reversed = film;
  std::ranges::reverse(reversed.bundle.corners);
  std::ranges::reverse(reversed.frames);
  EXPECT_EQ(counted(reversed), in_order);
  film.bundle.corners.push_back(film.bundle.corners.front());  // the id occurs twice in one image
  film.frames.push_back(film.frames.back());
  EXPECT_EQ(counted(film), in_order);
}

TEST(CorrelatedFrames, NoTermsInUseGiveAFactorOfOne) { EXPECT_EQ(counted({}), 1); }

constexpr int kTerms = 640;
constexpr int kStretches = 32;
constexpr double kSigma_m = 0.0005;
constexpr double kStep_m = 0.2;

struct Drive {
  Bundle bundle{};
  StretchQuestion question{};
};

/// A straight drive along fixed poses. The distance scale is 1. Odometry errors stay the same for
/// `steps_alike` steps. The mounting is determined only by its prior.
Drive drive(std::uint64_t seed, int steps_alike) {
  Random random(seed);
  Drive made;
  Bundle& bundle = made.bundle;
  bundle.odometry_scales.push_back({});
  made.question.pose = bundle.add({});
  made.question.stretch.push_back(-1);
  const Eigen::Vector3d sigma(kSigma_m, kSigma_m, 0.01);
  const Matrix6 of_prior = Matrix6::Identity() / 0.1;
  bundle.priors.push_back({made.question.pose, {{}, of_prior}});
  double off_m = 0;
  for (int i = 0; i <= kTerms; ++i) {
    const PoseIndex pose = bundle.add(SE3({}, {kStep_m * i, 0, 0}), true);
    made.question.stretch.push_back(i * kStretches / (kTerms + 1));
    if (i == 0) continue;
    if ((i - 1) % steps_alike == 0) off_m = random.normal(0, kSigma_m);
    const SE2 measured({}, {kStep_m + off_m, 0});
    bundle.odometry.push_back(
        {pose - 1, pose, 0, {measured, sigma.cwiseInverse().asDiagonal(), 0.1, SE2::Tangent::Zero()}});
  }
  return made;
}

/// RMS error of the distance scale in units of its standard deviation, as estimated from stretches and from
/// the model.
struct Scores {
  double by_stretches = 0, by_model = 0;
};

Scores scores(int steps_alike) {
  constexpr int kDraws = 200;
  Scores sum;
  for (int draw = 0; draw < kDraws; ++draw) {
    Drive made = drive(static_cast<std::uint64_t>(1000 + draw), steps_alike);
    EXPECT_TRUE(solve(made.bundle).usable());
    const auto spread = stretch_covariance(made.bundle, made.question);
    if (!spread) {
      ADD_FAILURE() << "no covariance";
      return sum;
    }
    const double off = made.bundle.odometry_scales[0].value.distance - 1;
    sum.by_stretches += off * off / spread->scales(0, 0);
    sum.by_model += off * off / covariance(made.bundle).scales[0](0, 0);
  }
  const Scores rms{std::sqrt(sum.by_stretches / kDraws), std::sqrt(sum.by_model / kDraws)};
  std::printf("errors alike over %d steps: %.2f by stretches, %.2f by the model\n", steps_alike,
              rms.by_stretches, rms.by_model);
  return rms;
}

TEST(StretchCovariance, EqualsTheModelIfErrorsAreIndependent) {
  const Scores rms = scores(1);
  EXPECT_NEAR(rms.by_stretches, 1, 0.13);
  EXPECT_NEAR(rms.by_model, 1, 0.13);
}

TEST(StretchCovariance, IsConsistentIfErrorsPersist) {
  const Scores rms = scores(10);
  EXPECT_NEAR(rms.by_stretches, 1, 0.15);
  EXPECT_GT(rms.by_model, 2.5);
}

TEST(StretchCovariance, CountsAPriorAsStated) {
  const Drive made = drive(7, 1);
  const auto spread = stretch_covariance(made.bundle, made.question);
  ASSERT_TRUE(spread);
  EXPECT_EQ(spread->stretches, kStretches);
  EXPECT_LT((spread->pose - 0.01 * Matrix6::Identity()).norm(), 1e-6);
  EXPECT_EQ(spread->intrinsics.size(), 0);
}

TEST(StretchCovariance, IsEmptyForFewStretchesOrFixedPoses) {
  Drive few = drive(7, 1);
  for (int& stretch : few.question.stretch) stretch /= 8;
  EXPECT_FALSE(stretch_covariance(few.bundle, few.question));
  Drive known = drive(7, 1);
  known.bundle.poses[known.question.pose].fixed = true;
  EXPECT_FALSE(stretch_covariance(known.bundle, known.question));
}

}  // namespace
}  // namespace waymark
