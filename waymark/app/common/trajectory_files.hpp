#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/error.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Reads trajectories and paths from files in several formats.
namespace waymark {

/// Reads an estimate from a recording of any kind (from `topic`, else /waymark/pose, else the only topic with
/// poses) or from a TUM file, in time order. Fails if the file is neither, if the topic is missing, or if
/// there are no poses.
[[nodiscard]] Result<EstimatedTrajectory> read_estimate(const std::string& path, const std::string& topic,
                                                        const JobControl& control = {});

/// Consistency of the observations with the estimate, recorded by `waymark localize` on /waymark/nis.
struct NisSummary {
  double mean = 0;  ///< mean NIS of accepted observations divided by their degrees of freedom; 1 if they are
                    ///< consistent
  std::size_t observations = 0;  ///< number of accepted observations
  std::size_t rejected = 0;
};

/// Summarizes the NIS recorded in EST between two times; `nullopt` if EST is not a recording or lacks this
/// topic.
[[nodiscard]] std::optional<NisSummary> read_nis(const std::string& path, SensorTime from, SensorTime to,
                                                 const JobControl& control = {});

/// Number of poses in EST on the topic of uncertain estimates, between two times.
[[nodiscard]] std::size_t count_uncertain(const std::string& path, SensorTime from, SensorTime to,
                                          const JobControl& control = {});

/// A reference with which an estimate is compared.
struct Reference {
  Trajectory timed{};  ///< empty if only the path is known
  FloorPath path{};
};

/// Reads a reference from a recording (from `topic`, else /truth/pose, else the only topic with poses), a TUM
/// file, a route.yaml, or a CSV file of corners. The CSV file has the columns x_m and y_m and describes a
/// path without times; if `closed`, the path returns to its first corner.
[[nodiscard]] Result<Reference> read_reference(const std::string& path, const std::string& topic, bool closed,
                                               const JobControl& control = {});

struct Motion {
  std::vector<Odometry> odometry{};
  std::vector<ImuSample> imu{};
};

/// Reads the odometry and the gyro data from a recording. Fails if it has no odometry.
[[nodiscard]] Result<Motion> read_motion(const std::string& path, const JobControl& control = {});

}  // namespace waymark
