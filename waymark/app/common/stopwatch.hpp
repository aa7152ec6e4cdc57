#pragma once

#include <cstdint>

namespace waymark {

/// How long a job took, by the steady clock.
class Stopwatch {
 public:
  Stopwatch();
  [[nodiscard]] double seconds() const;

 private:
  std::int64_t start_ns_;
};

/// The most memory this process ever held [MiB].
[[nodiscard]] double peak_rss_mib();

}  // namespace waymark
