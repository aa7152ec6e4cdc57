#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "waymark/config/robot_file.hpp"
#include "waymark/jobs/job_control.hpp"
#include "waymark/simulation/tag_layout.hpp"
#include "waymark/simulation/world_check.hpp"

/// `waymark world new`: a world with tags laid along a line that was drawn or driven.
namespace waymark {

struct LayWorldJob {
  std::string path{};      ///< the line: a .csv or .txt with columns x and y [m], or a recording of a drive
  std::string output{};    ///< world to write
  RobotDescription robot;  ///< that is to see the tags
  TagLayoutOptions layout{};
};

/// Fails where a file stands already under the name of the world, or none can be written.
[[nodiscard]] Status check_new_world(const std::string& output);

struct LayWorldReport {
  World world{};
  WorldCheck check{};
};

/// The line of such a file alone: its points some way apart, and whether it is a loop.
[[nodiscard]] Result<World> read_line(const std::string& path, const JobControl& control);

/// A line that comes back to its beginning is a lap, of which what overlaps is left out.
[[nodiscard]] Result<LayWorldReport> lay_world(const LayWorldJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const LayWorldReport& report, const std::string& file);
[[nodiscard]] nlohmann::ordered_json to_json(const LayWorldReport& report, const std::string& file);

}  // namespace waymark
