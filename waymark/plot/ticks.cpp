#include "waymark/plot/ticks.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace waymark::plot {
namespace {

double power_of_ten(int exponent) { return std::pow(10.0, exponent); }

/// The step of 1, 2 or 5 times a power of ten nearest above `raw`.
double nice_step(double raw) {
  const double power = power_of_ten(static_cast<int>(std::floor(std::log10(raw))));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= raw * (1 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

/// With as many decimals as the step has; with an exponent where that would be long.
std::string label_of(double value, double step) {
  if (value == 0.0) return "0";
  const double size = std::abs(value);
  if (size >= 1e6 || step < 1e-5) return fmt::format("{:.6g}", value);
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  return fmt::format("{:.{}f}", value, decimals);
}

std::vector<Tick> ticks_every(double step, double low, double high, int wanted) {
  std::vector<Tick> ticks;
  if (!(step > 0.0) || !std::isfinite(step)) return ticks;
  const double slack = 1e-9 * (high - low);
  const double first = std::ceil((low - slack) / step);
  for (int i = 0; i <= 4 * wanted + 10; ++i) {
    const double value = (first + i) * step;
    if (value > high + slack) break;
    ticks.push_back({value, label_of(value, step)});
  }
  return ticks;
}

}  // namespace

std::vector<Tick> linear_ticks(double low, double high, int wanted) {
  const double raw = (high - low) / std::max(1, wanted);
  std::vector<Tick> ticks = ticks_every(nice_step(raw), low, high, wanted);
  // Steps of five can leave out a range of four; the next finer ones cannot.
  if (ticks.empty()) ticks = ticks_every(nice_step(nice_step(raw) / 2.5), low, high, wanted);
  return ticks;
}

std::vector<Tick> log_ticks(double low, double high) {
  const int first = static_cast<int>(std::floor(std::log10(low)));
  const int last = static_cast<int>(std::floor(std::log10(high)));
  const bool few = last - first < 2;
  std::vector<Tick> ticks;
  for (int exponent = first; exponent <= last; ++exponent) {
    for (int factor = 1; factor <= 9; ++factor) {
      const double value = factor * power_of_ten(exponent);
      if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
      const bool labelled = factor == 1 || (few && (factor == 2 || factor == 5));
      ticks.push_back({value, labelled ? fmt::format("{:g}", value) : std::string()});
    }
  }
  return ticks;
}

}  // namespace waymark::plot
