#pragma once

#include <deque>
#include <memory>
#include <optional>

#include "waymark/robots/simulated/picture_line.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

/// What a robot says on its way to a listener: in order, with a frame of tags where it took a picture.
class SampleLine {
 public:
  /// Makes as many scene_cameras as the setup wants threads; none without pictures.
  [[nodiscard]] static Result<std::unique_ptr<SampleLine>> make(const SimulatedSetup& setup,
                                                                const LapListener& listener);

  /// A sample, and where it is a picture, how to take it. Passes on what is ready; waits when too many
  /// pictures are on their way.
  [[nodiscard]] Status add(Sample sample, const CameraShot& shot);
  /// A sample that the robot did not say (a command).
  [[nodiscard]] Status add(Sample sample) { return add(std::move(sample), {}); }
  /// Passes on everything that is still on its way.
  [[nodiscard]] Status finish();

 private:
  SampleLine(std::unique_ptr<PictureLine> pictures, std::size_t threads, const LapListener& listener)
      : pictures_(std::move(pictures)), most_pending_(3 * threads), listener_(listener) {}
  [[nodiscard]] Status pass_first();

  std::unique_ptr<PictureLine> pictures_;
  std::size_t most_pending_;
  const LapListener& listener_;
  std::deque<Sample> waiting_;
};

}  // namespace waymark
