#include <fmt/ranges.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/map/convert_map.hpp"

namespace waymark::cli {
namespace {

struct ConvertMapArgs {
  explicit ConvertMapArgs(CLI::App& app) {
    to = add_option(app, "--to FORM", form,
                    fmt::format("Output format: {}; the default is fmap for an OUTPUT that ends in .fmap",
                                fmt::join(map_form_names(), ", ")),
                    kShown);
    add_fields(app, job);
    add_flag(app, "--json", json, "Print one JSON object instead of text");
  }

  ConvertMapJob job{};
  const CLI::Option* to = nullptr;
  std::string form = "waymark";
  bool json = false;
};

/// The format set by --to. Without --to, FMAP is used if the output name ends in .fmap.
std::string form_of(const ConvertMapArgs& args) {
  const bool fmap = args.job.output.ends_with(".fmap");
  return args.to->count() == 0 && fmap ? "fmap" : args.form;
}

ExitCode convert_one_map(const ConvertMapArgs& args, Console& console) {
  const Result<MapForm> form = map_form(form_of(args));
  if (!form) return fail_usage(form.error(), console);
  ConvertMapJob job = args.job;
  job.form = *form;
  const Result<ConvertMapReport> done = convert_map(job, control_from(console));
  if (!done) return fail_with(done.error(), console);
  console.print(args.json ? json_line(fields(*done)) : to_text(*done));
  for (const std::string& warning : done->warnings) console.note("warning: " + warning);
  return ExitCode::Ok;
}

}  // namespace

Verb map_convert_verb() {
  return {
      .name = "convert",
      .sentence = "Convert a tag map between Waymark's format and those of other programs",
      .help =
          R"(Reads Waymark's map.yaml, the Robotics Academy's apriltags_poses.yaml, and TagSLAM's tagslam.yaml or poses.yaml. It also
reads WPILib field layouts (JSON, CSV), Limelight field maps (FMAP), and tf transforms, either as YAML or in a recording
(/tf, /tf_static). The input format is detected from the content. Information that the output format cannot represent is
omitted, with a warning. With --to tf, an OUTPUT that ends in .mcap is written as a recording with /tf_static.
Formats: docs/formats/map.md, "Maps of others".

Exit code: 0 written, 1 unreadable or not written, 2 wrong usage.

Examples:
  waymark map convert map poses.yaml --to tagslam
  waymark map convert map tags_tf.yaml --to tf
  waymark map convert map tags_tf.mcap --to tf
  waymark map convert apriltags_poses.yaml map.yaml
  waymark map convert 2024-crescendo.json map.yaml --tag-size-m 0.1651
  waymark map convert map layout.json --to wpilib
  waymark map convert map field.fmap
)",
      .prepare = prepared(convert_one_map),
      .report = report_of<ConvertMapReport>};
}

}  // namespace waymark::cli
