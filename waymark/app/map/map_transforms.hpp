#pragma once

#include <filesystem>
#include <optional>

#include "waymark/app/common/job_control.hpp"
#include "waymark/config/map_exchange.hpp"

namespace waymark {

/// Whether a file is a recording (MCAP, ROS 1 bag), by its first bytes.
[[nodiscard]] bool is_ros_recording(const std::filesystem::path& path);

/// The map that a recording's transforms (any topic of tf2_msgs/TFMessage, such as /tf_static) tell: of each
/// tag the last one from the frame `map`. Tags seen from other frames only (a camera's) are named in the
/// warnings.
[[nodiscard]] Result<ReadMap> read_map_transforms(const std::filesystem::path& path,
                                                  std::optional<double> tag_size_m,
                                                  const JobControl& control = {});

/// An MCAP file with the map's tags on /tf_static.
[[nodiscard]] Status write_map_transforms(const std::filesystem::path& path, const MapFile& map);

}  // namespace waymark
