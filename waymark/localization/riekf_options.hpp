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
  double wheel_yaw_rad_sqrt_m = 0;
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
          Field{"along_m_sqrt_m", "Noise of the driven distance, m per square root of a metre.", 0, 10});
    visit(self.across_m_sqrt_m,
          Field{"across_m_sqrt_m", "Lateral noise of the motion, m per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_m,
          Field{"yaw_rad_sqrt_m", "Heading noise of driving, rad per square root of a metre.", 0, 10});
    visit(self.yaw_rad_sqrt_rad,
          Field{"yaw_rad_sqrt_rad", "Heading noise of turning, rad per square root of a radian.", 0, 10});
    visit(self.yaw_rad_sqrt_s,
          Field{"yaw_rad_sqrt_s", "Heading noise while moving, rad per square root of a second.", 0, 10});
    visit(self.wheel_yaw_rad_sqrt_m,
          Field{"wheel_yaw_rad_sqrt_m",
                "Heading noise of driving that is added where the odometry tells the rotation, and not a "
                "gyro, rad per square root of a metre.",
                0, 10});
    visit(self.drift_m_sqrt_s,
          Field{"drift_m_sqrt_s", "Noise of x and y at rest and in motion, m per square root of a second.", 0,
                10});
    visit(
        self.slide_m_s,
        Field{"slide_m_s",
              "Standard deviation of a time-correlated lateral velocity while the robot moves, m/s; 0: none.",
              0, 1});
    visit(self.slide_time_s, Field{"slide_time_s", "Correlation time of the lateral velocity, s.", 1e-3, 10});
    visit(self.distance_scale_sigma,
          Field{"distance_scale_sigma", "Standard deviation of the odometry scale; 0: it is exact.", 0, 1});
    visit(self.yaw_scale_sigma,
          Field{"yaw_scale_sigma", "Standard deviation of the yaw scale; 0: it is exact.", 0, 1});
    visit(self.yaw_bias_sigma_rad_s,
          Field{"yaw_bias_sigma_rad_s", "Standard deviation of the bias of the yaw rate; 0: there is none.",
                0, 1});
    visit(self.slip_sigma_s, Field{"slip_sigma_s",
                                   "Standard deviation of the lateral slip (lateral velocity per speed and "
                                   "yaw rate); 0: there is none.",
                                   0, 1});
    visit(
        self.crab_sigma_rad,
        Field{"crab_sigma_rad",
              "Standard deviation of the angle between the odometry's direction of motion and the robot's "
              "heading; 0: there is none. For odometry whose heading error does not rotate its translation.",
              0, 1});
    visit(self.crab_share,
          Field{"crab_share",
                "Share of the heading noise that does not rotate the translation; 1: odometry of some "
                "simulators, whose heading error leaves the translation unrotated.",
                0, 1});
    visit(
        self.slow_time_s,
        Field{"slow_time_s", "Time constant of the bias states (scales, biases, slip, crab angle).", 1, 1e9});
    visit(self.slip_share, Field{"slip_share",
                                 "Share of the disagreement between gyro and wheels in turning that is added "
                                 "to the noise of the motion.",
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
  double camera_readout_s = 0;
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
    visit(self.motion, Field{"motion", "Noise of the measured motion."});
    visit(self.corner_sigma_px,
          Field{"corner_sigma_px", "Standard deviation of corners without a covariance of their own, px.",
                1e-3, 100});
    visit(self.corner_noise_ratio,
          Field{"corner_noise_ratio", "Scale on the standard deviation of corners.", 0.1, 100});
    visit(self.tag_sigma_m, Field{"tag_sigma_m",
                                  "Standard deviation of a lasting position error of each tag, beyond the "
                                  "covariance in the map; repeated observations do not average it away.",
                                  0, 10});
    visit(self.tag_sigma_rad, Field{"tag_sigma_rad",
                                    "Standard deviation of a lasting orientation error of each tag, beyond "
                                    "the covariance in the map.",
                                    0, 3});
    visit(self.tag_time_s, Field{"tag_time_s", "Correlation time of the lasting errors of tags.", 1e-3, 1e9});
    visit(self.mounting_sigma_m,
          Field{"mounting_sigma_m", "Standard deviation of the position of the camera on the robot.", 0, 1});
    visit(self.mounting_sigma_rad,
          Field{"mounting_sigma_rad", "Standard deviation of the orientation of the camera on the robot.", 0,
                1});
    visit(self.farthest_m,
          Field{"farthest_m", "Maximum distance of tags and landmarks that are used; 0: no limit.", 0});
    visit(
        self.gate,
        Field{"gate",
              "Probability of the chi-square gate: an observation less likely than 1 minus this is rejected.",
              0.5, 1 - 1e-9});
    visit(
        self.uncertain_after_s,
        Field{"uncertain_after_s",
              "Time for which all observations may be rejected before the estimate is declared inconsistent.",
              0, 60});
    visit(self.certain_sigma_m,
          Field{"certain_sigma_m",
                "Standard deviation of the position above which the estimate is reported as uncertain.", 1e-3,
                100});
    visit(
        self.camera_latency_s,
        Field{"camera_latency_s", "Camera latency: time from the exposure to the stamp of a frame.", -1, 1});
    visit(
        self.camera_readout_s,
        Field{
            "camera_readout_s",
            "Time from the first row to the last of a rolling shutter, negative when rows are read from the "
            "bottom; stamps are the middle row's; 0: global shutter.",
            -0.2, 0.2});
    visit(self.point_sigma_m,
          Field{"point_sigma_m",
                "Standard deviation of the floor position of tags without corners in the log.", 1e-4, 10});
    visit(
        self.point_sigma_share,
        Field{
            "point_sigma_share",
            "Standard deviation of the floor position of tags without corners, as a share of their distance.",
            0, 1});
    visit(self.range_sigma_m, Field{"range_sigma_m", "Standard deviation of measured ranges.", 1e-4, 10});
    visit(self.bearing_sigma_rad,
          Field{"bearing_sigma_rad", "Standard deviation of measured bearings.", 1e-5, 3});
    visit(
        self.rotation,
        Field{"rotation", "Source of the rotation: odometry, gyro, or auto (the gyro where there is one)."});
    visit(self.odometry_scale,
          Field{"odometry_scale", "Odometry scale from calibration: true distance over measured distance.",
                0.1, 10});
    visit(
        self.yaw_gain,
        Field{"yaw_gain", "Yaw scale of the odometry from calibration: true rotation over measured rotation.",
              0.1, 10});
    visit(self.gyro_gain,
          Field{"gyro_gain", "Scale of the gyro from calibration: true rotation over measured rotation.", 0.1,
                10});
    visit(self.gyro_bias_rad_s,
          Field{"gyro_bias_rad_s", "Bias of the gyro at rest from calibration.", -10, 10});
    visit(self.sight_scale, Field{"sight_scale",
                                  "Scale of the distance of tags without corners from calibration: true "
                                  "distance over measured distance.",
                                  0.1, 10});
    visit(self.lag_s,
          Field{"lag_s",
                "Delay of the fixed-lag smoother (method smoother); 0: the whole recording is smoothed.", 0,
                10});
  }
};

}  // namespace waymark
