#pragma once

#include <atomic>
#include <vector>

namespace waymark {

/// Scheduling of the thread that serves viewers next to the loop of a robot. It yields to the loop, does not
/// preempt it when a sample arrives, and avoids the processor that the loop last used. Needs no privileges.
/// Best effort: if the system refuses, viewers are served anyway.
class BackgroundThread {
 public:
  /// Called in the loop's thread; does not block.
  void note_robot_processor();
  /// Called once in the server's thread.
  void begin();
  /// Called in the server's thread whenever it starts to work.
  void avoid_robot_processor();
  /// The processor reserved for the robot; -1: none.
  [[nodiscard]] int left_alone() const { return left_alone_; }

 private:
  std::atomic<int> robots_{-1};  ///< processor that the loop last used
  std::vector<int> allowed_{};   ///< processors allowed for the server's thread
  int left_alone_ = -1;
};

}  // namespace waymark
