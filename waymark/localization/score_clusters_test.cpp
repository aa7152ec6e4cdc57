// Drives past landmarks whose errors last and whose moments share errors of the motion: are numbers off by
// as much as is said?
#include "waymark/localization/score_clusters.hpp"

#include <array>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using Rows = Eigen::Matrix<double, 8, 1>;

constexpr int kLandmarks = 24;
constexpr int kMoments = 30;

template <class Matrix>
Matrix normal(Random& random) {
  Matrix drawn;
  for (Eigen::Index i = 0; i < drawn.size(); ++i) drawn(i) = random.normal();
  return drawn;
}

/// Squares of errors over variances of all numbers: by clusters, and as if all innovations were independent.
struct Scores {
  double clusters = 0, alone = 0;
};

/// Each landmark is in view for some moments, with an error that lasts; each moment has one of its own.
Scores drive(std::uint64_t seed) {
  constexpr int kInView = 5;
  constexpr int kLooks = 10;
  constexpr double kLasting = 1, kOfMoment = 0.3;
  Random random(seed);
  std::array<Rows, kMoments> of_moment;
  for (Rows& error : of_moment) error = kOfMoment * normal<Rows>(random);
  ScoreClusters clusters;
  ScoreSums all{.information = SystematicMatrix::Identity() * 1e-6};
  for (int landmark = 0; landmark < kLandmarks; ++landmark) {
    const StateBySystematic seen = normal<StateBySystematic>(random);
    const Rows lasting = kLasting * normal<Rows>(random);
    const int first = landmark * (kMoments - kInView) / kLandmarks;
    for (int look = 0; look < kInView * kLooks; ++look) {
      const int moment = first + look / kLooks;
      const StateBySystematic A = seen + 0.5 * normal<StateBySystematic>(random);
      const Rows r = lasting + of_moment.at(static_cast<std::size_t>(moment)) + normal<Rows>(random);
      const ScoreSums told{A.transpose() * A, A.transpose() * r, 1};
      clusters.add(landmark, SensorTime(std::chrono::milliseconds(2000 * moment + 100 * look % 2000)), told);
      all += told;
    }
  }
  const SystematicVector value = all.information.ldlt().solve(all.score);  // zero is true
  const SystematicVector alone = all.information.inverse().diagonal();
  return {value.cwiseAbs2().cwiseQuotient(clusters.variances(all.information, value)).mean(),
          value.cwiseAbs2().cwiseQuotient(alone).mean()};
}

TEST(ScoreClusters, SayByHowMuchNumbersAreOff) {
  constexpr int kDrives = 100;
  Scores sum;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    const Scores scores = drive(seed);
    sum.clusters += scores.clusters / kDrives;
    sum.alone += scores.alone / kDrives;
  }
  std::printf("  errors over deviations, RMS: %.2f by clusters, %.2f as if independent\n",
              std::sqrt(sum.clusters), std::sqrt(sum.alone));
  EXPECT_GT(std::sqrt(sum.clusters), 0.85);
  EXPECT_LT(std::sqrt(sum.clusters), 1.15);
  EXPECT_GT(std::sqrt(sum.alone), 2);
}

TEST(ScoreClusters, SayNothingOfFewGroups) {
  Random random(1);
  ScoreClusters clusters;
  for (int i = 0; i < 30; ++i)
    clusters.add(i % 3, SensorTime(std::chrono::milliseconds(200 * i)),
                 {SystematicMatrix::Identity(), normal<SystematicVector>(random), 1});
  const SystematicMatrix information = 31 * SystematicMatrix::Identity();
  EXPECT_EQ(clusters.variances(information, SystematicVector::Zero()), SystematicVector::Zero());
  clusters.add(0, SensorTime(std::chrono::seconds(7)),
               {SystematicMatrix::Identity(), normal<SystematicVector>(random), 1});
  EXPECT_GT(clusters.variances(information, SystematicVector::Zero()).minCoeff(), 0);
}

}  // namespace
}  // namespace waymark
