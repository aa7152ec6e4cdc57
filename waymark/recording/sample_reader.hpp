#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "waymark/camera/camera_model.hpp"
#include "waymark/recording/mcap_reader.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// What a recording says about the robot before any sample.
struct RecordingSetup {
  std::optional<CameraModel> camera{};
  std::optional<SE3> base_T_cam{};
  std::map<std::string, std::map<std::string, std::string>> metadata{};  ///< by name
  std::vector<Error> problems{};  ///< damage in the file; what could be read is read
};

/// The camera, its place on the robot, and the metadata.
[[nodiscard]] Result<RecordingSetup> read_setup(const ByteSource& source);

/// Calls visit for every sample of the topics we know, in order of log time. Fails on a message that does not
/// decode.
[[nodiscard]] Status visit_samples(const ByteSource& source,
                                   const std::function<Status(const Sample&)>& visit);

}  // namespace waymark
