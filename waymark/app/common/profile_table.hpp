#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"

/// The profile of a recording that `waymark simulate` imitates (`like`), and a comparison with the
/// simulation.
namespace waymark {

/// Measures the profile of a recording of any kind. Fails without odometry, because the speeds are then
/// unknown.
[[nodiscard]] Result<RecordingProfile> profile_of(const std::string& path, const JobControl& control);

/// Median delay between the timestamp of a camera sample and its log time [s], for the topic with the most
/// samples. `nullopt` if the log time is the timestamp, or if there are fewer than 20 samples.
[[nodiscard]] std::optional<double> image_latency_of(const std::string& path, const JobControl& control);

/// One row of the table: a quantity as measured in the recording and in the simulation.
struct ProfileRow {
  std::string key{};
  std::string text{};
  std::optional<double> recording{};
  std::optional<double> simulation{};
};
[[nodiscard]] std::vector<ProfileRow> profile_table(const RecordingProfile& like,
                                                    const RecordingProfile& made);
/// Simulator options that reproduce the properties of the recorded robot: rates, noise, latency, gaps.
[[nodiscard]] SimulatedRobotOptions options_like(const RecordingProfile& profile,
                                                 SimulatedRobotOptions options);
[[nodiscard]] std::string to_text(const std::vector<ProfileRow>& rows);

/// Report of `waymark simulate`.
struct ProfileReport {
  std::string file{};  ///< the recording that was written
  std::vector<ProfileRow> rows{};
};
[[nodiscard]] ReportFields fields(const ProfileReport& report);

}  // namespace waymark
