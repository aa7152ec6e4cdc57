#include "waymark/tags/refinement/tag_fit.hpp"

#include <cmath>
#include <cstddef>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"

namespace waymark::refinement {
namespace {

constexpr int kAll = kCommon + 4 * kParameters;
using DenseMatrix = Eigen::Matrix<double, kAll, kAll>;
using DenseVector = Eigen::Matrix<double, kAll, 1>;

struct Problem {
  std::array<NormalEquations, 4> normals;
  TagEstimate at;
  Priors priors;
};

Problem random_problem(Random& random) {
  Problem problem;
  problem.at.noise_variance = 4;
  problem.at.mean << 40, 160, -0.4;
  problem.priors.bend_sigma_px = {0.3, 0.1, 0.02, 0.5};
  for (std::size_t k = 0; k < 4; ++k) {
    problem.at.edges[k] << 0, 0, 0.01, 5, 41, 158, -0.5;
    NormalEquations& normal = problem.normals[k];
    for (int pixel = 0; pixel < 40; ++pixel) {
      EdgeVector j;
      j << 90 * random.normal(), 90 * random.normal(), 60 * random.normal(), random.normal(), 1,
          random.uniform(), 30 * random.normal();
      normal.information += j * j.transpose();
      normal.gradient += j * (2 * random.normal());
    }
  }
  return problem;
}

/// The same least squares problem with all its unknowns in one dense system: first the mean, then the edges.
struct Dense {
  DenseMatrix information = DenseMatrix::Zero();
  DenseVector gradient = DenseVector::Zero();

  explicit Dense(const Problem& problem) {
    const double step = std::abs(problem.at.mean[1]);
    const Eigen::Vector3d sigma(problem.priors.inner_level * step, problem.priors.step * step,
                                problem.priors.log_blur);
    for (int k = 0; k < 4; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const int first = kCommon + k * kParameters;
      information.block<kParameters, kParameters>(first, first) +=
          problem.normals[i].information / problem.at.noise_variance;
      gradient.segment<kParameters>(first) += problem.normals[i].gradient / problem.at.noise_variance;
      const EdgeVector& x = problem.at.edges[i];
      observe(first + kFrom, x[kFrom], 0, std::sqrt(10.0));
      observe(first + kTo, x[kTo], 0, std::sqrt(10.0));
      observe(first + kBend, x[kBend], 0, problem.priors.bend_sigma_px[i]);
      observe(first + kBeyond, x[kBeyond], 0, problem.priors.beyond * step);
      for (int c = 0; c < kCommon; ++c) {
        DenseVector difference = DenseVector::Zero();
        difference[first + kOwn + c] = 1;
        difference[c] = -1;
        const double weight = 1 / (sigma[c] * sigma[c]);
        information += weight * difference * difference.transpose();
        gradient -= weight * (x[kOwn + c] - problem.at.mean[c]) * difference;
      }
    }
    observe(2, problem.at.mean[2], std::log(problem.priors.blur_px), problem.priors.mean_log_blur);
  }

  void observe(int i, double at, double expected, double sigma) {
    information(i, i) += 1 / (sigma * sigma);
    gradient[i] += (expected - at) / (sigma * sigma);
  }
};

TEST(TagSolve, IsTheJointLeastSquaresSolution) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Problem problem = random_problem(random);
    const Dense dense(problem);
    const DenseVector step = dense.information.llt().solve(dense.gradient);
    const DenseMatrix covariance = dense.information.llt().solve(DenseMatrix::Identity());

    const TagSolve solve(problem.normals, problem.priors, problem.at);
    TagEstimate moved = problem.at;
    const double largest = solve.apply(moved);
    EXPECT_LT((moved.mean - problem.at.mean - step.head<kCommon>()).norm(), 1e-8 * step.norm());
    const auto displacements = solve.displacement_covariance();
    double expected_largest = 0;
    for (int k = 0; k < 4; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const int first = kCommon + k * kParameters;
      const EdgeVector expected = step.segment<kParameters>(first);
      EXPECT_LT((moved.edges[i] - problem.at.edges[i] - expected).norm(), 1e-8 * step.norm());
      expected_largest = std::max(expected_largest, expected.head<2>().cwiseAbs().maxCoeff());
      for (int l = 0; l < 4; ++l) {
        const Eigen::Matrix2d block = covariance.block<2, 2>(first, kCommon + l * kParameters);
        EXPECT_LT((displacements.block<2, 2>(2 * k, 2 * l) - block).norm(),
                  1e-8 * covariance.diagonal().head(5).norm());
      }
    }
    EXPECT_NEAR(largest, expected_largest, 1e-9);
  }
}

TEST(TagSolve, ShortensStepsThatAreTooLarge) {
  Random random(2);
  Problem problem = random_problem(random);
  for (auto& normal : problem.normals) normal.gradient *= 1e4;
  const TagSolve solve(problem.normals, problem.priors, problem.at);
  TagEstimate moved = problem.at;
  EXPECT_GT(solve.apply(moved), 1.0);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_LE((moved.edges[k] - problem.at.edges[k]).head<2>().cwiseAbs().maxCoeff(), 1.0 + 1e-12);
    EXPECT_LE(std::abs(moved.edges[k][kLogBlur]), std::log(4.0) + 1e-12);
  }
}

TEST(TagSolve, AnInvisibleEdgeGetsCommonLevelsAndKeepsItsPosition) {
  Random random(3);
  Problem problem = random_problem(random);
  problem.normals[2] = {};
  problem.at.edges[2] << 0, 0, 0, 0, 60, 100, -0.2;
  const TagSolve solve(problem.normals, problem.priors, problem.at);
  TagEstimate moved = problem.at;
  solve.apply(moved);
  EXPECT_EQ(moved.edges[2].head<2>(), Eigen::Vector2d(0, 0));
  EXPECT_LT((moved.edges[2].tail<kCommon>() - moved.mean).norm(), 1e-6);
  EXPECT_TRUE(solve.displacement_covariance().allFinite());
}

}  // namespace
}  // namespace waymark::refinement
