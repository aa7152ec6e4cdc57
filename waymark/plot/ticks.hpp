#pragma once

#include <string>
#include <vector>

namespace waymark::plot {

/// A mark on an axis.
struct Tick {
  double value = 0;
  std::string label;  ///< empty for minor ticks

  friend bool operator==(const Tick&, const Tick&) = default;
};

/// Round numbers (1, 2 or 5 times a power of ten apart) inside [low, high], about `wanted` of them (Heckbert,
/// "Nice numbers for graph labels", Graphics Gems, 1990). low < high, both finite.
[[nodiscard]] std::vector<Tick> linear_ticks(double low, double high, int wanted);

/// Powers of ten inside [low, high] with their multiples as minor ticks; where there are fewer than two
/// powers, 2 and 5 times them are labelled as well. 0 < low < high, both finite.
[[nodiscard]] std::vector<Tick> log_ticks(double low, double high);

}  // namespace waymark::plot
