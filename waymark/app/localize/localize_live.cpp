#include "waymark/app/localize/localize_live.hpp"

#include <memory>
#include <optional>

#include <fmt/format.h>

#include "waymark/app/localize/localize_lines.hpp"
#include "waymark/base/counted.hpp"

namespace waymark {
namespace {

Result<DescribedCamera> camera_of(const LocalizeLive& words) {
  if (words.camera.file.empty())
    return fail(ErrorCode::InvalidArgument, "the calibration of the camera is not known", {.key = "--camera"},
                "`waymark calibrate camera` makes one.");
  return read_camera(words.camera);
}

std::function<void(const CameraMoment&)> lines_of(const LocalizeLive& words, const LocalizeLines& lines) {
  const auto moments = std::make_shared<MomentLines>(words.every_s, lines.json, lines.print);
  return [moments](const CameraMoment& moment) { moments->take(moment); };
}

}  // namespace

LocalizeRobotJob described_robot(const LocalizeLive& words, const LocalizeJob& job,
                                 const LocalizeLines& lines) {
  LocalizeRobotJob live{.localize = job, .images = words.images};
  live.session.report_every =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(words.every_s));
  if (words.duration_s > 0) live.session.most_s = words.duration_s;
  live.on_report = [lines, first = std::optional<SensorTime>()](
                       SensorTime now, const std::optional<LocalizationEstimate>& estimate) mutable {
    if (!first) first = now;
    lines.print(lines.json ? estimate_json(now, estimate)
                           : estimate_line(to_seconds(now - *first), estimate));
  };
  return live;
}

Result<LocalizeCameraJob> described_live_camera(const LocalizeLive& words, const LocalizeJob& job,
                                                const LocalizeLines& lines) {
  const Result<DescribedCamera> camera = camera_of(words);
  if (!camera) return tl::unexpected(camera.error());
  return LocalizeCameraJob{.localize = job,
                           .camera = camera->camera,
                           .images = words.images,
                           .duration_s = words.duration_s,
                           .on_moment = lines_of(words, lines)};
}

Result<LocalizeVideoJob> described_video(const LocalizeLive& words, const LocalizeJob& job,
                                         const LocalizeLines& lines) {
  const Result<DescribedCamera> camera = camera_of(words);
  if (!camera) return tl::unexpected(camera.error());
  return LocalizeVideoJob{.localize = job,
                          .camera = camera->camera,
                          .readout_s = camera->readout_s,
                          .on_moment = lines_of(words, lines)};
}

std::string to_text(const LocalizeCameraReport& report) {
  return fmt::format("{} in {:.1f} s, the place known in {}", counted(report.end.pictures, "picture"),
                     report.end.seconds, report.known);
}

std::string to_text(const LocalizeVideoReport& report) {
  return fmt::format("{}, the place known in {}", counted(report.video.pictures, "picture"), report.known);
}

}  // namespace waymark
