#include "waymark/cli/calibrate_camera_flags.hpp"

#include "waymark/cli/job_flags.hpp"

namespace waymark::cli {
namespace {

/// Options that have no effect on what is given.
Status check_options(const CalibrateCameraArgs& args, bool guided) {
  const bool detected = !args.job.detections.empty();
  const char* why = "with --detections nothing is detected";
  Refusals refused(args.settings.app());
  refused.options(detected, args.views, why, "Leave it out, or give a video.");
  refused.all(detected, args.detector, why, "Leave it out, or give pictures.");
  refused.options(!guided, args.guide, "only a guided calibration chooses its views so", kGuided);
  refused.options(guided, args.views, "a guided calibration chooses its views otherwise", "See --set guide.");
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
  const Status sound = check_effects(*this, live, given_on(settings.app()));
  return sound ? check_options(*this, live || guided) : sound;
}

}  // namespace waymark::cli
