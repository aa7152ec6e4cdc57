#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/localization/landmarks.hpp"

namespace waymark {

/// What an observation says about the landmark, at the estimate it was compared with.
struct WatchedObservation {
  int landmark = 0;
  double nis_per_row = 0;
  bool accepted = false;
  Eigen::Vector2d map_p_implied = Eigen::Vector2d::Zero();  ///< where the landmark would be
  double range_ratio = 1;                                   ///< distance as measured over as expected
  double off_direction_rad = 0;                             ///< beside the expected line of sight
};

/// Statistics of what each landmark of the map is seen to do, and what they mean in words. A landmark that
/// contradicts while the others agree is not used any more, until it fits again.
class TagWatch {
 public:
  explicit TagWatch(const Landmarks& landmarks);

  /// Of an observation that was accepted, or of one that was not.
  void add(const WatchedObservation& seen);
  /// The estimate was confirmed by landmarks that were accepted: what contradicted since the last time was
  /// really wrong.
  void confirm();
  /// The estimate was wrong, not the landmarks.
  void forget_pending();

  [[nodiscard]] bool usable(int landmark) const { return !at(landmark).excluded; }
  /// "tag36h11:5 and tag36h11:6 are swapped in the map …"; in order of id.
  [[nodiscard]] std::vector<std::string> findings() const;
  /// Mean NIS over its degrees of freedom of the observations that were accepted; 0 when there are none.
  [[nodiscard]] double mean_nis_per_row(int landmark) const;
  [[nodiscard]] int observations(int landmark) const { return at(landmark).seen; }
  [[nodiscard]] int contradictions(int landmark) const { return at(landmark).wrong.count; }

 private:
  struct Sums {
    int count = 0;
    Eigen::Vector2d p = Eigen::Vector2d::Zero();
    double p2 = 0;
    double ratio = 0;
    double ratio2 = 0;
    double direction = 0;
    void add(const WatchedObservation& seen);
    void add(const Sums& other);
  };
  struct One {
    int seen = 0;
    int accepted = 0;
    int accepted_in_a_row = 0;
    double nis_sum = 0;
    Sums wrong{};
    Sums pending{};
    bool excluded = false;
  };
  [[nodiscard]] const One& at(int landmark) const { return all_[static_cast<std::size_t>(landmark)]; }
  [[nodiscard]] bool swapped(int a, int b) const;
  [[nodiscard]] std::string words(int landmark) const;
  [[nodiscard]] std::optional<std::string> words_of_second(int landmark) const;
  [[nodiscard]] std::string name(int landmark) const;

  Landmarks landmarks_;
  std::vector<One> all_;
};

}  // namespace waymark
