#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/app/live/robot_setup.hpp"

namespace waymark {

/// What a user says of a robot and its world.
struct RobotWords {
  std::string robot = "sim";
  std::string world{};
  std::string robot_file{};
  std::vector<std::string> camera_sources{};  ///< of this computer, on a robot that is a process
  PictureSettings pictures{};
  std::uint64_t seed = 1;

  /// The flags of a simulated robot again, for a command line.
  [[nodiscard]] std::vector<std::string> as_words() const;
};
/// With `processes` the robot may be one; `robot_file`: where it is described when no flag says so. Fails
/// also on flags that have no effect on it.
[[nodiscard]] Result<RobotSetup> described_setup(const RobotWords& words, bool processes,
                                                 const std::string& robot_file, const GivenFlags& given);

}  // namespace waymark
