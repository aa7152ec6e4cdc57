#include "waymark/localization/score_clusters.hpp"

#include <Eigen/Cholesky>

namespace waymark {
namespace {

constexpr std::int64_t kMoment_ns = 2'000'000'000;  ///< longer than slip lasts, and the memory of a filter

/// Variances of a value by leaving out one group after the other: what remains has its maximum elsewhere.
/// Larger by what the variance of Student's t is over that of a normal distribution: a few groups know the
/// spread of their own errors no better.
template <class Groups>
SystematicVector jackknife(const SystematicMatrix& information, const SystematicVector& value,
                           const Groups& groups) {
  constexpr double kFewest = 4;
  const auto count = static_cast<double>(groups.size());
  if (count < kFewest) return SystematicVector::Zero();
  SystematicVector squares = SystematicVector::Zero();
  for (const auto& [key, group] : groups) {
    const SystematicMatrix others = information - group.information;
    const SystematicVector moved = others.ldlt().solve(group.information * value - group.score);
    squares += moved.cwiseAbs2();
  }
  return (count - 1) / (count - 3) * (count - 1) / count * squares;
}

}  // namespace

ScoreSums& ScoreSums::operator+=(const ScoreSums& other) {
  information += other.information;
  score += other.score;
  count += other.count;
  return *this;
}

void ScoreClusters::add(int landmark, SensorTime stamp, const ScoreSums& told) {
  sums_[{stamp.time_since_epoch().count() / kMoment_ns, landmark}] += told;
}

SystematicVector ScoreClusters::variances(const SystematicMatrix& information,
                                          const SystematicVector& value) const {
  std::map<std::int64_t, ScoreSums> moments;
  std::map<int, ScoreSums> landmarks;
  for (const auto& [key, sums] : sums_) {
    moments[key.first] += sums;
    landmarks[key.second] += sums;
  }
  const SystematicVector by_moment = jackknife(information, value, moments);
  const SystematicVector by_landmark = jackknife(information, value, landmarks);
  const SystematicVector by_both = jackknife(information, value, sums_);
  return (by_moment + by_landmark - by_both).cwiseMax(by_moment).cwiseMax(by_landmark);
}

}  // namespace waymark
