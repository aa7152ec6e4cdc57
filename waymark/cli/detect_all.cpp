#include "waymark/cli/detect_all.hpp"

#include <utility>

#include <fmt/format.h>

#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/recording_input.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/jobs/recording_kind.hpp"

namespace waymark::cli {
namespace {

/// Reads the picture and finds its tags; what fails is in the report.
Image process(const Input& input, const TagFinder& finder, PictureReport& report) {
  report.image = input.path;
  report.error = input.error;
  if (report.error) return {};
  auto image = read_image(input.path);
  if (!image) {
    report.error = image.error();
    return {};
  }
  report.width_px = image->width();
  report.height_px = image->height();
  auto found = find_tags(*image, finder);
  if (!found) {
    report.error = found.error();
    report.error->place.source = input.path;
    return std::move(*image);
  }
  report.detected = true;
  report.detections = std::move(found->detections);
  report.refinements = std::move(found->refinements);
  return std::move(*image);
}

}  // namespace

ExitCode DetectSummary::exit_code() const {
  if (stopped) return ExitCode::Interrupted;
  return failed > 0 ? ExitCode::SomeFailed : ExitCode::Ok;
}

DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder, Console& console,
                         const EachPicture& each) {
  DetectSummary summary;
  for (std::size_t i = 0; i < inputs.size() && !console.output_ended(); ++i) {
    summary.stopped = interrupted();
    if (summary.stopped) {
      console.say(fmt::format("stopped after {} of {} inputs", i, inputs.size()));
      break;
    }
    console.progress(i, inputs.size(), inputs[i].path);
    if (!inputs[i].error && looks_like_recording(inputs[i].path)) {
      detect_recording(i, inputs[i].path, finder, console, each, summary);
      if (summary.stopped) break;
      continue;
    }
    PictureReport report;
    const Image image = process(inputs[i], finder, report);
    each(i, report, image);
    summary.tags += report.detections.size();
    ++(report.error ? summary.failed : summary.pictures);
    if (report.error) console.say(*report.error);
  }
  console.end_progress();
  return summary;
}

}  // namespace waymark::cli
