#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Holds back what a camera saw before what it has shown already: out of order, it would be recorded as a
/// trajectory that goes back in time. A stamp that goes back by more than a second is a clock that jumped, of
/// which others speak: it passes.
class FrameOrder {
 public:
  /// False where the sample is to be left out. Samples that are of no camera pass.
  bool pass(const Sample& sample);
  /// How many were left out, in words; each time that their number has doubled, since the last call.
  [[nodiscard]] std::optional<std::string> take_words() { return std::exchange(words_, std::nullopt); }
  [[nodiscard]] int left_out() const { return left_out_; }

 private:
  std::map<std::pair<std::size_t, std::string>, SensorTime> newest_{};  ///< by type and camera
  int left_out_ = 0;
  std::optional<std::string> words_{};
};

}  // namespace waymark
