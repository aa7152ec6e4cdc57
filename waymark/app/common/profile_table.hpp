#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/simulation/robot/simulated_robot_options.hpp"

/// What `waymark simulate` measures of the recording of `like` and prints.
namespace waymark {

/// Measures a recording of any kind. Fails when its speeds are not known.
[[nodiscard]] Result<RecordingProfile> profile_of(const std::string& path, const JobControl& control);

/// Time from the stamps of a camera's samples to their recording [s], the median of the topic with most
/// samples; nothing where the log time is the stamp, or no camera spoke.
[[nodiscard]] std::optional<double> image_latency_of(const std::string& path, const JobControl& control);

/// One line of the table: what the recording has, and what the simulation has.
struct ProfileRow {
  std::string key{};
  std::string words{};
  std::optional<double> recording{};
  std::optional<double> simulation{};
};
[[nodiscard]] std::vector<ProfileRow> profile_table(const RecordingProfile& like,
                                                    const RecordingProfile& made);
/// Properties of the robot in the recording, as simulator options: rates, noises, latency, gaps.
[[nodiscard]] SimulatedRobotOptions options_like(const RecordingProfile& profile,
                                                 SimulatedRobotOptions options);
[[nodiscard]] std::string to_text(const std::vector<ProfileRow>& rows);

/// What `waymark simulate` reports.
struct ProfileReport {
  std::string file{};  ///< recording that was written
  std::vector<ProfileRow> rows{};
};
[[nodiscard]] ReportFields fields(const ProfileReport& report);

}  // namespace waymark
