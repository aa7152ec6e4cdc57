#pragma once

#include <memory>
#include <string>
#include <utility>

#include "waymark/cli/lesson.hpp"
#include "waymark/cli/operator_story.hpp"

namespace waymark::cli {

/// A lap of a story that is being recorded.
class StoryLap {
 public:
  static Result<std::unique_ptr<StoryLap>> start(const Stage& stage, const StoryJob& job,
                                                 const std::string& file, Console& console);
  Status on_sample(const Sample& sample) { return lesson_->on_sample(sample); }
  /// Closes the file, and says what was doubtful.
  Status end(Console& console);

 private:
  explicit StoryLap(SampleRecorder recorder) : recorder_(std::move(recorder)) {}
  SampleRecorder recorder_;
  std::unique_ptr<Lesson> lesson_{};
};

}  // namespace waymark::cli
