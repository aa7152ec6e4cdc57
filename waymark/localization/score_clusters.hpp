#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "waymark/base/time.hpp"
#include "waymark/localization/riekf.hpp"

namespace waymark {

/// What some innovations tell of the numbers of kSystematic: information and score of their likelihood.
struct ScoreSums {
  SystematicMatrix information = SystematicMatrix::Zero();
  SystematicVector score = SystematicVector::Zero();
  int count = 0;

  ScoreSums& operator+=(const ScoreSums& other);
};

/// Innovations of a drive in two kinds of groups: those of one landmark share the error with which it hangs
/// and was printed as long as it is seen, and those of one moment share the errors of the motion.
class ScoreClusters {
 public:
  void add(int landmark, SensorTime stamp, const ScoreSums& told);
  /// Of each number, where `value` is the maximum of a likelihood of this information, all innovations and
  /// what was known before included: the variance by landmarks plus that by moments less that by what is
  /// both (Cameron, Gelbach and Miller, "Robust Inference With Multiway Clustering", Journal of Business and
  /// Economic Statistics 29(2), 2011, equation (2.13)), at least either of the first two. Each is that of the
  /// jackknife, which few groups, and unlike ones, do not make too small (Bell and McCaffrey, "Bias Reduction
  /// in Standard Errors for Linear Regression with Multi-Stage Samples", Survey Methodology 28(2), 2002).
  /// Landmarks, or moments, of which there are fewer than four count as nothing.
  [[nodiscard]] SystematicVector variances(const SystematicMatrix& information,
                                           const SystematicVector& value) const;

 private:
  std::map<std::pair<std::int64_t, int>, ScoreSums> sums_;  ///< by moment and landmark
};

}  // namespace waymark
