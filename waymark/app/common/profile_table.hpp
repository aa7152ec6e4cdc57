#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"

/// The profile of a recording that `waymark simulate` imitates (`like`), and its comparison with the
/// simulation.
namespace waymark {

/// Measures a recording of any kind. Fails if it has no odometry, because its speeds are then unknown.
[[nodiscard]] Result<RecordingProfile> profile_of(const std::string& path, const JobControl& control);

/// Median time from the stamp of a camera sample to its recording [s], for the topic with the most samples.
/// Nothing if the log time is the stamp, or for fewer than 20 samples.
[[nodiscard]] std::optional<double> image_latency_of(const std::string& path, const JobControl& control);

/// One row of the table: a quantity of the recording and of the simulation.
struct ProfileRow {
  std::string key{};
  std::string text{};
  std::optional<double> recording{};
  std::optional<double> simulation{};
};
[[nodiscard]] std::vector<ProfileRow> profile_table(const RecordingProfile& like,
                                                    const RecordingProfile& made);
/// Properties of the robot in the recording, as simulator options: rates, noises, latency, gaps.
[[nodiscard]] SimulatedRobotOptions options_like(const RecordingProfile& profile,
                                                 SimulatedRobotOptions options);
[[nodiscard]] std::string to_text(const std::vector<ProfileRow>& rows);

/// Report of `waymark simulate`.
struct ProfileReport {
  std::string file{};  ///< recording that was written
  std::vector<ProfileRow> rows{};
};
[[nodiscard]] ReportFields fields(const ProfileReport& report);

}  // namespace waymark
