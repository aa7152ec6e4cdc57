#pragma once

#include <atomic>
#include <vector>

namespace waymark {

/// Schedules the thread that serves viewers alongside the robot loop. This thread yields to the loop, does
/// not preempt it when a sample arrives, and avoids the processor that the loop used last. Needs no
/// privileges. If the system refuses these settings, viewers are served without them.
class BackgroundThread {
 public:
  /// Call on the thread of the loop. Does not block.
  void note_robot_processor();
  /// Call once on the server's thread.
  void begin();
  /// Call on the server's thread whenever it starts to work.
  void avoid_robot_processor();
  /// The processor reserved for the robot; -1 if there is none.
  [[nodiscard]] int left_alone() const { return left_alone_; }

 private:
  std::atomic<int> robots_{-1};  ///< processor that the loop used last
  std::vector<int> allowed_{};   ///< processors that the server's thread may use
  int left_alone_ = -1;
};

}  // namespace waymark
