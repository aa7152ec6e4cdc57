#include "waymark/cli/convert_video_flags.hpp"
#include "waymark/jobs/convert_log.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/cli/parts.hpp"
#include "waymark/live/record_camera.hpp"

namespace waymark::cli {

ConvertVideoFlags::ConvertVideoFlags(CLI::App& verb)
    : app_(verb), settings_(verb), poses_(verb), detector_(settings_, kMoreGroup) {
  add_option(verb, "--pictures NAME", pictures_,
             "Format in which the pictures of a video or a camera are kept: jpeg or raw",
             one_of({"jpeg", "raw"}));
  add_option(verb, "--duration-s FLOAT", duration_s_,
             "Time for which a live camera is recorded; 0: until Ctrl-C", between(0.0, 1e7));
}

Status ConvertVideoFlags::check_unused() const {
  const char* why = "cameras, tag sizes, detectors and --pictures have no effect on recordings";
  const char* hint = "Leave it out, or give one video.";
  Refusals refused(app_);
  refused.flags(true, {"--pictures"}, why, hint);
  refused.flags(true, {"--duration-s"}, "this is about live cameras", "Leave it out.");
  refused.all(true, poses_, why, hint);
  refused.all(true, detector_, why, hint);
  return refused.status();
}

Result<ConvertVideoFlags::Prepared> ConvertVideoFlags::prepare(const std::string& input,
                                                               const std::string& output) const {
  if (const Status used = check_no_recording(given_on(app_)); !used) return tl::unexpected(used.error());
  const auto poses = poses_.make();
  if (!poses) return tl::unexpected(naming_flag(poses.error()));
  auto finder = detector_.make();
  if (!finder) return tl::unexpected(naming_flag(finder.error()));
  Prepared prepared{{.input = input, .output = output, .pictures = pictures_}, std::move(*finder)};
  if (*poses) {
    prepared.job.camera = (*poses)->camera;
    prepared.job.sizes = (*poses)->sizes;
  }
  return prepared;
}

ExitCode ConvertVideoFlags::convert(const std::string& input, const std::string& output, bool json,
                                    Console& console) const {
  Refusals refused(app_);
  refused.flags(true, {"--duration-s"}, "this is about live cameras", "Leave it out.");
  const auto prepared = refused.status() ? prepare(input, output) : tl::unexpected(refused.status().error());
  if (!prepared) return fail_with(prepared.error(), console);
  const Result<VideoTags> found = convert_video(prepared->job, prepared->finder, control_from(console));
  if (!found) return fail_by_kind(found.error(), console);
  for (const VideoProblem& problem : found->problems)
    console.say(fmt::format("note: {}{}", to_string(problem.error),
                            problem.count > 1 ? fmt::format(" ({} times)", problem.count) : ""));
  console.print(json ? json_line(to_json(prepared->job, *found)) : to_text(prepared->job, *found));
  return ExitCode::Ok;
}

ExitCode ConvertVideoFlags::record(const std::string& address, const std::string& output, bool json,
                                   Console& console) const {
  const auto prepared = prepare(address, output);
  if (!prepared) return fail_with(prepared.error(), console);
  const auto report = record_camera(prepared->job, duration_s_, prepared->finder, control_from(console));
  if (!report) return fail_by_kind(report.error(), console);
  console.print(json ? json_line(to_json(prepared->job, *report)) : to_text(prepared->job, *report));
  return report->end.stopped ? ExitCode::Interrupted : ExitCode::Ok;
}

}  // namespace waymark::cli
