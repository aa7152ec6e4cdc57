#pragma once

#include <string>

#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/live/robot_setup.hpp"

namespace waymark {

struct SimulateLikeJob {
  std::string like;    ///< name of the recording that is imitated
  std::string output;  ///< recording to write
};

/// Lets the simulated robot of the setup drive along its world's line as fast as a recording did, for as
/// long, and records it. Gives the profile of what was recorded.
[[nodiscard]] Result<RecordingProfile> simulate_like(const RobotSetup& setup, const RecordingProfile& like,
                                                     const SimulateLikeJob& job, const JobControl& control);

}  // namespace waymark
