#include "waymark/cli/convert_video_flags.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/counted.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/live/record_camera.hpp"

namespace waymark::cli {
namespace {

ExitCode say_failed(const Error& error, Console& console) {
  const bool usage = !interrupted() && error.code == ErrorCode::InvalidArgument;
  return usage ? fail_usage(error, console) : fail_with(error, console);
}

}  // namespace

ConvertVideoFlags::ConvertVideoFlags(CLI::App& verb)
    : app_(verb), settings_(verb), poses_(verb), detector_(verb, settings_, kMoreGroup) {
  add_option(verb, "--pictures NAME", pictures_,
             "Format in which the pictures of a video or a camera are kept: jpeg or raw",
             one_of({"jpeg", "raw"}));
  add_option(verb, "--duration-s FLOAT", duration_s_,
             "Time for which a live camera is recorded; 0: until Ctrl-C", between(0.0, 1e7));
}

Status ConvertVideoFlags::check_unused() const {
  const char* why = "cameras, tag sizes, detectors and --pictures have no effect on recordings";
  const char* hint = "Leave it out, or give one video.";
  Status status = refuse_flag(app_, "--pictures", why, hint);
  if (status) status = refuse_flag(app_, "--duration-s", "this is about live cameras", "Leave it out.");
  if (status) status = poses_.refuse_all(why, hint);
  return status ? detector_.refuse_all(why, hint) : status;
}

Status ConvertVideoFlags::check_used() const {
  Status status;
  for (const char* flag :
       {"--format", "--topics", "--from", "--to", "--kind", "--robot", "--tag-latency-s"}) {
    if (status)
      status = refuse_flag(app_, flag, "this is about recordings, and the input is none", "Leave it out.");
  }
  return status;
}

Result<ConvertVideoFlags::Prepared> ConvertVideoFlags::prepare(const std::string& input,
                                                               const std::string& output) const {
  if (const Status used = check_used(); !used) return tl::unexpected(used.error());
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
  Status usage = refuse_flag(app_, "--duration-s", "this is about live cameras", "Leave it out.");
  const auto prepared = usage ? prepare(input, output) : tl::unexpected(usage.error());
  if (!prepared) return fail_with(prepared.error(), console);
  const Result<VideoTags> found = convert_video(prepared->job, prepared->finder, control_from(console));
  if (!found) return say_failed(found.error(), console);
  for (const VideoProblem& problem : found->problems)
    console.say(fmt::format("note: {}{}", to_string(problem.error),
                            problem.count > 1 ? fmt::format(" ({} times)", problem.count) : ""));
  console.print(json ? json_line(to_json(prepared->job, *found))
                     : fmt::format("{} ({}, {} x {} px) to {}: {}, {}\n", input, found->info.codec,
                                   found->info.width_px, found->info.height_px, output,
                                   counted(found->pictures, "picture"), counted(found->tags, "tag")));
  return ExitCode::Ok;
}

ExitCode ConvertVideoFlags::record(const std::string& address, const std::string& output, bool json,
                                   Console& console) const {
  const auto prepared = prepare(address, output);
  if (!prepared) return fail_with(prepared.error(), console);
  const auto report = record_camera(prepared->job, duration_s_, prepared->finder, control_from(console));
  if (!report) return say_failed(report.error(), console);
  console.print(json ? json_line(to_json(prepared->job, *report)) : to_text(prepared->job, *report));
  return report->end.stopped ? ExitCode::Interrupted : ExitCode::Ok;
}

}  // namespace waymark::cli
