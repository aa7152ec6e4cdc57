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
  std::filesystem::path file{};                  ///< path of the SDF world or model (.sdf, .world)
  std::filesystem::path output{};                ///< path of the world.yaml to write
  std::vector<std::filesystem::path> folders{};  ///< searched for models and textures before all others
  std::vector<std::string> families = {"tag36h11"};
  /// Line to drive, from a table with columns x and y or from a recording. If empty, one metre ahead of
  /// `start`.
  std::string path{};
  /// Model at which this metre starts. If empty, the first model that is not static or, if there is none, the
  /// origin.
  std::string start{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.file, JobField("file FILE", "World or model in SDF (.sdf, .world)").input().required());
    visit(self.output, JobField("output FILE", "World to write (.yaml)").required());
    visit(self.folders,
          JobField("models FOLDER",
                   "Folder that is searched first for model:// and images (repeatable). It is followed by "
                   "the folder of the file, its models/, IGN_GAZEBO_RESOURCE_PATH and SDF_PATH"));
    visit(self.families, JobField("family NAME", "Tag families to detect in the textures").comma_separated());
    visit(self.path,
          JobField("path FILE",
                   "Line to drive: a .csv file with columns x and y in metres, or a recording of a drive"));
    visit(self.start, JobField("start NAME",
                               "Model at which the line to drive starts; the line is one metre long. "
                               "Default: the first model that is not static, else the origin")
                          .excludes("path"));
  }
};

struct ImportWorldReport {
  std::string file{};  ///< path of the world file
  World world{};
  /// Descriptions of lights; ignored, because the renderer has its own lighting.
  std::vector<std::string> lights{};
  std::vector<std::string> warnings{};  ///< warnings about simplifications and omissions
};

/// Places the tags from the most common family where their textures are. Upright boxes become furniture, and
/// other shapes are replaced by their bounding boxes. A board with the same tag on its back becomes a
/// two-sided board. Fails if the world contains no readable tag.
[[nodiscard]] Result<World> world_of(const SdfScene& scene, const std::vector<std::string>& families,
                                     std::vector<std::string>& warnings);

/// Reads an SDF world and writes it as a Waymark world. Fails if the SDF module is not installed, if no tag
/// can be read, or if the result is invalid.
[[nodiscard]] Result<ImportWorldReport> import_world(const ImportWorldJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ImportWorldReport& report);
[[nodiscard]] ReportFields fields(const ImportWorldReport& report);

}  // namespace waymark
