#include "waymark/jobs/calibrate_camera.hpp"

#include <cmath>
#include <cstdint>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/families/family.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/samples/tag_sizes.hpp"

namespace waymark {
namespace {

/// The tags of a board as `waymark tags board` draws it: numbers from the lower left to the right, then up.
/// Origin in its middle, x right, y down.
TagMap board_of(const CalibrateCameraJob& job) {
  const double pitch_m = job.tag_size_m * (1 + job.spacing);
  TagMap board;
  for (int row = 0; row < job.rows; ++row) {
    for (int column = 0; column < job.columns; ++column) {
      const double x_m = pitch_m * (column - 0.5 * (job.columns - 1));
      const double y_m = -pitch_m * (row - 0.5 * (job.rows - 1));
      board.tags.emplace(TagId{FamilyId::Tag36h11, job.first_id + row * job.columns + column},
                         MappedTag{.map_T_tag = SE3(SO3(), {x_m, y_m, 0}), .size_m = job.tag_size_m});
    }
  }
  return board;
}

/// The pictures that could be looked at, all of one size.
struct SeenPictures {
  std::vector<std::string> names{};
  std::vector<std::vector<TagDetection>> detections{};
  int width_px = 0;
  int height_px = 0;
};

Status add_picture(PictureReport& report, SeenPictures& seen) {
  if (report.error || !report.detected) return {};
  if (seen.names.empty()) {
    seen.width_px = report.width_px;
    seen.height_px = report.height_px;
  }
  if (report.width_px != seen.width_px || report.height_px != seen.height_px)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} x {} pixels, but {} has {} x {}", report.width_px, report.height_px,
                            seen.names.front(), seen.width_px, seen.height_px),
                {.source = report.image}, "Calibrate with pictures of one camera in one resolution.");
  seen.names.push_back(report.image);
  seen.detections.push_back(std::move(report.detections));
  return {};
}

std::vector<std::size_t> views_of_video(const std::vector<PictureReport>& filmed,
                                        const VideoViewOptions& options) {
  std::vector<StampedTags> pictures;
  for (const PictureReport& report : filmed)
    pictures.push_back({report.stamp.value_or(SensorTime()), report.detections});
  const double diagonal_px =
      filmed.empty() ? 0 : std::hypot(filmed.front().width_px, filmed.front().height_px);
  return choose_views(pictures, diagonal_px, options);
}

Result<SeenPictures> from_pictures(const CalibrateCameraJob& job, const TagFinder& finder,
                                   const JobControl& control) {
  SeenPictures seen;
  Status fits;
  const std::vector<Input> inputs = find_inputs(job.sources, job.recursive);
  std::vector<PictureReport> filmed;  // of the video that is being read
  std::size_t video = inputs.size();
  const auto end_video = [&] {
    const std::vector<std::size_t> chosen = views_of_video(filmed, job.views);
    if (!filmed.empty())
      control.note(fmt::format("{}: {} of {} pictures stand still and show the board anew",
                               inputs[video].path, chosen.size(), filmed.size()));
    for (const std::size_t i : chosen)
      if (fits) fits = add_picture(filmed[i], seen);
    filmed.clear();
  };
  const DetectSummary summary =
      detect_all(inputs, finder, control, [&](std::size_t index, PictureReport& report, const ImageView&) {
        if (index != video) end_video();
        video = index;
        if (report.stamp && looks_like_video(inputs[index].path))
          filmed.push_back(report);
        else if (fits)
          fits = add_picture(report, seen);
        return fits.has_value();
      });
  end_video();
  if (!fits) return tl::unexpected(fits.error());
  if (summary.stopped) return fail(ErrorCode::InvalidArgument, "stopped");
  return seen;
}

Result<SeenPictures> from_detections(const std::string& path) {
  const auto text = read_text(path == "-" ? "/dev/stdin" : path);
  if (!text) return tl::unexpected(text.error());
  auto reports = parse_reports(*text, path);
  if (!reports) return tl::unexpected(reports.error());
  SeenPictures seen;
  for (PictureReport& report : *reports)
    if (const Status fits = add_picture(report, seen); !fits) return tl::unexpected(fits.error());
  return seen;
}

}  // namespace

Result<TagMap> calibration_target(const CalibrateCameraJob& job) {
  const bool board = job.columns > 0 || job.rows > 0 || job.tag_size_m != 0;
  if (board != job.map.empty())
    return fail(ErrorCode::InvalidArgument,
                "give either the board (--cols, --rows, --tag-size-m) or a map of tags (--map)");
  if (!job.map.empty()) return read_map(job.map).map([](const MapFile& map) { return map.tags; });
  if (job.columns < 1 || job.rows < 1 || !is_tag_size(job.tag_size_m))
    return fail(ErrorCode::InvalidArgument,
                "a board has --cols and --rows of 1 or more and a --tag-size-m above 0", {},
                "Measure the black square of a tag with a ruler.");
  const auto ids = static_cast<std::int64_t>(family(FamilyId::Tag36h11).codes.size());
  const std::int64_t last = job.first_id + static_cast<std::int64_t>(job.columns) * job.rows - 1;
  if (job.first_id < 0 || last >= ids)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("the board would carry the tags {} to {}, and there are 0 to {}", job.first_id,
                            last, ids - 1),
                {}, "Look at --cols, --rows and --first-id.");
  return board_of(job);
}

Status check_outputs(const CalibrateCameraJob& job) {
  if (const Status free = job.output.empty() ? Status() : check_calibration_place(job.output); !free)
    return free;
  for (const std::string& output : {job.output, job.camera_info}) {
    if (const Status writable = output.empty() ? Status() : check_output_file(output); !writable)
      return writable;
  }
  return {};
}

Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job, const TagMap& target,
                                               const TagFinder& finder, const JobControl& control) {
  Result<SeenPictures> seen =
      job.detections.empty() ? from_pictures(job, finder, control) : from_detections(job.detections);
  if (!seen) return tl::unexpected(seen.error());
  if (seen->names.empty()) return fail(ErrorCode::NotFound, "no picture could be read");
  const auto lens = lens_model(job.lens);  // nothing: auto
  Result<CameraCalibration> found =
      calibrate_camera(seen->detections, target, seen->width_px, seen->height_px, lens, job.options);
  if (!found) return tl::unexpected(found.error());
  return CalibrateCameraReport{.found = std::move(*found), .pictures = std::move(seen->names)};
}

Status write_camera_calibration(const CalibrateCameraJob& job, const CalibrateCameraReport& report) {
  if (!job.output.empty()) {
    Calibration calibration = to_calibration(report.found);
    calibration.provenance.insert(calibration.provenance.begin(),
                                  {"pictures", fmt::format("{}", report.pictures.size())});
    if (Status written = write_calibration(job.output, calibration); !written) return written;
  }
  if (job.camera_info.empty()) return {};
  return write_text_file(job.camera_info,
                         to_camera_info_yaml({.name = "cam", .camera = report.found.camera}));
}

double sigma_of(const CameraCalibration& found, std::size_t parameter) {
  const auto k = static_cast<Eigen::Index>(parameter);
  return std::sqrt(std::max(0.0, found.covariance(k, k)));
}

nlohmann::ordered_json to_json(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  nlohmann::ordered_json json = {{"lens", to_string(found.lens)},
                                 {"width_px", found.camera.width_px()},
                                 {"height_px", found.camera.height_px()},
                                 {"rms_px", found.rms_px},
                                 {"held_out_rms_px", found.held_out_rms_px},
                                 {"noise_scale", found.noise_scale}};
  for (std::size_t i = 0; i < found.names.size(); ++i)
    json["parameters"][found.names[i]] = {{"value", found.parameters[static_cast<Eigen::Index>(i)]},
                                          {"sigma", sigma_of(found, i)}};
  json["lenses"] = nlohmann::ordered_json::array();
  for (const LensTrial& trial : found.trials)
    json["lenses"].push_back(
        {{"lens", to_string(trial.lens)},
         {"held_out_rms_px", trial.held_out_rms_px ? nlohmann::ordered_json(*trial.held_out_rms_px)
                                                   : nlohmann::ordered_json(nullptr)}});
  json["pictures"] = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    json["pictures"].push_back({{"picture", report.pictures[i]},
                                {"tags", view.tags},
                                {"rejected", view.rejected},
                                {"rms_px", view.rms_px},
                                {"tilt_deg", view.tilt_deg},
                                {"distance_m", view.distance_m}});
  }
  json["regions"] = nlohmann::ordered_json::array();
  for (const ImageRegion& region : found.regions)
    json["regions"].push_back({{"corners", region.corners}, {"rms_px", region.rms_px}});
  json["advice"] = found.advice;
  return json;
}

}  // namespace waymark
