#pragma once

#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/live/robot_setup.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/recording_profile.hpp"

namespace waymark {

struct SimulateLikeJob {
  std::string like;    ///< recording to imitate
  std::string output;  ///< recording to write

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.like, JobField("like RECORDING",
                              "Recording whose rates, gaps, noise and speeds are imitated, in any format "
                              "supported by `waymark info`")
                         .required());
    visit(self.output,
          JobField("output FILE", "Recording to write (.mcap); existing files are never overwritten")
              .required());
  }
};

/// Drives the simulated robot along the line in its world and records the drive. The speeds and the duration
/// are taken from the profile `like`. Returns the profile of the new recording.
[[nodiscard]] Result<RecordingProfile> simulate_like(const RobotSetup& setup, const RecordingProfile& like,
                                                     const SimulateLikeJob& job, const JobControl& control);

}  // namespace waymark
