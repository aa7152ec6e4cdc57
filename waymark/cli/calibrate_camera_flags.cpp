#include "waymark/cli/calibrate_camera_flags.hpp"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/cli/job_flags.hpp"

namespace waymark::cli {
namespace {

/// Flags that have no effect on this target.
Status check_target_flags(const CalibrateCameraArgs& args) {
  const std::string& kind = args.job.target.kind;
  struct Flag {
    const char* name;
    std::vector<std::string> of;
  };
  const std::vector<Flag> flags = {{"--tag-size-m", {"tags", "aprilgrid"}},
                                   {"--spacing", {"tags", "aprilgrid"}},
                                   {"--square-size-m", {"chessboard", "charuco"}},
                                   {"--marker-size-m", {"charuco"}},
                                   {"--dictionary", {"charuco"}},
                                   {"--legacy-pattern", {"charuco"}},
                                   {"--first-id", {"tags", "aprilgrid", "charuco"}},
                                   {"--detections", {"tags"}}};
  Refusals refused(args.settings.app());
  for (const Flag& flag : flags)
    refused.flags(std::ranges::find(flag.of, kind) == flag.of.end(), {flag.name},
                  fmt::format("this has no effect on the target {}", kind),
                  fmt::format("Leave it out, or choose --target {}.", fmt::join(flag.of, " or ")));
  return refused.status();
}

/// Flags that have no effect on what is given.
Status check_effects(const CalibrateCameraArgs& args) {
  const CalibrateCameraJob& job = args.job;
  const bool detected = !job.detections.empty();
  const char* why = "with --detections nothing is detected";
  Refusals refused(args.settings.app());
  refused.flags(detected, {"--recursive"}, why, "Leave it out, or give pictures.");
  refused.options(detected, args.views, why, "Leave it out, or give a video.");
  refused.all(detected, args.detector, why, "Leave it out, or give pictures.");
  refused.flags(!job.target.map.empty(), {"--spacing", "--first-id", "--target"},
                "this is about a board, and --map names a map", "Leave it out.");
  refused.flags(job.output.empty(), {"--format"}, "this is about --output", "Give -o, or leave it out.");
  refused.flags(job.output.empty() && job.camera_info.empty(), {"--force"}, "nothing is written",
                "Give -o, or leave it out.");
  return refused.status() ? check_target_flags(args) : refused.status();
}

/// Flags that have no effect on pictures, or on a live camera.
Status check_guided_flags(const CalibrateCameraArgs& args, bool live) {
  const bool guided = live || args.guided;
  const char* hint = "Add --guided, or give a live camera.";
  Refusals refused(args.settings.app());
  refused.flags(!live, {"--view"}, "this is about live cameras", "Leave it out.");
  refused.flags(!guided, {"--resume"}, "only a guided calibration keeps its views", hint);
  refused.options(!guided, args.guide, "only a guided calibration chooses its views so", hint);
  refused.options(guided, args.views, "a guided calibration chooses its views otherwise", "See --set guide.");
  refused.flags(guided, {"--map", "--detections"}, "a guided calibration is for boards", "Leave it out.");
  return refused.status();
}

}  // namespace

CalibrateCameraArgs::CalibrateCameraArgs(CLI::App& verb)
    : settings(verb),
      fitting(settings, "fit", "Fit"),
      views(settings, "views", "Views of a video"),
      guide(settings, "guide", "Guided calibration", Reach::SettingsOnly),
      detector(settings, kMoreGroup) {
  add_fields(verb, static_cast<CalibrateCameraWords&>(*this));
  verb.get_option("--format")->check(CLI::IsMember(calibration_formats()));
  verb.add_flag("--json", json, "One JSON object instead of tables");
}

Status CalibrateCameraArgs::check(bool live) const {
  Status status = check_effects(*this);
  if (status) status = check_sources(*this);
  if (status) status = check_guided_flags(*this, live);
  return status && guided && !live ? check_guided_sources(job) : status;
}

}  // namespace waymark::cli
