// Tests the shared and individual parts of the position covariances of map tags.
#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>

#include "waymark/localization/landmarks.hpp"

namespace waymark {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Tags 0 and 1 with a shared position error and with independent ones.
TagMap two_tags(double shared_m2, double own_m2, bool tied) {
  TagMap map;
  for (const int number : {0, 1}) {
    MappedTag tag{.map_T_tag = SE3(SO3(), {0, 0, 0}), .size_m = 0.16};
    tag.covariance = (shared_m2 + own_m2) * Matrix6::Identity();
    if (tied && number == 1) tag.tie = TagTie{{FamilyId::Tag36h11, 0}, shared_m2 * Matrix6::Identity()};
    map.tags[{FamilyId::Tag36h11, number}] = tag;
  }
  return map;
}

TEST(Landmarks, OwnCovarianceExcludesErrorsSharedWithTheTiedTag) {
  const Landmarks tied(two_tags(9, 1, true));
  const Landmark& tag = tied[tied.find({FamilyId::Tag36h11, 1})];
  EXPECT_LT((tag.own_covariance - (10 - 81.0 / 10) * Matrix6::Identity()).norm(), 1e-9);
  EXPECT_LT((tag.covariance - 10 * Matrix6::Identity()).norm(), 1e-9);
  const Landmark& other = tied[tied.find({FamilyId::Tag36h11, 0})];
  EXPECT_LT((other.own_covariance - other.covariance).norm(), 1e-12) << "the tag has no tie";
  const Eigen::SelfAdjointEigenSolver<Matrix6> less(tag.covariance - tag.own_covariance);
  EXPECT_GE(less.eigenvalues().minCoeff(), 0);
}

TEST(Landmarks, OwnCovarianceWithoutTiesEqualsTheCovariance) {
  const Landmarks loose(two_tags(9, 1, false));
  for (const Landmark& tag : loose.all()) EXPECT_LT((tag.own_covariance - tag.covariance).norm(), 1e-12);
}

// If a tie contradicts the covariances, as in an edited file, it must not produce a negative variance.
TEST(Landmarks, AnInvalidTieIsIgnored) {
  TagMap map = two_tags(9, 1, true);
  map.tags.at({FamilyId::Tag36h11, 1}).tie->covariance = 20 * Matrix6::Identity();
  const Landmarks landmarks(map);
  const Landmark& tag = landmarks[landmarks.find({FamilyId::Tag36h11, 1})];
  EXPECT_LT((tag.own_covariance - tag.covariance).norm(), 1e-12);
}

}  // namespace
}  // namespace waymark
