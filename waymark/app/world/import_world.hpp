#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/sdf/read_sdf.hpp"
#include "waymark/simulation/world/world.hpp"

/// `waymark world import`: converts a Gazebo world to a Waymark world.
namespace waymark {

struct ImportWorldJob {
  std::filesystem::path file{};                  ///< .sdf, .world
  std::filesystem::path output{};                ///< world.yaml to write
  std::vector<std::filesystem::path> folders{};  ///< searched first for models and textures
  std::vector<std::string> families = {"tag36h11"};
  std::string path{};   ///< table with columns x and y, or a recording: the line to drive; empty: a metre
                        ///< ahead of `start`
  std::string start{};  ///< model at which a line of that kind begins; empty: the first that can move, else
                        ///< the origin

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.file, JobField("file FILE", "World or model in SDF (.sdf, .world)").input().required());
    visit(self.output, JobField("output FILE", "World to write (.yaml)").required());
    visit(self.folders, JobField("models FOLDER",
                                 "Folder that is searched first for model:// and images (repeatable). "
                                 "Then: beside the file, models/ there, IGN_GAZEBO_RESOURCE_PATH, SDF_PATH"));
    visit(self.families, JobField("family NAME", "Tag families to detect in the textures").comma_separated());
    visit(self.path,
          JobField("path FILE",
                   "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive"));
    visit(self.start, JobField("start NAME",
                               "Model from which a line of one metre leads ahead, where there is no --path. "
                               "Unless given: the first model that is not static, else the origin")
                          .excludes("path"));
  }
};

struct ImportWorldReport {
  std::string file{};  ///< that was written
  World world{};
  std::vector<std::string> lights{};    ///< as text; Waymark's renderer has its own light
  std::vector<std::string> warnings{};  ///< simplifications and omissions
};

/// Tags (of one family: that of most of them) where their textures are, boxes and cylinders that stand
/// upright as furniture, other shapes as their bounding boxes. A board with tags on its back as well counts
/// as a two-sided board. Fails on a world without a readable tag.
[[nodiscard]] Result<World> world_of(const SdfScene& scene, const std::vector<std::string>& families,
                                     std::vector<std::string>& warnings);

/// Reads a world in SDF and writes it as world.yaml. Fails if the module for SDF is not installed, no tag
/// can be read, or the result is invalid.
[[nodiscard]] Result<ImportWorldReport> import_world(const ImportWorldJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ImportWorldReport& report);
[[nodiscard]] ReportFields fields(const ImportWorldReport& report);

}  // namespace waymark
