#include "waymark/mapping/solver/front_cholesky.hpp"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"

namespace waymark::internal {
namespace {

struct Shape {
  const char* name;
  int frames, tags, seen;  ///< seen: number of tags in view, which differ from frame to frame
  /// Chain: each frame is coupled to the next; common: one unknown is coupled to all others.
  bool chain, common;
};

/// All unknowns have dimension 6 except the common one, which has dimension 4.
BlockSystem system_of(const Shape& shape, Random& random) {
  std::vector<int> dimensions(static_cast<std::size_t>(shape.frames + shape.tags), 6);
  std::vector<std::pair<int, int>> couplings;
  for (int f = 0; f < shape.frames; ++f) {
    for (int k = 0; k < shape.seen; ++k)
      couplings.emplace_back(f, shape.frames + (f * shape.tags / shape.frames + 3 * k) % shape.tags);
    if (shape.chain && f > 0) couplings.emplace_back(f - 1, f);
  }
  if (shape.common) {
    for (int u = 0; u < shape.frames + shape.tags; ++u) couplings.emplace_back(u, shape.frames + shape.tags);
    dimensions.push_back(4);
  }
  BlockSystem system(dimensions, couplings);
  for (const auto& [a, b] : couplings) {
    Eigen::MatrixXd J_a(8, dimensions[static_cast<std::size_t>(a)]);
    Eigen::MatrixXd J_b(8, dimensions[static_cast<std::size_t>(b)]);
    Eigen::VectorXd r(8);
    for (Eigen::MatrixXd* J : {&J_a, &J_b}) *J = J->unaryExpr([&](double) { return random.normal(); });
    for (double& x : r) x = random.normal();
    system.add(std::array<BlockSystem::Part, 2>{{{a, J_a}, {b, J_b}}}, r);
  }
  return system;
}

TEST(KeptFactor, SolvesSimilarSystemsAndFactorisesOthersAgain) {
  constexpr double kDamping = 1e-3;
  Random random(2);
  const Shape shape{"corridor", 80, 40, 3, true, false};
  const BlockSystem first = system_of(shape, random);
  BlockSystem alike = first;
  for (int u = 0; u < alike.unknowns(); ++u) {
    const Eigen::MatrixXd J = 0.5 * Eigen::MatrixXd::Identity(6, 6);
    alike.add(std::array<BlockSystem::Part, 1>{{{u, J}}}, 0.1 * Eigen::VectorXd::Ones(6));
  }
  const BlockSystem another = system_of(shape, random);
  const BlockSystem smaller = system_of({"rig", 40, 5, 4, false, false}, random);
  KeptFactor kept;
  for (const BlockSystem* system : std::array<const BlockSystem*, 4>{&first, &alike, &another, &smaller}) {
    const std::optional<Eigen::VectorXd> step = kept.step(*system, kDamping);
    const FrontPlan plan = front_plan(*system);
    FrontCholesky cholesky(*system, plan);
    const std::optional<Eigen::VectorXd> exact = damped_step(cholesky, *system, kDamping);
    ASSERT_TRUE(step && exact);
    const Eigen::VectorXd off = *step - *exact;
    const auto H = system->lower().selfadjointView<Eigen::Lower>();
    EXPECT_LT(off.dot(H * off), 0.01 * exact->dot(H * *exact));
  }
}

TEST(KeptFactor, AToleranceBoundsTheMissedGain) {
  constexpr double kDamping = 1e-3;
  Random random(3);
  const BlockSystem first = system_of({"corridor", 80, 40, 3, true, false}, random);
  BlockSystem alike = first;
  for (int u = 0; u < alike.unknowns(); ++u) {
    const Eigen::MatrixXd J = (u % 3) * Eigen::MatrixXd::Identity(6, 6);
    alike.add(std::array<BlockSystem::Part, 1>{{{u, J}}}, 0.1 * Eigen::VectorXd::Ones(6));
  }
  const Eigen::MatrixXd lower = alike.lower();
  Eigen::MatrixXd H = lower.selfadjointView<Eigen::Lower>();
  H.diagonal() *= 1 + kDamping;
  const auto gain = [&](const Eigen::VectorXd& step) -> double {
    return -alike.gradient().dot(step) - step.dot(H * step) / 2;
  };
  const double most = gain(-H.llt().solve(alike.gradient()));
  double least = 0;
  for (const double negligible_gain : {10 * most, 0.1 * most, 0.01 * most, 0.0}) {
    KeptFactor kept;
    ASSERT_TRUE(kept.step(first, kDamping));
    const std::optional<Eigen::VectorXd> step = kept.step(alike, kDamping, negligible_gain);
    ASSERT_TRUE(step);
    EXPECT_GE(gain(*step), least);
    EXPECT_GT(gain(*step), 0);
    EXPECT_LT(most - gain(*step), std::max(0.01 * most, 10 * negligible_gain));
    least = gain(*step);
  }
}

TEST(FrontCholesky, EqualsTheDenseSolutionAndInverse) {
  Random random(1);
  for (const Shape& shape : {Shape{"one", 1, 1, 1, false, false},
                             {"rig", 40, 5, 4, false, false},
                             {"lap", 60, 12, 4, true, true},
                             {"corridor", 80, 40, 3, true, false},
                             {"apart", 30, 30, 1, false, false}}) {
    const BlockSystem system = system_of(shape, random);
    const Eigen::MatrixXd lower = system.lower();
    Eigen::MatrixXd H = lower.selfadjointView<Eigen::Lower>();
    H.diagonal() += 0.01 * H.diagonal() + Eigen::VectorXd::Constant(H.rows(), 1e-3);
    const Eigen::MatrixXd inverse = H.llt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
    const FrontPlan plan = front_plan(system);
    FrontCholesky cholesky(system, plan);
    ASSERT_TRUE(cholesky.factorize(0.01, 1e-3)) << shape.name;
    const Eigen::VectorXd expected = inverse * system.gradient();
    EXPECT_LT((cholesky.solve(system.gradient()) - expected).norm(), 1e-9 * expected.norm()) << shape.name;
    std::vector<std::pair<int, int>> wanted;
    for (int column = 0; column < system.unknowns(); ++column) {
      system.for_column(column, [&](int row, const auto&) { wanted.emplace_back(column, row); });
    }
    const std::vector<Eigen::MatrixXd> blocks = cholesky.inverse_blocks(wanted);
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      const auto& [row, column] = wanted[i];
      const Eigen::MatrixXd block = inverse.block(system.offset(row), system.offset(column),
                                                  system.dimension(row), system.dimension(column));
      EXPECT_LT((blocks[i] - block).norm(), 1e-9 * inverse.norm())
          << shape.name << " " << row << " " << column;
    }
  }
}

/// Each unknown is measured relative to the five before it, and the first has a prior. Computing the
/// covariance of the last unknown therefore involves hundreds of nested fronts.
TEST(FrontCholesky, TheInverseOfALongChainMatchesItsSolution) {
  constexpr int kLength = 600;
  constexpr int kBack = 5;
  Random random(3);
  std::vector<std::pair<int, int>> couplings;
  for (int i = 1; i < kLength; ++i) {
    for (int k = 1; k <= std::min(i, kBack); ++k) couplings.emplace_back(i, i - k);
  }
  BlockSystem system(std::vector<int>(kLength, 6), couplings);
  const Eigen::MatrixXd known = 1e3 * Eigen::MatrixXd::Identity(6, 6);
  system.add(std::array<BlockSystem::Part, 1>{{{0, known}}}, Eigen::VectorXd::Zero(6));
  for (const auto& [i, before] : couplings) {
    const Eigen::MatrixXd J = Eigen::MatrixXd::NullaryExpr(8, 6, [&] { return 30 * random.normal(); });
    const Eigen::MatrixXd back = -J;
    system.add(std::array<BlockSystem::Part, 2>{{{i, J}, {before, back}}}, Eigen::VectorXd::Zero(8));
  }
  const FrontPlan plan = front_plan(system);
  FrontCholesky cholesky(system, plan);
  ASSERT_TRUE(cholesky.factorize(0, 0));
  std::vector<std::pair<int, int>> diagonal;
  for (int u = 0; u < kLength; ++u) diagonal.emplace_back(u, u);
  const std::vector<Eigen::MatrixXd> blocks = cholesky.inverse_blocks(diagonal);
  for (int u = 0; u < kLength; u += 7) {
    const Eigen::MatrixXd& block = blocks[static_cast<std::size_t>(u)];
    const Eigen::VectorXd unit = Eigen::VectorXd::Unit(system.gradient().size(), system.offset(u));
    const Eigen::VectorXd column = cholesky.solve(unit).segment<6>(system.offset(u));
    EXPECT_LT((block.col(0) - column).norm(), 1e-6 * column.norm()) << u;
    EXPECT_EQ(block, block.transpose()) << u;
  }
}

TEST(FrontCholesky, EachUnknownIsEliminatedOnceAndChildrenComeFirst) {
  Random random(2);
  const BlockSystem system = system_of({"lap", 60, 12, 4, true, true}, random);
  const FrontPlan plan = front_plan(system);
  std::vector<int> eliminated(static_cast<std::size_t>(system.unknowns()), 0);
  for (std::size_t f = 0; f < plan.fronts.size(); ++f) {
    for (int k = 0; k < plan.fronts[f].own; ++k)
      ++eliminated[static_cast<std::size_t>(plan.fronts[f].unknowns[static_cast<std::size_t>(k)])];
    const int parent = plan.fronts[f].parent;
    EXPECT_TRUE(parent < 0 || parent > static_cast<int>(f));
  }
  for (int times : eliminated) EXPECT_EQ(times, 1);
}

TEST(FrontCholesky, RejectsIndefiniteSystems) {
  BlockSystem system({6, 6}, {{0, 1}});
  const FrontPlan plan = front_plan(system);
  EXPECT_FALSE(FrontCholesky(system, plan).factorize(0, 0));
  EXPECT_TRUE(FrontCholesky(system, plan).factorize(0, 1));
}

}  // namespace
}  // namespace waymark::internal
