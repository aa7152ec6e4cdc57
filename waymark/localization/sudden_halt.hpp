#pragma once

#include "waymark/localization/riekf.hpp"

namespace waymark {

/// Wheels that stop within one message, harder than a robot can: their encoders may have failed, and the
/// robot may go on as fast as it went. Until tags have said that it stands, its way is uncertain by as much.
class SuddenHalt {
 public:
  /// The step with the variance that the doubt adds: of the position, and of the heading where no gyro tells
  /// of it. Constant time.
  [[nodiscard]] MotionStep advance(MotionStep step);
  [[nodiscard]] bool doubted() const { return doubted_; }
  /// Tags of a picture corrected the position by so much: by almost nothing where the robot stands.
  void observe_correction(double moved_m);

 private:
  double speed_m_s_ = 0;  ///< of the last step that told of a way
  double yaw_rate_rad_s_ = 0;
  double since_s_ = 0;  ///< the halt, or the newest picture with tags after it
  bool doubted_ = false;
};

}  // namespace waymark
