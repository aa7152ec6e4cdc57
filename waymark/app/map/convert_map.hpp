#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/config/exchange/map_exchange.hpp"

/// `waymark map convert`: a map of tags in another program's form, or another's in ours.
namespace waymark {

/// The map that a recording's transforms (any topic of tf2_msgs/TFMessage, such as /tf_static) tell: of each
/// tag the last one from the frame `map`. Tags seen from other frames only (a camera's) are named in the
/// warnings.
[[nodiscard]] Result<ReadMap> read_map_transforms(const std::filesystem::path& path,
                                                  std::optional<double> tag_size_m,
                                                  const JobControl& control = {});

/// An MCAP file with the map's tags on /tf_static.
[[nodiscard]] Status write_map_transforms(const std::filesystem::path& path, const MapFile& map);

struct ConvertMapJob {
  std::string input{};   ///< a map of any form, or the folder of a map.yaml
  std::string output{};  ///< file to write
  MapForm form = MapForm::Waymark;
  std::optional<double> tag_size_m{};  ///< of tags whose file does not say it
  std::vector<std::string> remove{};   ///< tags to leave out
  bool force = false;                  ///< replaces a file that is there

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.input, JobField("input MAP", "A map in any supported format, or the folder of a map.yaml")
                          .input()
                          .required());
    visit(self.output, JobField("output OUTPUT", "The file to write").input().required());
    visit(self.tag_size_m, JobField("tag_size_m NUMBER",
                                    "Side of the black square of tags whose size the file does not contain"));
    visit(self.remove,
          JobField("remove TAGS", "Tags to exclude, such as 3,7 or tag36h11:3").comma_separated());
    visit(self.force, JobField("force", "Replace an existing file"));
  }
};

/// What was read, without the removed tags, with warnings of what the form cannot represent.
struct ConvertMapReport : ReadMap {
  std::string output{};  ///< file
  MapForm to = MapForm::Waymark;
};

[[nodiscard]] Result<ConvertMapReport> convert_map(const ConvertMapJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertMapReport& report);
[[nodiscard]] ReportFields fields(const ConvertMapReport& report);

}  // namespace waymark
