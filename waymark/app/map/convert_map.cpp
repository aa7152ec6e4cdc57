#include "waymark/app/map/convert_map.hpp"

#include <filesystem>
#include <set>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/mapping/lap/tag_ties.hpp"
#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/cdr.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {

// Reading tag transforms from a recording.
namespace {

/// The last transform of each tag.
struct TagTransforms {
  std::map<TagId, ros2::TransformStamped> in_map{};
  std::set<std::string> elsewhere{};  ///< tags with a different parent frame, which is appended to the name

  void add(const ros2::TransformStamped& transform) {
    const Result<TagId> tag = parse_tag_id(transform.child_frame_id);
    if (!tag) return;
    const std::string& parent = transform.header.frame_id;
    if (parent == ros2::kMapFrame || parent == "/map")
      in_map[*tag] = transform;
    else
      elsewhere.insert(fmt::format("{} (from {})", transform.child_frame_id, parent));
  }
};

Result<TagTransforms> transforms_of(const std::filesystem::path& path, const JobControl& control) {
  const auto log = open_log(path, control.log_options());
  if (!log) return tl::unexpected(log.error());
  LogSelection selection;
  for (const LogChannel& channel : (*log)->channels()) {
    if (channel.type == ros2::TFMessage::kType) selection.topics.insert(channel.topic);
  }
  TagTransforms found;
  if (selection.topics.empty()) return found;
  CdrChannels channels([](LogProblem::Kind, const std::string&, const Error&) {});
  const Status status =
      (*log)->visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
        const auto cdr = channels.convert(channel, message);
        if (!cdr || !cdr->channel->known_layout) return {};
        const auto transforms = cdr::decode<ros2::TFMessage>(cdr->data);
        if (!transforms) return tl::unexpected(transforms.error());
        for (const ros2::TransformStamped& transform : transforms->transforms) found.add(transform);
        return {};
      });
  if (!status) return tl::unexpected(status.error());
  return found;
}

/// The YAML format printed by `tf2_echo`, which parse_any_map() can read.
std::string yaml_of(const TagTransforms& found) {
  std::string text = "transforms:\n";
  for (const auto& [tag, transform] : found.in_map) {
    const auto& p = transform.translation;
    const auto& q = transform.rotation;
    text += fmt::format(
        "- child_frame_id: \"{}\"\n"
        "  transform:\n"
        "    translation: {{x: {}, y: {}, z: {}}}\n"
        "    rotation: {{x: {}, y: {}, z: {}, w: {}}}\n",
        to_string(tag), p.x, p.y, p.z, q.x, q.y, q.z, q.w);
  }
  return text;
}

}  // namespace

Result<ReadMap> read_map_transforms(const std::filesystem::path& path, std::optional<double> tag_size_m,
                                    const JobControl& control) {
  const Result<TagTransforms> found = transforms_of(path, control);
  if (!found) return tl::unexpected(found.error());
  if (found->in_map.empty())
    return fail(ErrorCode::NotFound, "no transform from frame map to a tag", {.source = path.string()},
                "Tag frames have names such as tag36h11:7; `waymark map` makes a map from observations.");
  Result<ReadMap> map = parse_any_map(yaml_of(*found), path.string(), tag_size_m);
  if (map && !found->elsewhere.empty())
    map->warnings.push_back(fmt::format("ignored transforms whose parent frame is not map: {}",
                                        fmt::join(found->elsewhere, ", ")));
  return map;
}

Status write_map_transforms(const std::filesystem::path& path, const MapFile& map) {
  Result<std::unique_ptr<ByteSink>> file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  Result<SampleRecorder> recorder =
      SampleRecorder::open(std::move(*file), {.library = "waymark " WAYMARK_VERSION});
  if (!recorder) return tl::unexpected(recorder.error());
  ros2::TFMessage message;
  for (const auto& [tag, mapped] : map.tags.tags)
    message.transforms.push_back(
        ros2::to_ros_transform(SensorTime{}, ros2::kMapFrame, to_string(tag), mapped.map_T_tag));
  Status status = recorder->add_message(topics::kTfStatic, SensorTime{}, message);
  return status ? recorder->close() : status;
}

// Conversion between formats.
namespace {

std::string name_of(MapForm form) { return map_form_names()[static_cast<std::size_t>(form)]; }

Status remove_tags(const ConvertMapJob& job, MapFile& map) {
  for (const std::string& name : job.remove) {
    const Result<TagId> tag = tag_named(name, "remove");
    if (!tag) return tl::unexpected(tag.error());
    if (map.tags.find(*tag) == nullptr)
      return fail(ErrorCode::InvalidArgument, to_string(*tag) + " is not in the map", {.key = "remove"});
    remove_tag(map.tags, *tag);
    map.observations.erase(*tag);
  }
  if (map.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument, "no tag would remain in the map", {.key = "remove"});
  if (map.tags.find(map.anchor) == nullptr) map.anchor = map.tags.tags.begin()->first;
  return {};
}

bool is_named_recording(const std::filesystem::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".bag";
}

}  // namespace

Result<ConvertMapReport> convert_map(const ConvertMapJob& job, const JobControl& control) {
  Result<ReadMap> read = is_recording(kind_of(job.input))
                             ? read_map_transforms(job.input, job.tag_size_m, control)
                             : read_any_map(job.input, job.tag_size_m);
  read = or_wrong_kind(std::move(read), job.input, FileUse::AnyMap);
  if (!read) return tl::unexpected(read.error());
  if (Status status = remove_tags(job, read->map); !status) return tl::unexpected(status.error());
  if (read->form != MapForm::Waymark)
    read->map.provenance = {{"converted_from", std::filesystem::path(job.input).filename().string()}};
  const Result<std::string> text = to_text(read->map, job.form, read->warnings, read->field);
  if (!text) return tl::unexpected(text.error());
  std::error_code ignored;
  if (!job.force && std::filesystem::exists(job.output, ignored))
    return fail(ErrorCode::Unwritable, "the file already exists", {.source = job.output},
                "Set `force` to replace the file.");
  const bool as_recording =
      job.form == MapForm::Transforms && std::filesystem::path(job.output).extension() == ".mcap";
  if (!as_recording && is_named_recording(job.output))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("a map in format {} is written as YAML", name_of(job.form)),
                {.source = job.output, .key = "`output`"},
                "Use a name that ends in .yaml, or `to=tf` for transforms.");
  if (Status wanted = control.go_on(); !wanted) return tl::unexpected(wanted.error());
  const Status status = as_recording                   ? write_map_transforms(job.output, read->map)
                        : job.form == MapForm::Waymark ? write_map(job.output, read->map)
                                                       : write_text_file(job.output, *text);
  if (!status) return tl::unexpected(status.error());
  return ConvertMapReport{std::move(*read), job.output, job.form};
}

std::string to_text(const ConvertMapReport& report) {
  return fmt::format("{}: {} tags, from {} to {}\n", report.output, report.map.tags.tags.size(),
                     name_of(report.form), name_of(report.to));
}

ReportFields fields(const ConvertMapReport& report) {
  return {{"output", "File that was written", report.output},
          {"from", "Format of the input", name_of(report.form)},
          {"to", "Format of the output", name_of(report.to)},
          {"tags", "Tags in the output", report.map.tags.tags.size()},
          {"warnings", "Warnings about data that the output format cannot represent, one sentence each",
           report.warnings}};
}

}  // namespace waymark
