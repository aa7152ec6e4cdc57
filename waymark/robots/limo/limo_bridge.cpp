#include "waymark/robots/limo/limo_bridge.hpp"

#include <utility>

namespace waymark {

std::vector<Sample> LimoBridge::imu(const LimoFrame& frame, SensorTime stamp) {
  const Eigen::Vector3d angular_velocity_rad_s = decode_angular_velocity_rad_s(frame);
  odometry_.receive_angular_velocity(angular_velocity_rad_s.z(), stamp);
  return {ImuSample{.stamp = stamp,
                    .angular_velocity_rad_s = angular_velocity_rad_s,
                    .linear_acceleration_m_s2 = acceleration_m_s2_}};
}

std::vector<Sample> LimoBridge::receive(const LimoFrame& frame, LimoDrive drive, Duration arrived,
                                        bool lost) {
  // Whichever message was lost: that of any clock may be.
  if (lost) lost_motion_ = lost_odometer_ = lost_gyro_ = lost_yaw_ = true;
  switch (static_cast<LimoId>(frame.id)) {
    case LimoId::MotionFeedback: {
      const SensorTime stamp = motion_clock_.stamp(arrived, std::exchange(lost_motion_, false));
      const auto motion = decode_motion(frame);
      const auto odometry = motion ? odometry_.receive(*motion, drive, stamp) : std::nullopt;
      if (odometry) return {*odometry};
      ++refused_;
      return {};
    }
    case LimoId::Odometer: {
      const LimoOdometer odometer = decode_odometer(frame);
      return {WheelTicks{.stamp = odometer_clock_.stamp(arrived, std::exchange(lost_odometer_, false)),
                         .left_rad = odometer.left_m / wheel_radius_m_,
                         .right_rad = odometer.right_m / wheel_radius_m_}};
    }
    case LimoId::Acceleration:
      acceleration_m_s2_ = decode_acceleration_m_s2(frame);
      return {};
    case LimoId::AngularVelocity:
      return imu(frame, gyro_clock_.stamp(arrived, std::exchange(lost_gyro_, false)));
    case LimoId::Attitude:
      odometry_.receive_yaw(decode_attitude_rad(frame).x(),
                            yaw_clock_.stamp(arrived, std::exchange(lost_yaw_, false)));
      return {};
    default:
      return {};
  }
}

}  // namespace waymark
