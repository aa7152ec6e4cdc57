#include "waymark/app/map/convert_map.hpp"

#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/map/map_transforms.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"

namespace waymark {
namespace {

std::string name_of(MapForm form) { return map_form_names()[static_cast<std::size_t>(form)]; }

Status remove_tags(const ConvertMapJob& job, MapFile& map) {
  for (const std::string& name : job.remove) {
    const Result<TagId> tag = tag_named(name);
    if (!tag) return tl::unexpected(tag.error());
    if (map.tags.find(*tag) == nullptr)
      return fail(ErrorCode::InvalidArgument, to_string(*tag) + " is not in the map", {.key = "--remove"});
    remove_tag(map.tags, *tag);
    map.observations.erase(*tag);
  }
  if (map.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument, "no tag would be left", {.key = "--remove"});
  if (map.tags.find(map.anchor) == nullptr) map.anchor = map.tags.tags.begin()->first;
  return {};
}

bool is_named_recording(const std::filesystem::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".bag";
}

}  // namespace

Result<ReadMap> convert_map(const ConvertMapJob& job, const JobControl& control) {
  Result<ReadMap> read = is_ros_recording(job.input) ? read_map_transforms(job.input, job.tag_size_m, control)
                                                     : read_any_map(job.input, job.tag_size_m);
  if (!read) return read;
  if (Status status = remove_tags(job, read->map); !status) return tl::unexpected(status.error());
  if (read->form != MapForm::Waymark)
    read->map.provenance = {{"converted_from", std::filesystem::path(job.input).filename().string()}};
  const Result<std::string> text = to_text(read->map, job.form, read->warnings, read->field);
  if (!text) return tl::unexpected(text.error());
  std::error_code ignored;
  if (!job.force && std::filesystem::exists(job.output, ignored))
    return fail(ErrorCode::Unwritable, "there is a file already", {.source = job.output},
                "Give --force to replace it.");
  const bool as_recording =
      job.form == MapForm::Transforms && std::filesystem::path(job.output).extension() == ".mcap";
  if (!as_recording && is_named_recording(job.output))
    return fail(ErrorCode::InvalidArgument, fmt::format("a map of form {} is YAML", name_of(job.form)),
                {.source = job.output}, "End the name in .yaml, or write transforms with --to tf.");
  if (Status wanted = control.go_on(); !wanted) return tl::unexpected(wanted.error());
  const Status status = as_recording                   ? write_map_transforms(job.output, read->map)
                        : job.form == MapForm::Waymark ? write_map(job.output, read->map)
                                                       : write_text_file(job.output, *text);
  if (!status) return tl::unexpected(status.error());
  return read;
}

std::string to_text(const ConvertMapJob& job, const ReadMap& read) {
  return fmt::format("{}: {} tags, from {} to {}\n", job.output, read.map.tags.tags.size(),
                     name_of(read.form), name_of(job.form));
}

nlohmann::ordered_json to_json(const ConvertMapJob& job, const ReadMap& read) {
  return {{"output", job.output},
          {"from", name_of(read.form)},
          {"to", name_of(job.form)},
          {"tags", read.map.tags.tags.size()},
          {"warnings", read.warnings}};
}

}  // namespace waymark
