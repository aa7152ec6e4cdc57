#pragma once

#include <concepts>
#include <type_traits>

#include "python/bindings/errors.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/pipeline/replayer.hpp"
#include "waymark/pose/multi_tag_pose.hpp"
#include "waymark/simulation/world/world.hpp"

/// The fields of structs, for pickle: `parts(value, apply)` calls `apply` with all fields in order. A field
/// that is added to a struct must be added here as well, or the code will not compile.
namespace waymark::python {

/// T or const T.
template <class Given, class T>
concept Like = std::same_as<std::remove_const_t<Given>, T>;

// Trajectories.
void parts(Like<StampedPose> auto& value, auto&& apply) {
  auto& [stamp, map_T_base] = value;
  apply(stamp, map_T_base);
}

// Worlds.
void parts(Like<Wall> auto& value, auto&& apply) {
  auto& [from_m, to_m, height_m, thickness_m, reflectance] = value;
  apply(from_m, to_m, height_m, thickness_m, reflectance);
}
void parts(Like<Occluder> auto& value, auto&& apply) {
  auto& [centre_m, yaw_rad, size_m, reflectance] = value;
  apply(centre_m, yaw_rad, size_m, reflectance);
}
void parts(Like<Panel> auto& value, auto&& apply) {
  auto& [map_T_panel, width_m, height_m, thickness_m, reflectance, tags] = value;
  apply(map_T_panel, width_m, height_m, thickness_m, reflectance, tags);
}
void parts(Like<KeepOut> auto& value, auto&& apply) {
  auto& [corners_m] = value;
  apply(corners_m);
}
void parts(Like<Floor> auto& value, auto&& apply) {
  auto& [texture, reflectance, contrast, cell_m] = value;
  apply(texture, reflectance, contrast, cell_m);
}
void parts(Like<TagCopy> auto& value, auto&& apply) {
  auto& [tag, placed] = value;
  apply(tag, placed);
}
void parts(Like<World> auto& value, auto&& apply) {
  auto& [name, tags, anchor, path_m, path_closed, copies, tag_margin_cells, tag_board_m,
         corners_through_paper, panels, walls, occluders, keep_outs, floor] = value;
  apply(name, tags, anchor, path_m, path_closed, copies, tag_margin_cells, tag_board_m, corners_through_paper,
        panels, walls, occluders, keep_outs, floor);
}

// Robots.
void parts(Like<Hull> auto& value, auto&& apply) {
  auto& [front_m, rear_m, width_m, height_m] = value;
  apply(front_m, rear_m, width_m, height_m);
}
void parts(Like<MotionLimits> auto& value, auto&& apply) {
  auto& [speed_m_s, yaw_rate_rad_s, acceleration_m_s2, yaw_acceleration_rad_s2] = value;
  apply(speed_m_s, yaw_rate_rad_s, acceleration_m_s2, yaw_acceleration_rad_s2);
}
void parts(Like<RobotModel> auto& value, auto&& apply) {
  auto& [name, hull, limits, wheel_radius_m, track_m, base_T_cam] = value;
  apply(name, hull, limits, wheel_radius_m, track_m, base_T_cam);
}
void parts(Like<MountedCamera> auto& value, auto&& apply) {
  auto& [name, camera, base_T_cam] = value;
  apply(name, camera, base_T_cam);
}
void parts(Like<CommissionFigures> auto& value, auto&& apply) {
  auto& [response_s, stopping_s, stopping_m, silence_stopping_s, kill_stopping_s, speed_scale,
         yaw_rate_scale] = value;
  apply(response_s, stopping_s, stopping_m, silence_stopping_s, kill_stopping_s, speed_scale, yaw_rate_scale);
}
void parts(Like<CommissionRecord> auto& value, auto&& apply) {
  auto& [passed, date, version, robot, topics, limits, wheel_radius_m, track_m, failed, figures] = value;
  apply(passed, date, version, robot, topics, limits, wheel_radius_m, track_m, failed, figures);
}
void parts(Like<Fault> auto& value, auto&& apply) {
  auto& [kind, at_s, for_s, tag, other, shift_m, turn_rad, map_T_copy, base_T_put, carry, jump_s, speed_share,
         yaw_share] = value;
  apply(kind, at_s, for_s, tag, other, shift_m, turn_rad, map_T_copy, base_T_put, carry, jump_s, speed_share,
        yaw_share);
}
void parts(Like<DynamicsOptions> auto& value, auto&& apply) {
  auto& [speed_lag_s, yaw_rate_lag_s, command_delay_s, turn_gain, lateral_slip_s, slip_noise_m_s, slip_time_s,
         drive, wheelbase_m, min_radius_m, steering_lag_s, steering_rate_rad_s] = value;
  apply(speed_lag_s, yaw_rate_lag_s, command_delay_s, turn_gain, lateral_slip_s, slip_noise_m_s, slip_time_s,
        drive, wheelbase_m, min_radius_m, steering_lag_s, steering_rate_rad_s);
}
void parts(Like<MotionSensorOptions> auto& value, auto&& apply) {
  auto& [left_wheel_scale, right_wheel_scale, ticks_per_turn, gyro_noise_rad_s, gyro_bias_rad_s,
         gyro_bias_walk, acceleration_noise_m_s2, odometry, rotation_scale, yaw_deadband_deg,
         odometry_noise_m, odometry_noise_rad] = value;
  apply(left_wheel_scale, right_wheel_scale, ticks_per_turn, gyro_noise_rad_s, gyro_bias_rad_s,
        gyro_bias_walk, acceleration_noise_m_s2, odometry, rotation_scale, yaw_deadband_deg, odometry_noise_m,
        odometry_noise_rad);
}
void parts(Like<TagCameraOptions> auto& value, auto&& apply) {
  auto& [corner_sigma_px, small_tag_sigma_px, miss_probability, max_range_m] = value;
  apply(corner_sigma_px, small_tag_sigma_px, miss_probability, max_range_m);
}
void parts(Like<LidarOptions> auto& value, auto&& apply) {
  auto& [rate_hz, rays, first_ray_deg, range_min_m, range_max_m, noise_m, dropout, x_m, y_m, z_m, yaw_deg] =
      value;
  apply(rate_hz, rays, first_ray_deg, range_min_m, range_max_m, noise_m, dropout, x_m, y_m, z_m, yaw_deg);
}
void parts(Like<SimulatedRobotOptions> auto& value, auto&& apply) {
  auto& [seed, camera_rate_hz, camera_latency_s, odometry_rate_hz, imu_rate_hz, truth_rate_hz, watchdog_s,
         dynamics, sensors, tag_camera, lidar, faults] = value;
  apply(seed, camera_rate_hz, camera_latency_s, odometry_rate_hz, imu_rate_hz, truth_rate_hz, watchdog_s,
        dynamics, sensors, tag_camera, lidar, faults);
}
void parts(Like<RobotDescription> auto& value, auto&& apply) {
  auto& [model, camera, simulation, camera_name, more_cameras, commissioned] = value;
  apply(model, camera, simulation, camera_name, more_cameras, commissioned);
}

// Poses of several tags.
void parts(Like<RejectedTag> auto& value, auto&& apply) {
  auto& [detection, tag, reason, words, chi2] = value;
  apply(detection, tag, reason, words, chi2);
}
void parts(Like<MultiTagPose> auto& value, auto&& apply) {
  auto& [estimates, rejected] = value;
  apply(estimates, rejected);
}

// Steps of a replay.
void parts(Like<VelocityCommand> auto& value, auto&& apply) {
  auto& [speed_m_s, yaw_rate_rad_s] = value;
  apply(speed_m_s, yaw_rate_rad_s);
}
void parts(Like<Station> auto& value, auto&& apply) {
  auto& [name, arc_length_m, pause_s] = value;
  apply(name, arc_length_m, pause_s);
}
void parts(Like<NisRecord> auto& value, auto&& apply) {
  auto& [stamp, tag, nis, rows, accepted, log_det] = value;
  apply(stamp, tag, nis, rows, accepted, log_det);
}
void parts(Like<RouteProgress> auto& value, auto&& apply) {
  auto& [index, arc_length_m, cross_track_m, heading_error_rad, map_T_route, leg_begin_m, leg_end_m] = value;
  apply(index, arc_length_m, cross_track_m, heading_error_rad, map_T_route, leg_begin_m, leg_end_m);
}
void parts(Like<ReplayStep> auto& value, auto&& apply) {
  auto& [state, command, reason, lasting, station, estimate, compared, progress, driven_m, turn_gain] = value;
  apply(state, command, reason, lasting, station, estimate, compared, progress, driven_m, turn_gain);
}

// Results of mapping a lap.
void parts(Like<OdometryScales> auto& value, auto&& apply) {
  auto& [distance, yaw, lateral_slip_s, camera_latency_s, turn_lead_s, yaw_bias_rad_s] = value;
  apply(distance, yaw, lateral_slip_s, camera_latency_s, turn_lead_s, yaw_bias_rad_s);
}
void parts(Like<WrongSize> auto& value, auto&& apply) {
  auto& [tag, given_m, found_m, sigma_m, deviations] = value;
  apply(tag, given_m, found_m, sigma_m, deviations);
}
void parts(Like<MovedTag> auto& value, auto&& apply) {
  auto& [tag, earlier, last_before_s, first_after_s, distance_m, angle_rad] = value;
  apply(tag, earlier, last_before_s, first_after_s, distance_m, angle_rad);
}
void parts(Like<MissingTag> auto& value, auto&& apply) {
  auto& [tag, expected_images, passes, last_seen_s] = value;
  apply(tag, expected_images, passes, last_seen_s);
}
void parts(Like<TagCut> auto& value, auto&& apply) {
  auto& [beyond, by, observations, otherwise_sigma_m] = value;
  apply(beyond, by, observations, otherwise_sigma_m);
}
void parts(Like<SensorExplanation> auto& value, auto&& apply) {
  auto& [fault, explained, sigma, log_odds, gyro_up] = value;
  apply(fault, explained, sigma, log_odds, gyro_up);
}
void parts(Like<SensorExplanations> auto& value, auto&& apply) {
  auto& [likely, rival, decided, intervals] = value;
  apply(likely, rival, decided, intervals);
}
void parts(Like<SensorFinding> auto& value, auto&& apply) {
  auto& [found, measure] = value;
  apply(found, measure);
}
void parts(Like<LoopClosure> auto& value, auto&& apply) {
  auto& [tag, away_s, way_m, before_m, before_rad, after_m] = value;
  apply(tag, away_s, way_m, before_m, before_rad, after_m);
}
void parts(Like<TurnNoise> auto& value, auto&& apply) {
  auto& [rad_sqrt_m, scale_sigma, stretches] = value;
  apply(rad_sqrt_m, scale_sigma, stretches);
}
void parts(Like<MountingEstimate> auto& value, auto&& apply) {
  auto& [base_T_cam, off, sigma, out, unobservable, scales, scales_sigma, camera, focal_scale,
         focal_scale_sigma] = value;
  apply(base_T_cam, off, sigma, out, unobservable, scales, scales_sigma, camera, focal_scale,
        focal_scale_sigma);
}
void parts(Like<BundleFigures> auto& value, auto&& apply) {
  auto& [start_map, start_trajectory, iterations, rms_px, noise_ratio, wrong_sizes, moved_tags, missing_tags,
         thin_cuts, size_spread, size_scale, size_scale_sigma, correlated_frames, rejected, left_out,
         odometry_scales, odometry_scales_sigma, prior_agreeing, moved_m, loop, mounting, mounting_used,
         turn_noise, turns_by_gyro, without_gyro_share] = value;
  apply(start_map, start_trajectory, iterations, rms_px, noise_ratio, wrong_sizes, moved_tags, missing_tags,
        thin_cuts, size_spread, size_scale, size_scale_sigma, correlated_frames, rejected, left_out,
        odometry_scales, odometry_scales_sigma, prior_agreeing, moved_m, loop, mounting, mounting_used,
        turn_noise, turns_by_gyro, without_gyro_share);
}
void parts(Like<MappedLap> auto& value, auto&& apply) {
  auto& [map, observations, trajectory, trajectory_covariance, route, route_repeated_m, frames,
         frames_without_pose, warnings, bundle, sensors] = value;
  apply(map, observations, trajectory, trajectory_covariance, route, route_repeated_m, frames,
        frames_without_pose, warnings, bundle, sensors);
}
void parts(Like<TagMapErrors> auto& value, auto&& apply) {
  auto& [tags, rmse_m, max_m, orientation_rmse_deg, missing, unknown] = value;
  apply(tags, rmse_m, max_m, orientation_rmse_deg, missing, unknown);
}
void parts(Like<TrajectoryErrors> auto& value, auto&& apply) {
  auto& [poses, rmse_m, max_m, orientation_rmse_deg] = value;
  apply(poses, rmse_m, max_m, orientation_rmse_deg);
}
void parts(Like<PoseLapFigures> auto& value, auto&& apply) {
  auto& [scales, scales_sigma, base_X_assumed, mounting_sigma, rms_m] = value;
  apply(scales, scales_sigma, base_X_assumed, mounting_sigma, rms_m);
}
void parts(Like<NearestTag> auto& value, auto&& apply) {
  auto& [tag, clearance_m, arc_length_m, map_T_base] = value;
  apply(tag, clearance_m, arc_length_m, map_T_base);
}
void parts(Like<MapReport> auto& value, auto&& apply) {
  auto& [method, lap, true_tags, true_path, truth_aligned, tag_errors, trajectory_errors, prior_agreeing,
         prior_rms_m, extends, poses, nearest_tag, odometry, warnings, files, renamed_files, wall_s,
         peak_rss_mib] = value;
  apply(method, lap, true_tags, true_path, truth_aligned, tag_errors, trajectory_errors, prior_agreeing,
        prior_rms_m, extends, poses, nearest_tag, odometry, warnings, files, renamed_files, wall_s,
        peak_rss_mib);
}

/// Whether parts() has an overload for T.
template <class T>
concept HasParts = requires(const T& value) { parts(value, [](const auto&...) {}); };

constexpr FaultKind last_of(FaultKind) { return FaultKind::BatterySag; }
constexpr RejectReason last_of(RejectReason) { return RejectReason::UnreliableCorners; }
constexpr ReplayState last_of(ReplayState) { return ReplayState::Incomplete; }
constexpr SensorFault last_of(SensorFault) { return SensorFault::ObservedUnrelated; }
constexpr SensorMeasure last_of(SensorMeasure) { return SensorMeasure::GyroNotUsed; }

/// A value to be filled: default-constructed, or with a placeholder camera for types that need one.
template <class T>
[[nodiscard]] T blank() {
  if constexpr (std::is_default_constructible_v<T>) {
    return T();
  } else {
    const CameraModel camera = value_of(CameraModel::make(PinholeRadtan{1, 1, 0.5, 0.5}, 1, 1));
    if constexpr (std::is_same_v<T, RobotDescription>) {
      return {.model = {}, .camera = camera};
    } else {
      return {.camera = camera};
    }
  }
}

}  // namespace waymark::python
