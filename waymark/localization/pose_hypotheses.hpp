#pragma once

#include <array>
#include <optional>
#include <span>

#include "waymark/localization/observation.hpp"

namespace waymark {

/// A pose that observations have proposed, and who is for it.
struct Candidate {
  SE2 map_T_base{};
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< left tangent in map
  std::array<int, 4> landmarks{};                        ///< distinct ones that agree
  int distinct = 0;
  int support = 0;  ///< observations that agree
  int against = 0;  ///< since it is known
  std::int64_t age = 0;
  bool points_only = false;  ///< proposed by two points, whose distance alone speaks for it

  void add_landmark(int landmark);
};

/// Where a robot may be that does not know: candidates proposed by single observations, carried along by the
/// motion, and accepted when distinct landmarks agree. One tag alone is never accepted: its number may be
/// misread, it may hang elsewhere, and a flat square has two poses. Fixed size, no allocation.
class PoseHypotheses {
 public:
  explicit PoseHypotheses(const RiekfOptions& options);

  void propagate(const Eigen::Vector3d& twist, const Eigen::Vector3d& variances);
  void observe(std::span<const Observation> seen, const Landmarks& landmarks, const MountedSensor& sensor);
  /// The candidate that can be accepted: `tags` distinct landmarks agree, more is for it than against, and no
  /// other comes near. Points need one more when `contradicted`: an estimate that speaks against it.
  [[nodiscard]] const Candidate* believable(bool contradicted) const;
  /// The one with most support, to show something; nullptr when there is none.
  [[nodiscard]] const Candidate* best() const;
  void clear() { count_ = 0; }

 private:
  static constexpr std::size_t kMost = 24;
  [[nodiscard]] bool support(Candidate& candidate, const Observation& observation, const Guesses& guesses,
                             const Landmarks& landmarks, const MountedSensor& sensor) const;
  void propose(const Guess& guess, int landmark, int other);

  RiekfOptions options_;
  double gate3_;
  double gate2_;
  std::array<Candidate, kMost> all_{};
  std::size_t count_ = 0;
  std::int64_t clock_ = 0;
};

}  // namespace waymark
