#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <thread>

#include "waymark/cli/interrupt.hpp"

namespace waymark::cli {

/// Waits until what is `time` in the recording is due.
class Pace {
 public:
  explicit Pace(double speed) : speed_(speed) {}

  /// False when Ctrl-C ended the waiting.
  bool wait_for(std::int64_t time_ns) {
    using std::chrono::steady_clock;
    if (!first_ns_) first_ns_ = time_ns;
    if (speed_ <= 0) return !interrupted();
    const double since_s =
        static_cast<double>(std::max<std::int64_t>(0, time_ns - *first_ns_)) * 1e-9 / speed_;
    const auto due = begin_ + std::chrono::duration_cast<steady_clock::duration>(
                                  std::chrono::duration<double>(std::min(since_s, kLongest_s)));
    // In slices, so that Ctrl-C is handled.
    while (!interrupted() && steady_clock::now() < due)
      std::this_thread::sleep_for(std::min<steady_clock::duration>(due - steady_clock::now(), kSlice));
    return !interrupted();
  }

 private:
  static constexpr double kLongest_s = 1e8;
  static constexpr std::chrono::milliseconds kSlice{50};

  double speed_;
  std::optional<std::int64_t> first_ns_{};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace waymark::cli
