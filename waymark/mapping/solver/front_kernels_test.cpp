#include "waymark/mapping/solver/front_kernels.hpp"

#include <gtest/gtest.h>
#include <limits>
#include <string>

#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"

namespace waymark::internal {
namespace {

Eigen::MatrixXd positive_definite(int size, Random& random) {
  const Eigen::MatrixXd J = Eigen::MatrixXd::NullaryExpr(size + 8, size, [&] { return random.normal(); });
  return J.transpose() * J + Eigen::MatrixXd::Identity(size, size);
}

/// Sizes below and above the size of one panel and of two panels.
class OfSize : public ::testing::TestWithParam<std::pair<int, int>> {};

TEST_P(OfSize, EveryKernelEqualsTheDenseResult) {
  const auto [size, own] = GetParam();
  Random random(5);
  const Eigen::MatrixXd H = positive_definite(size, random);
  const Eigen::MatrixXd inverse = H.llt().solve(Eigen::MatrixXd::Identity(size, size));
  const int rows = size - own;
  const Eigen::MatrixXd known = inverse.bottomRightCorner(rows, rows);
  for (const FrontKernels* kernels : front_kernels()) {
    Eigen::MatrixXd F = H;
    constexpr double kNotRead = std::numeric_limits<double>::quiet_NaN();
    F.triangularView<Eigen::StrictlyUpper>().setConstant(kNotRead);
    ASSERT_TRUE(kernels->eliminate(F.data(), size, own)) << kernels->name;
    const Eigen::MatrixXd L = F.topLeftCorner(own, own).triangularView<Eigen::Lower>();
    const Eigen::MatrixXd B = F.bottomLeftCorner(rows, own);
    EXPECT_LT((L * L.transpose() - H.topLeftCorner(own, own)).norm(), 1e-12 * H.norm()) << kernels->name;
    EXPECT_LT((B * L.transpose() - H.bottomLeftCorner(rows, own)).norm(), 1e-12 * H.norm()) << kernels->name;
    const Eigen::MatrixXd left = H.bottomRightCorner(rows, rows) - B * B.transpose();
    const Eigen::MatrixXd off = (F.bottomRightCorner(rows, rows) - left).triangularView<Eigen::Lower>();
    EXPECT_LT(off.norm(), 1e-12 * H.norm()) << kernels->name;

    Eigen::MatrixXd Z = Eigen::MatrixXd::Constant(size, size, kNotRead);
    Z.bottomRightCorner(rows, rows) = (known + known.transpose()) / 2;
    kernels->invert(F.data(), size, own, Z.data());
    EXPECT_LT((Z - inverse).norm(), 1e-10 * inverse.norm()) << kernels->name;
    EXPECT_EQ(Z, Z.transpose()) << kernels->name;
  }
}

INSTANTIATE_TEST_SUITE_P(FrontKernels, OfSize,
                         ::testing::Values(std::pair(1, 1), std::pair(6, 6), std::pair(30, 6),
                                           std::pair(128, 128), std::pair(129, 129), std::pair(300, 127),
                                           std::pair(310, 300), std::pair(420, 129)),
                         [](const auto& of) {
                           return std::to_string(of.param.second) + "Of" + std::to_string(of.param.first);
                         });

TEST(FrontKernels, EveryKernelRejectsIndefiniteMatrices) {
  for (const FrontKernels* kernels : front_kernels()) {
    Eigen::MatrixXd F = Eigen::MatrixXd::Identity(20, 20);
    F(7, 7) = -1;
    EXPECT_FALSE(kernels->eliminate(F.data(), 20, 12)) << kernels->name;
    F(7, 7) = 0;
    EXPECT_FALSE(kernels->eliminate(F.data(), 20, 12)) << kernels->name;
  }
}

/// Repeated runs give identical results.
TEST(FrontKernels, AreDeterministic) {
  Random random(6);
  const Eigen::MatrixXd H = positive_definite(200, random);
  for (const FrontKernels* kernels : front_kernels()) {
    Eigen::MatrixXd first = H;
    Eigen::MatrixXd second = H;
    ASSERT_TRUE(kernels->eliminate(first.data(), 200, 150) && kernels->eliminate(second.data(), 200, 150));
    EXPECT_EQ(first, second) << kernels->name;
  }
}

}  // namespace
}  // namespace waymark::internal
