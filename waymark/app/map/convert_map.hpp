#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/app/common/job_control.hpp"
#include "waymark/base/job_field.hpp"
#include "waymark/config/map_exchange.hpp"

/// `waymark map convert`: a map of tags in another program's form, or another's in ours.
namespace waymark {

struct ConvertMapJob {
  std::string input{};   ///< a map of any form, or the folder of a map.yaml
  std::string output{};  ///< file to write
  MapForm form = MapForm::Waymark;
  std::optional<double> tag_size_m{};  ///< of tags whose file does not say it
  std::vector<std::string> remove{};   ///< tags to leave out
  bool force = false;                  ///< replaces a file that is there

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.input,
          JobField("input MAP", "A map of any form, or the folder of a map.yaml").input().required());
    visit(self.output, JobField("output OUTPUT", "The file to write").input().required());
    visit(self.tag_size_m,
          JobField("tag_size_m NUMBER", "Side of the black square of tags whose file does not say it"));
    visit(self.remove, JobField("remove TAGS", "Tags to exclude, such as 3,7 or tag36h11:3").by_commas());
    visit(self.force, JobField("force", "Replace a file that is there"));
  }
};

/// What was read, less what was left out, with warnings of what the form cannot say.
[[nodiscard]] Result<ReadMap> convert_map(const ConvertMapJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertMapJob& job, const ReadMap& read);
[[nodiscard]] nlohmann::ordered_json to_json(const ConvertMapJob& job, const ReadMap& read);

}  // namespace waymark
