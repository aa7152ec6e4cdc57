#pragma once

#include <cstdint>
#include <random>

namespace waymark {

/// Random numbers from a given seed. The same seed gives the same numbers on every platform. The standard
/// specifies the engine but not the distributions, so these are implemented here. Draw only once per
/// statement, because the evaluation order of arguments differs between compilers.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Uniform in [low, high).
  [[nodiscard]] double uniform(double low, double high);
  /// Uniform integer in [0, count); count > 0.
  [[nodiscard]] std::uint64_t index(std::uint64_t count);
  /// Standard normal, by Marsaglia's polar method (Marsaglia and Bray, "A convenient method for generating
  /// normal variables", SIAM Review 6, 1964).
  [[nodiscard]] double normal();
  /// Normal with the given mean and standard deviation.
  [[nodiscard]] double normal(double mean, double sigma);
  /// An independent stream, e.g. one per sensor, so that extra draws from one do not affect the others.
  [[nodiscard]] Random fork();

 private:
  std::mt19937_64 engine_;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace waymark
