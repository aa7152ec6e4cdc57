#include "waymark/base/random.hpp"

#include <cassert>
#include <cmath>

namespace waymark {

double Random::uniform() { return static_cast<double>(engine_() >> 11) * 0x1.0p-53; }

double Random::uniform(double low, double high) { return low + (high - low) * uniform(); }

std::uint64_t Random::index(std::uint64_t count) {
  assert(count > 0);
  const std::uint64_t limit = engine_.max() - engine_.max() % count;  // rejection keeps it unbiased
  std::uint64_t draw = engine_();
  while (draw >= limit) draw = engine_();
  return draw % count;
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_;
  }
  double u = 0.0;
  double v = 0.0;
  double s = 0.0;
  do {
    u = uniform(-1.0, 1.0);
    v = uniform(-1.0, 1.0);
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  const double scale = std::sqrt(-2.0 * std::log(s) / s);
  spare_ = v * scale;
  has_spare_ = true;
  return u * scale;
}

double Random::normal(double mean, double sigma) { return mean + sigma * normal(); }

Random Random::fork() { return Random(engine_()); }

}  // namespace waymark
