#pragma once

#include <atomic>
#include <vector>

namespace waymark {

/// The thread that serves viewers, beside the loop of a robot: it waits where the loop wants the processor,
/// does not interrupt it when a sample wakes it, and works on another processor than the loop did last.
/// Needs no privilege. Best effort: a system that refuses serves viewers all the same.
class BackgroundThread {
 public:
  /// In the loop's thread; never waits.
  void robot_is_here();
  /// In the server's thread, once.
  void begin();
  /// In the server's thread, whenever it begins to work.
  void keep_off_the_robot();
  /// The processor that is left to the robot; -1: none.
  [[nodiscard]] int left_alone() const { return left_alone_; }

 private:
  std::atomic<int> robots_{-1};  ///< processor
  std::vector<int> allowed_{};   ///< processors of the server's thread
  int left_alone_ = -1;
};

}  // namespace waymark
