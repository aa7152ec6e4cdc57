#include "waymark/app/common/detect_all.hpp"

#include <cstdlib>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/recording/log_formats.hpp"

namespace waymark {
namespace {

/// Finds the tags of the picture that the report is of. A lens of another picture size is not applied.
void find_in(const ImageView& image, const TagFinder& finder, const CameraModel* camera,
             PictureReport& report) {
  const bool fits = camera != nullptr && check_picture_size(*camera, image.width, image.height);
  auto found = find_tags(image, finder, fits ? camera : nullptr);
  if (!found) {
    report.error = found.error();
    report.error->place.source = report.image;
    return;
  }
  report.detected = true;
  report.detections = std::move(found->detections);
  report.refinements = std::move(found->refinements);
}

/// Reads the picture and finds its tags; what fails is in the report.
Image process(const Input& input, const TagFinder& finder, const CameraModel* camera, PictureReport& report) {
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
  find_in(*image, finder, camera, report);
  return std::move(*image);
}

}  // namespace

namespace internal {

std::string name_of_picture(const std::string& path, SensorTime stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = stamp.time_since_epoch().count();
  return fmt::format("{}#{}.{:09}", path, ns / kSecond, std::abs(ns % kSecond));
}

PictureReport report_on(const std::string& path, SensorTime stamp, const ImageView& image,
                        const TagFinder& finder, const CameraModel* camera) {
  PictureReport report{.image = name_of_picture(path, stamp),
                       .stamp = stamp,
                       .width_px = image.width,
                       .height_px = image.height};
  find_in(image, finder, camera, report);
  return report;
}

void count(const PictureReport& report, const JobControl& control, DetectSummary& summary) {
  summary.tags += report.detections.size();
  ++(report.error ? summary.failed : summary.pictures);
  if (!report.error) return;
  const std::string words = to_string(*report.error);
  if (summary.said.insert(words).second) control.note(words);
}

void fail_with(Error error, const std::string& path, const JobControl& control, DetectSummary& summary) {
  if (error.place.source.empty()) error.place.source = path;
  control.note(to_string(error));
  ++summary.failed;
}

}  // namespace internal

DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder, const CameraModel* camera,
                         const JobControl& control, const EachPicture& each) {
  DetectSummary summary;
  bool going = true;
  for (std::size_t i = 0; i < inputs.size() && going; ++i) {
    summary.stopped = control.cancelled();
    if (summary.stopped) {
      control.note(fmt::format("stopped after {} of {} inputs", i, inputs.size()));
      break;
    }
    control.progress({inputs[i].path, i, inputs.size()});
    if (!inputs[i].error && looks_like_recording(inputs[i].path)) {
      going = detect_recording(i, inputs[i].path, finder, camera, control, each, summary);
      continue;
    }
    if (!inputs[i].error && looks_like_video(inputs[i].path)) {
      going = detect_video(i, inputs[i].path, finder, camera, control, each, summary);
      continue;
    }
    PictureReport report;
    const Image image = process(inputs[i], finder, camera, report);
    going = each(i, report, image);
    internal::count(report, control, summary);
  }
  return summary;
}

Result<TagFinder> described_finder(DetectorOptions options, const RefinementOptions& refinement,
                                   const std::vector<std::string>& families, bool refined) {
  for (const std::string& name : families) {
    auto id = parse_family(name);
    if (id) continue;
    id.error().place.key = "--family";
    return tl::unexpected(std::move(id.error()));
  }
  if (!families.empty()) options.families = families;
  auto finder = make_tag_finder(options, refinement);
  if (finder && !refined) finder->refinement.reset();
  return finder;
}

}  // namespace waymark
