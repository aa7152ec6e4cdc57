#pragma once

#include <string>

#include "waymark/base/fields.hpp"

namespace waymark {

/// How far the motion that is measured may be from the true one. All densities: they are multiplied by the
/// distance, the turn or the time of a step and its rate does not matter.
struct MotionNoise {
  double along_m_sqrt_m = 0.01;
  double across_m_sqrt_m = 0.01;
  double yaw_rad_sqrt_m = 0.005;
  double yaw_rad_sqrt_rad = 0.01;
  double yaw_rad_sqrt_s = 0.001;
  double drift_m_sqrt_s = 0.0002;
  double slide_m_s = 0;
  double slide_time_s = 0.05;
  double distance_scale_sigma = 0.03;
  double yaw_scale_sigma = 0.03;
  double yaw_bias_sigma_rad_s = 0.005;
  double slip_sigma_s = 0.03;
  double crab_sigma_rad = 0;
  double crab_share = 0;
  double slow_time_s = 300;
  double slip_share = 1;
  /// No setting of a robot's: the parts a look divides a message of motion into err apart, so that the
  /// covariance does not depend on where it divides. A search for the latency compares runs that differ in
  /// just that.
  bool parts_err_apart = false;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.along_m_sqrt_m,
          Field{"along_m_sqrt_m", "Noise of the distance driven, m per square root of a metre.", 0, 10});
    visit(self.across_m_sqrt_m,
          Field{"across_m_sqrt_m", "Sideways noise, m per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_m,
          Field{"yaw_rad_sqrt_m", "Heading noise, rad per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_rad,
          Field{"yaw_rad_sqrt_rad", "Heading noise of turning, rad per square root of a radian.", 0, 10});
    visit(self.yaw_rad_sqrt_s,
          Field{"yaw_rad_sqrt_s", "Heading noise while moving, rad per square root of a second.", 0, 10});
    visit(self.drift_m_sqrt_s,
          Field{"drift_m_sqrt_s", "Noise of x and y whatever the robot does, m per square root of a second.",
                0, 10});
    visit(
        self.slide_m_s,
        Field{"slide_m_s", "Sideways speed that comes and goes while the robot moves, m/s; 0: none.", 0, 1});
    visit(self.slide_time_s, Field{"slide_time_s", "How long it lasts, s.", 1e-3, 10});
    visit(self.distance_scale_sigma,
          Field{"distance_scale_sigma", "How wrong the scale of the distance may be; 0: it is right.", 0, 1});
    visit(self.yaw_scale_sigma,
          Field{"yaw_scale_sigma", "How wrong the scale of turning may be; 0: it is right.", 0, 1});
    visit(
        self.yaw_bias_sigma_rad_s,
        Field{"yaw_bias_sigma_rad_s", "How large the bias of the yaw rate may be; 0: there is none.", 0, 1});
    visit(self.slip_sigma_s,
          Field{"slip_sigma_s", "How large sideways speed per speed and yaw rate may be; 0: there is none.",
                0, 1});
    visit(self.crab_sigma_rad,
          Field{"crab_sigma_rad",
                "How far odometry may go askew to the robot's heading; 0: straight ahead. For odometry whose "
                "heading error turns no distance.",
                0, 1});
    visit(
        self.crab_share,
        Field{"crab_share",
              "What share of the heading noise leaves the direction of the way as it was; 1: odometry whose "
              "heading error turns no distance, as of a simulator.",
              0, 1});
    visit(self.slow_time_s, Field{"slow_time_s", "These five wander by their sigma in this time.", 1, 1e9});
    visit(self.slip_share,
          Field{"slip_share",
                "What gyro and wheels disagree in turning is added to the noise of the motion by this share.",
                0, 10});
  }
};

/// What the filters are told. Which error coordinates it uses makes a filter the right-invariant or the plain
/// one; all else is the same.
struct RiekfOptions {
  MotionNoise motion{};
  double corner_sigma_px = 0.3;
  double corner_noise_ratio = 1;
  double tag_sigma_m = 0.002;
  double tag_sigma_rad = 0.003;
  double tag_time_s = 30;
  double mounting_sigma_m = 0.001;
  double mounting_sigma_rad = 0.002;
  double farthest_m = 0;
  double gate = 0.9999;
  double uncertain_after_s = 0.3;
  double certain_sigma_m = 0.5;
  double camera_latency_s = 0;
  double point_sigma_m = 0.03;
  double point_sigma_share = 0.01;
  double range_sigma_m = 0.03;
  double bearing_sigma_rad = 0.026;
  std::string rotation = "auto";
  double odometry_scale = 1;
  double yaw_gain = 1;
  double gyro_gain = 1;
  double gyro_bias_rad_s = 0;
  double sight_scale = 1;
  double lag_s = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.motion, Field{"motion", "How far measured motion is from the true one."});
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Noise of corners whose covariance is not known, px.", 1e-3, 100});
    visit(self.corner_noise_ratio,
          Field{"corner_noise_ratio", "Corners are so many times less certain than they say.", 0.1, 100});
    visit(
        self.tag_sigma_m,
        Field{"tag_sigma_m",
              "How far each tag seems to be from its place in the map, beyond what the map says itself. Such "
              "errors stay: seeing the tag again does not average them away.",
              0, 10});
    visit(self.tag_sigma_rad, Field{"tag_sigma_rad", "The same for its direction.", 0, 3});
    visit(self.tag_time_s, Field{"tag_time_s", "How long such an error lasts.", 1e-3, 1e9});
    visit(self.mounting_sigma_m,
          Field{"mounting_sigma_m", "How well it is known where the camera sits.", 0, 1});
    visit(self.mounting_sigma_rad, Field{"mounting_sigma_rad", "How well it is known where it looks.", 0, 1});
    visit(self.farthest_m, Field{"farthest_m", "Farther tags and landmarks are not used; 0: all are.", 0});
    visit(self.gate,
          Field{"gate", "A sighting less likely than 1 minus this is not believed.", 0.5, 1 - 1e-9});
    visit(self.uncertain_after_s,
          Field{"uncertain_after_s", "So long may everything seen contradict before it is said.", 0, 60});
    visit(self.certain_sigma_m,
          Field{"certain_sigma_m", "An estimate less certain than this is called uncertain.", 1e-3, 100});
    visit(self.camera_latency_s,
          Field{"camera_latency_s", "Tags were seen so long before their stamps.", -1, 1});
    visit(self.point_sigma_m,
          Field{"point_sigma_m", "Noise of tags whose corners are not in the log: their place on the floor.",
                1e-4, 10});
    visit(self.point_sigma_share, Field{"point_sigma_share", "The same as a share of their distance.", 0, 1});
    visit(self.range_sigma_m, Field{"range_sigma_m", "Noise of measured distances.", 1e-4, 10});
    visit(self.bearing_sigma_rad, Field{"bearing_sigma_rad", "Noise of measured directions.", 1e-5, 3});
    visit(self.rotation,
          Field{"rotation",
                "What says how the robot turned: odometry, gyro, or auto: the gyro where there is one."});
    visit(self.odometry_scale,
          Field{"odometry_scale", "True distance over that of the wheels (calibration).", 0.1, 10});
    visit(self.yaw_gain, Field{"yaw_gain", "True turn over that of the wheels (calibration).", 0.1, 10});
    visit(self.gyro_gain, Field{"gyro_gain", "True turn over that of the gyro (calibration).", 0.1, 10});
    visit(self.gyro_bias_rad_s,
          Field{"gyro_bias_rad_s", "What the gyro says at rest (calibration).", -10, 10});
    visit(self.sight_scale,
          Field{"sight_scale",
                "True distance over that of tags whose corners are not in the log (calibration).", 0.1, 10});
    visit(self.lag_s,
          Field{"lag_s",
                "Method smoother: so long it waits before it says where the robot was; 0: until the end.", 0,
                10});
  }
};

}  // namespace waymark
