#pragma once

#include "waymark/base/error.hpp"
#include "waymark/jobs/localize_log.hpp"

namespace waymark {

/// What is localised: the recordings of a job, a video, a camera that is there, or a robot that is there.
enum class LocalizeInput { Recording, Video, Camera, Robot };

/// By the names of the job. `calibrated`: a camera's calibration is given, by which the recording of a camera
/// counts as a video. Fails on inputs that do not go together, and where there is none.
[[nodiscard]] Result<LocalizeInput> localize_kind(const LocalizeJob& job, bool calibrated);

}  // namespace waymark
