#include "waymark/localization/kept_numbers.hpp"

#include <gtest/gtest.h>
#include <Eigen/LU>

namespace waymark {
namespace {

TEST(KeptNumbers, WhatIsToldMovesAndWhatIsNotStays) {
  Eigen::VectorXd change = Eigen::Vector3d(0.5, 3, -1);
  const Eigen::MatrixXd P = Eigen::Matrix3d::Identity();
  EXPECT_EQ(keep_given(P, 2, change), (std::vector<bool>{true, false, true}));
  EXPECT_EQ(change, Eigen::VectorXd(Eigen::Vector3d(0, 3, 0)));
}

TEST(KeptNumbers, TheOthersMoveToTheirBestBesideIt) {
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 4, 1.5, 1.5, 2).finished();
  const Eigen::MatrixXd P = H.inverse();
  const Eigen::Vector2d best(5, 0.4);
  Eigen::VectorXd change = best;
  const auto kept = keep_given(P, 2, change);
  EXPECT_EQ(kept, (std::vector<bool>{false, true}));
  // Minimum of (x - best)' H (x - best) / 2 where x[1] is 0.
  EXPECT_NEAR(change[0], best[0] + H(0, 1) / H(0, 0) * best[1], 1e-12);
  EXPECT_EQ(change[1], 0);
}

TEST(KeptNumbers, OfTwoThatAreOnlyKnownTogetherOneMoves) {
  // Their sum is known well, their difference not at all: one of them has to move.
  const Eigen::Matrix2d H = (Eigen::Matrix2d() << 100.01, 100, 100, 100.01).finished();
  const Eigen::MatrixXd P = H.inverse();
  Eigen::VectorXd change = Eigen::Vector2d(1.0, 2.0);
  EXPECT_EQ(keep_given(P, 2, change), (std::vector<bool>{true, false})) << "each alone is uncertain by 7";
  EXPECT_NEAR(change[1], 3, 1e-3);
}

}  // namespace
}  // namespace waymark
