#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/config/map_exchange.hpp"
#include "waymark/jobs/job_control.hpp"

/// `waymark map convert`: a map of tags in another program's form, or another's in ours.
namespace waymark {

struct ConvertMapJob {
  std::string input{};   ///< a map of any form, or the folder of a map.yaml
  std::string output{};  ///< file to write
  MapForm form = MapForm::Waymark;
  std::optional<double> tag_size_m{};  ///< of tags whose file does not say it
  std::vector<std::string> remove{};   ///< tags to leave out
  bool force = false;                  ///< replaces a file that is there
};

/// What was read, less what was left out, with warnings of what the form cannot say.
[[nodiscard]] Result<ReadMap> convert_map(const ConvertMapJob& job, const JobControl& control);
[[nodiscard]] std::string to_text(const ConvertMapJob& job, const ReadMap& read);
[[nodiscard]] nlohmann::ordered_json to_json(const ConvertMapJob& job, const ReadMap& read);

}  // namespace waymark
