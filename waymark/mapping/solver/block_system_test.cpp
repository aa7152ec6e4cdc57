// Block normal equations compared with dense matrices.
#include "waymark/mapping/solver/block_system.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark::internal {
namespace {

using Part = BlockSystem::Part;

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

Eigen::MatrixXd dense(const BlockSystem& system) {
  const Eigen::MatrixXd lower = system.lower();
  return lower.selfadjointView<Eigen::Lower>();
}

/// A residual that depends on some of the unknowns.
struct Residual {
  std::vector<int> unknowns{};
  std::vector<Eigen::MatrixXd> J{};
  Eigen::VectorXd r{};
  double weight = 1;
};

struct Problem {
  std::vector<int> dimensions{};
  std::vector<Residual> residuals{};

  [[nodiscard]] BlockSystem system() const {
    std::vector<std::pair<int, int>> couplings;
    for (const Residual& residual : residuals) {
      for (int a : residual.unknowns) {
        for (int b : residual.unknowns) couplings.emplace_back(a, b);
      }
    }
    BlockSystem system(dimensions, couplings);
    for (const Residual& residual : residuals) {
      std::vector<Part> parts;
      for (std::size_t i = 0; i < residual.J.size(); ++i)
        parts.push_back({residual.unknowns[i], residual.J[i]});
      system.add(parts, residual.r, residual.weight);
    }
    return system;
  }
};

/// Images that observe tags through two cameras. Poses have 6 parameters, and cameras have the given numbers
/// of parameters.
Problem images_of_tags(Random& random, int first_lens, int second_lens) {
  constexpr int kImages = 12;
  constexpr int kTags = 4;
  Problem problem{.dimensions = std::vector<int>(kImages + kTags, 6)};
  problem.dimensions.push_back(first_lens);
  problem.dimensions.push_back(second_lens);
  for (int image = 0; image < kImages; ++image) {
    for (int lens = 0; lens < 2; ++lens) {
      for (int k = 0; k < 3; ++k) {
        Residual residual{.unknowns = {image, kImages + (image + k) % kTags, kImages + kTags + lens},
                          .r = random_matrix(random, 8, 1),
                          .weight = random.uniform(0.5, 2)};
        for (int u : residual.unknowns)
          residual.J.push_back(random_matrix(random, 8, problem.dimensions[static_cast<std::size_t>(u)]));
        problem.residuals.push_back(std::move(residual));
      }
    }
  }
  return problem;
}

TEST(BlockSystem, EqualsDenseNormalEquations) {
  Random random(1);
  const Problem problem = images_of_tags(random, 8, 4);
  const BlockSystem system = problem.system();
  const Eigen::Index n = system.gradient().size();
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n);
  for (const Residual& residual : problem.residuals) {
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(residual.r.size(), n);
    for (std::size_t i = 0; i < residual.J.size(); ++i)
      J.middleCols(system.offset(residual.unknowns[i]), residual.J[i].cols()) += residual.J[i];
    H += residual.weight * J.transpose() * J;
    g += residual.weight * J.transpose() * residual.r;
  }
  EXPECT_LT((dense(system) - H).norm(), 1e-10 * H.norm());
  EXPECT_LT((system.gradient() - g).norm(), 1e-10 * g.norm());
}

TEST(BlockSystem, IsIndependentOfTheOrderOfResidualsAndParts) {
  Random random(2);
  const Problem problem = images_of_tags(random, 8, 8);
  Problem mixed = problem;
  std::ranges::reverse(mixed.residuals);
  for (Residual& residual : mixed.residuals) {
    std::ranges::reverse(residual.unknowns);
    std::ranges::reverse(residual.J);
  }
  const BlockSystem a = problem.system();
  const BlockSystem b = mixed.system();
  EXPECT_LT((dense(a) - dense(b)).norm(), 1e-12 * dense(a).norm());
  EXPECT_LT((a.gradient() - b.gradient()).norm(), 1e-12 * a.gradient().norm());
}

TEST(BlockSystem, IgnoresFixedUnknowns) {
  BlockSystem system({2}, {});
  const Eigen::MatrixXd known = Eigen::MatrixXd::Constant(3, 5, 7);
  const Eigen::MatrixXd J = Eigen::MatrixXd::Ones(3, 2);
  system.add(std::array<Part, 2>{{{-1, known}, {0, J}}}, Eigen::Vector3d::Ones());
  EXPECT_EQ(dense(system), (Eigen::Matrix2d() << 3, 3, 3, 3).finished());
  EXPECT_EQ(system.gradient(), Eigen::Vector2d(3, 3));
  system.clear();
  EXPECT_EQ(dense(system).norm() + system.gradient().norm(), 0);
}

TEST(BlockSystem, AddsCornersLikeAnyOtherResidual) {
  using Jacobian = Eigen::Matrix<double, 8, 6>;
  Random random(3);
  for (const std::array<int, 4>& unknowns : {std::array{0, 1, -1, 2}, std::array{0, -1, 3, 2},
                                             std::array{-1, 1, 3, 2}, std::array{0, -1, -1, -1}}) {
    std::vector<std::pair<int, int>> couplings;
    for (int a : unknowns) {
      for (int b : unknowns) {
        if (a >= 0 && b >= 0) couplings.emplace_back(a, b);
      }
    }
    BlockSystem corners({6, 6, 6, 6}, couplings);
    BlockSystem plain = corners;
    std::array<Jacobian, 4> J;
    for (Jacobian& one : J) one = random_matrix(random, 8, 6);
    J[2] = -J[0];  // moving the rig has the same effect as moving the body in the opposite direction
    const Eigen::Matrix<double, 8, 1> r = random_matrix(random, 8, 1);
    corners.add_corners(unknowns, {&J[0], &J[1], &J[2], &J[3]}, r, 0.7);
    std::vector<Part> parts;
    for (std::size_t i = 0; i < 4; ++i) parts.push_back({unknowns[i], J[i]});
    plain.add(parts, r, 0.7);
    EXPECT_LT((dense(corners) - dense(plain)).norm(), 1e-12 * dense(plain).norm());
    EXPECT_LT((corners.gradient() - plain.gradient()).norm(), 1e-12 * plain.gradient().norm());
  }
}

TEST(BlockSystem, HasNoBlockForUncoupledUnknowns) {
  const BlockSystem system({6, 3, 2}, {{0, 1}});
  EXPECT_TRUE(system.block(1, 0));
  EXPECT_TRUE(system.block(2, 2));
  EXPECT_FALSE(system.block(2, 0));
  EXPECT_FALSE(system.block(2, 1));
}

/// Blocks for cameras (2 to 8 scalars) are mixed with blocks for poses (6).
TEST(FrontCholesky, SolvesAndInvertsBlocksOfDifferentSizes) {
  constexpr double kDamping = 0.01;
  constexpr double kFloor = 1e-3;
  for (const auto& [first, second] : {std::pair(6, 6), std::pair(8, 4), std::pair(8, 8), std::pair(2, 3)}) {
    Random random(4);
    const BlockSystem system = images_of_tags(random, first, second).system();
    const FrontPlan plan = front_plan(system);
    FrontCholesky cholesky(system, plan);
    ASSERT_TRUE(cholesky.factorize(kDamping, kFloor));
    Eigen::MatrixXd H = dense(system);
    H.diagonal() += kDamping * H.diagonal() + Eigen::VectorXd::Constant(H.rows(), kFloor);
    const Eigen::MatrixXd inverse = H.llt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
    const Eigen::VectorXd expected = inverse * system.gradient();
    EXPECT_LT((cholesky.solve(system.gradient()) - expected).norm(), 1e-9 * expected.norm()) << first;
    std::vector<std::pair<int, int>> diagonal;
    for (int u = 0; u < system.unknowns(); ++u) diagonal.emplace_back(u, u);
    const std::vector<Eigen::MatrixXd> blocks = cholesky.inverse_blocks(diagonal);
    for (int u = 0; u < system.unknowns(); ++u) {
      const Eigen::MatrixXd block =
          inverse.block(system.offset(u), system.offset(u), system.dimension(u), system.dimension(u));
      EXPECT_LT((blocks[static_cast<std::size_t>(u)] - block).norm(), 1e-9 * inverse.norm()) << u;
    }
  }
}

}  // namespace
}  // namespace waymark::internal
