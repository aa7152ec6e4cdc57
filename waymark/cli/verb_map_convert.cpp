#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/page_files.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/map_exchange.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/jobs/lap_input.hpp"
#include "waymark/jobs/map_transforms.hpp"
#include "waymark/mapping/tag_ties.hpp"

namespace waymark::cli {
namespace {

struct ConvertMapArgs {
  std::string input;
  std::string output;
  std::string form = "waymark";
  std::optional<double> tag_size_m;
  std::vector<std::string> remove;
  bool force = false;
  bool json = false;
};

Status remove_tags(const ConvertMapArgs& args, MapFile& map) {
  for (const std::string& name : args.remove) {
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

Result<ReadMap> converted(const ConvertMapArgs& args, MapForm form) {
  Result<ReadMap> read = is_ros_recording(args.input)
                             ? read_map_transforms(args.input, args.tag_size_m, silent_control())
                             : read_any_map(args.input, args.tag_size_m);
  if (!read) return read;
  if (Status status = remove_tags(args, read->map); !status) return tl::unexpected(status.error());
  if (read->form != MapForm::Waymark)
    read->map.provenance = {{"converted_from", std::filesystem::path(args.input).filename().string()}};
  const Result<std::string> text = to_text(read->map, form, read->warnings);
  if (!text) return tl::unexpected(text.error());
  std::error_code ignored;
  if (!args.force && std::filesystem::exists(args.output, ignored))
    return fail(ErrorCode::Unwritable, "there is a file already", {.source = args.output},
                "Give --force to replace it.");
  const bool as_recording =
      form == MapForm::Transforms && std::filesystem::path(args.output).extension() == ".mcap";
  if (!as_recording && is_named_recording(args.output))
    return fail(ErrorCode::InvalidArgument, fmt::format("a map of form {} is YAML", args.form),
                {.source = args.output}, "End the name in .yaml, or write transforms with --to tf.");
  const Status status = as_recording               ? write_map_transforms(args.output, read->map)
                        : form == MapForm::Waymark ? write_map(args.output, read->map)
                                                   : write_text_file(args.output, *text);
  if (!status) return tl::unexpected(status.error());
  return read;
}

ExitCode convert_map(const ConvertMapArgs& args, Console& console) {
  const Result<MapForm> form = map_form(args.form);
  if (!form) {
    console.say(form.error());
    return ExitCode::Usage;
  }
  const Result<ReadMap> done = converted(args, *form);
  if (!done) {
    console.say(done.error());
    return ExitCode::SomeFailed;
  }
  const std::string from = map_form_names()[static_cast<std::size_t>(done->form)];
  const std::size_t tags = done->map.tags.tags.size();
  console.print(args.json ? json_line({{"output", args.output},
                                       {"from", from},
                                       {"to", args.form},
                                       {"tags", tags},
                                       {"warnings", done->warnings}})
                          : fmt::format("{}: {} tags, from {} to {}\n", args.output, tags, from, args.form));
  for (const std::string& warning : done->warnings) console.say("warning: " + warning);
  return ExitCode::Ok;
}

Run prepare_convert_map(CLI::App& app) {
  const auto args = std::make_shared<ConvertMapArgs>();
  app.add_option("MAP", args->input, "A map of any form, or the folder of a map.yaml")
      ->required()
      ->type_name("");
  app.add_option("OUTPUT", args->output, "The file to write")->required()->type_name("");
  app.add_option("--to", args->form, fmt::format("What to write: {}", fmt::join(map_form_names(), ", ")))
      ->capture_default_str()
      ->type_name("FORM");
  app.add_option("--tag-size-m", args->tag_size_m,
                 "Side of the black square of tags whose file does not say it")
      ->type_name("NUMBER");
  app.add_option("--remove", args->remove, "Tags to leave out, such as 3,7 or tag36h11:3")
      ->delimiter(',')
      ->type_name("TAGS");
  app.add_flag("--force", args->force, "Replace a file that is there");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return convert_map(*args, console); };
}

}  // namespace

Verb map_convert_verb() {
  return {
      .name = "convert",
      .sentence = "Turn a map of tags into another program's form, or another's into ours",
      .help =
          R"(Reads our map.yaml, apriltags_poses.yaml of the Robotics Academy, TagSLAM's tagslam.yaml or poses.yaml, field layouts
of WPILib (JSON, CSV), and transforms of tf as YAML or in a recording (MCAP, ROS 1 bag: /tf, /tf_static); what a file is, its content tells. What
a form cannot say is left out and named. With --to tf an OUTPUT that ends in .mcap becomes a recording with /tf_static.
Formats: docs/formats/map.md, "Maps of others".

Exit code: 0 written, 1 unreadable or not written, 2 wrong usage.

Examples:
  waymark map convert map poses.yaml --to tagslam
  waymark map convert map tags_tf.yaml --to tf
  waymark map convert map tags_tf.mcap --to tf
  waymark map convert apriltags_poses.yaml map.yaml
  waymark map convert 2024-crescendo.json map.yaml --tag-size-m 0.1651
  waymark map convert map layout.json --to wpilib
)",
      .prepare = prepare_convert_map,
      .verbs = {}};
}

}  // namespace waymark::cli
