#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Trajectories and paths from files of several formats.
namespace waymark {

/// An estimate from a recording of any kind (`topic`, else /waymark/pose, else its only topic of poses) or a
/// TUM file, in time order. Fails on a file that is neither, a missing topic, and without poses.
[[nodiscard]] Result<EstimatedTrajectory> read_estimate(const std::string& path, const std::string& topic,
                                                        const JobControl& control = {});

/// Consistency of observations with the estimate, recorded by `waymark localize` on /waymark/nis.
struct NisSummary {
  double mean = 0;  ///< of accepted observations, over their degrees of freedom; 1 when consistent
  std::size_t observations = 0;  ///< accepted
  std::size_t rejected = 0;
};

/// Summary of the NIS of EST between two times; nothing if EST is not a recording or lacks this
/// topic.
[[nodiscard]] std::optional<NisSummary> read_nis(const std::string& path, SensorTime from, SensorTime to,
                                                 const JobControl& control = {});

/// Number of poses of EST on the topic of uncertain estimates, between two times.
[[nodiscard]] std::size_t count_uncertain(const std::string& path, SensorTime from, SensorTime to,
                                          const JobControl& control = {});

/// Reference with which an estimate is compared.
struct Reference {
  Trajectory timed{};  ///< empty if only the path is known
  FloorPath path{};
};

/// A reference from a recording (`topic`, else /truth/pose, else its only topic of poses), a TUM file, a
/// route.yaml, or a CSV file of corners. The CSV file has the columns x_m and y_m and is a path without
/// times; `closed`: the path returns to its first corner.
[[nodiscard]] Result<Reference> read_reference(const std::string& path, const std::string& topic, bool closed,
                                               const JobControl& control = {});

struct Motion {
  std::vector<Odometry> odometry{};
  std::vector<ImuSample> imu{};
};

/// The odometry and the gyro of a recording. Fails if it has no odometry.
[[nodiscard]] Result<Motion> read_motion(const std::string& path, const JobControl& control = {});

}  // namespace waymark
