#pragma once

#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/recording/sample_recorder.hpp"
#include "waymark/robots/simulated/detecting_camera.hpp"
#include "waymark/runtime/lap_monitor.hpp"

namespace waymark {

/// Records a lap as `images` says (raw, jpeg; empty: without pictures), with words to the control. All of
/// them outlive the listener.
[[nodiscard]] TeachListener lap_listener(SampleRecorder& recorder, const std::string& images,
                                         const JobControl& control);
/// Records a rendered picture and what is true of it; its tags are a sample of the lap.
[[nodiscard]] Status record_rendered(const SeenPicture& seen, const std::string& images,
                                     SampleRecorder& recorder);

/// A lap of the setup, for a listener.
[[nodiscard]] LapMonitor lap_of(const SimulatedSetup& setup, TeachListener listener);

[[nodiscard]] TeachReport report_of(const LapMonitor& lap, const LapEnd& end, const Stopwatch& watch);

}  // namespace waymark
