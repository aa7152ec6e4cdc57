#pragma once

#include <deque>
#include <optional>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Pictures that wait for the detector: of each camera the newest alone, so that a slow detector never works
/// on what is long past.
class PictureQueue {
 public:
  /// Takes the place of a picture of the same camera that still waits, and counts that one as dropped.
  void push(CameraFrame picture);
  /// The one that waits longest; nothing when none waits.
  [[nodiscard]] std::optional<CameraFrame> pop();
  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  [[nodiscard]] int dropped() const { return dropped_; }

 private:
  std::deque<CameraFrame> waiting_{};
  int dropped_ = 0;
};

}  // namespace waymark
