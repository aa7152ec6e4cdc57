#include "waymark/cli/convert_video_flags.hpp"

#include <optional>
#include <utility>

#include <fmt/format.h>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/jobs/convert_video.hpp"
#include "waymark/jobs/json_line.hpp"

namespace waymark::cli {

ConvertVideoFlags::ConvertVideoFlags(CLI::App& verb)
    : app_(verb), settings_(verb), poses_(verb), detector_(verb, settings_, kMoreGroup) {
  verb.add_option("--pictures", pictures_, "Format in which the pictures of a video are kept: jpeg or raw")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("NAME");
}

Status ConvertVideoFlags::check_unused() const {
  const char* why = "cameras, tag sizes, detectors and --pictures have no effect on recordings";
  const char* hint = "Leave it out, or give one video.";
  Status status = refuse_flag(app_, "--pictures", why, hint);
  if (status) status = poses_.refuse_all(why, hint);
  return status ? detector_.refuse_all(why, hint) : status;
}

Status ConvertVideoFlags::check_used() const {
  Status status;
  for (const char* flag :
       {"--format", "--topics", "--from", "--to", "--kind", "--robot", "--tag-latency-s"}) {
    if (status)
      status = refuse_flag(app_, flag, "this is about recordings, and the input is a video", "Leave it out.");
  }
  return status;
}

ExitCode ConvertVideoFlags::convert(const std::string& input, const std::string& output, bool json,
                                    Console& console) const {
  if (const Status used = check_used(); !used) return console.failed(used.error(), ExitCode::Usage);
  const auto poses = poses_.make();
  if (!poses) return fail_usage(poses.error(), console);
  const auto finder = detector_.make();
  if (!finder) return fail_usage(finder.error(), console);
  ConvertVideoJob job{.input = input, .output = output, .pictures = pictures_};
  if (*poses) {
    job.camera = (*poses)->camera;
    job.tag_size_m = (*poses)->sizes.default_size_m;
  }
  const Result<VideoTags> found = convert_video(job, *finder, control_from(console));
  if (!found) {
    console.say(naming_flag(found.error()));
    if (interrupted()) return ExitCode::Interrupted;
    return found.error().code == ErrorCode::InvalidArgument ? ExitCode::Usage : exit_code_of(found.error());
  }
  for (const VideoProblem& problem : found->problems)
    console.say(fmt::format("note: {}{}", to_string(problem.error),
                            problem.count > 1 ? fmt::format(" ({} times)", problem.count) : ""));
  console.print(json ? json_line(to_json(job, *found))
                     : fmt::format("{} ({}, {} x {} px) to {}: {} pictures, {} tags\n", input,
                                   found->info.codec, found->info.width_px, found->info.height_px, output,
                                   found->pictures, found->tags));
  return ExitCode::Ok;
}

}  // namespace waymark::cli
