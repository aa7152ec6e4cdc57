#pragma once

#include <string>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/simulation/world/tag_layout.hpp"
#include "waymark/simulation/world/world_check.hpp"

/// `waymark world new`: makes a world with tags placed along a drawn or driven line.
namespace waymark {

struct LayWorldJob {
  std::string path{};  ///< the line: a .csv or .txt file with columns x and y [m], or a recording of a drive
  std::string output{};    ///< path of the world to write
  RobotDescription robot;  ///< its body and camera determine the layout
  TagLayoutOptions layout{};
};

/// User options for creating a world.
struct LayWorldRequest {
  std::string path{};
  std::string output{};
  std::string robot_file = "limo";

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.path,
          JobField("path FILE",
                   "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive")
              .required());
    visit(self.output, JobField("output FILE", "World to write (.yaml)").required());
    visit(self.robot_file,
          JobField("robot_file NAME", "Body and camera of the robot: a name, or a .yaml file"));
  }
};
/// Reads the robot file. Fails if it is unreadable, or for the same reasons as check_new_world().
[[nodiscard]] Result<LayWorldJob> described_lay_world(const LayWorldRequest& request,
                                                      const TagLayoutOptions& layout);

/// Fails if the world file already exists or cannot be written.
[[nodiscard]] Status check_new_world(const std::string& output);

struct LayWorldReport {
  std::string file{};  ///< path of the world file
  World world{};
  WorldCheck check{};
};

/// Reads only the line from a file like LayWorldJob::path, as points at least 0.15 m apart. The line may be
/// open or closed. A part that repeats a loop is cut off, with a note. Fails if there are fewer than three
/// points, or if a point is more than 500 m from the start.
[[nodiscard]] Result<World> read_line(const std::string& path, const JobControl& control);

/// Places tags along the line and writes the world. An existing file is renamed. A line that returns to its
/// start is treated as a lap, unless it then continues elsewhere (points_of_first_loop()).
[[nodiscard]] Result<LayWorldReport> lay_world(const LayWorldJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const LayWorldReport& report);
[[nodiscard]] ReportFields fields(const LayWorldReport& report);

}  // namespace waymark
