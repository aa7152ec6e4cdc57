#pragma once

#include <string>
#include <vector>

#include "waymark/recording/sample_reader.hpp"

namespace waymark {
struct RobotDescription;
}

namespace waymark {

/// Where a robot's file and a recording say different things of the camera and where it sits, in words.
[[nodiscard]] std::vector<std::string> disagreements(const RobotDescription& robot,
                                                     const RecordingSetup& setup);

/// The camera and its mounting as the robot's file (or its name) says; where the recording says otherwise, a
/// sentence is added to `warnings`. Nothing happens without a file.
[[nodiscard]] Status take_robot(const std::string& robot, RecordingSetup& setup,
                                std::vector<std::string>& warnings);

}  // namespace waymark
