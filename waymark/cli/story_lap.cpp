#include "waymark/cli/story_lap.hpp"

#include <utility>

#include <fmt/format.h>

namespace waymark::cli {

Result<std::unique_ptr<StoryLap>> StoryLap::start(const Stage& stage, const StoryJob& job,
                                                  const std::string& file, Console& console) {
  Result<SampleRecorder> recorder =
      start_recording(file,
                      {.verb = "run",
                       .driver = job.driver,
                       .options = fmt::format("driver:\n  speed_m_s: {}\n", job.speed_m_s)},
                      stage);
  if (!recorder) return tl::unexpected(recorder.error());
  std::unique_ptr<StoryLap> lap(new StoryLap(std::move(*recorder)));
  lap->lesson_ = std::make_unique<Lesson>(teach_setup(stage.simulated), monitor_options(stage.simulated),
                                          job.images, lap->recorder_, console);
  return lap;
}

Status StoryLap::end(Console& console) {
  const Status closed = recorder_.close();
  for (const std::string& warning : lesson_->summary().warnings) console.say("warning: " + warning);
  return closed;
}

}  // namespace waymark::cli
