#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/exchange/map_exchange.hpp"

/// `waymark map convert`: converts a tag map between Waymark's format and those of other programs.
namespace waymark {

/// Reads a map from the transforms in a recording (any tf2_msgs/TFMessage topic, such as /tf_static). For
/// each tag, the last transform from the frame `map` is used. Transforms from other frames, such as a camera
/// frame, are ignored with a warning.
[[nodiscard]] Result<ReadMap> read_map_transforms(const std::filesystem::path& path,
                                                  std::optional<double> tag_size_m,
                                                  const JobControl& control = {});

/// Writes the map's tags to /tf_static of a new MCAP file. Fails if the file exists.
[[nodiscard]] Status write_map_transforms(const std::filesystem::path& path, const MapFile& map);

struct ConvertMapJob {
  std::string input{};   ///< a map file in any format, or the folder that contains a map.yaml
  std::string output{};  ///< the file to write
  MapForm form = MapForm::Waymark;
  std::optional<double> tag_size_m{};  ///< for tags whose size is not in the file
  std::vector<std::string> remove{};   ///< tags to omit
  bool force = false;                  ///< whether an existing file may be replaced

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.input, JobField("input MAP", "A map in any supported format, or the folder of a map.yaml")
                          .input()
                          .required());
    visit(self.output, JobField("output OUTPUT", "The file to write").input().required());
    visit(self.tag_size_m,
          JobField("tag_size_m NUMBER", "Side of the black square, for tags without a size in the file"));
    visit(self.remove,
          JobField("remove TAGS", "Tags to exclude, such as 3,7 or tag36h11:3").comma_separated());
    visit(self.force, JobField("force", "Replace an existing file"));
  }
};

/// The map without the removed tags, and warnings about data that the output format cannot represent.
struct ConvertMapReport : ReadMap {
  std::string output{};  ///< path of the written file
  MapForm to = MapForm::Waymark;
};

[[nodiscard]] Result<ConvertMapReport> convert_map(const ConvertMapJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertMapReport& report);
[[nodiscard]] ReportFields fields(const ConvertMapReport& report);

}  // namespace waymark
