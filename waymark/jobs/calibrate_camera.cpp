#include "waymark/jobs/calibrate_camera.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/config/calibration_file.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark {
namespace {

/// A picture and what it shows of the target.
struct SeenPicture {
  PictureReport report{};
  TargetPicture marks{};
};

/// The pictures that could be looked at, all of one size.
struct SeenPictures {
  std::vector<std::string> names{};
  std::vector<std::vector<TagDetection>> detections{};
  std::vector<TargetPicture> marks{};
  int width_px = 0;
  int height_px = 0;
};

Status add_picture(SeenPicture picture, SeenPictures& seen) {
  const PictureReport& report = picture.report;
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
  seen.marks.push_back(std::move(picture.marks));
  seen.detections.push_back(std::move(picture.report.detections));
  return {};
}

std::vector<std::size_t> views_of_video(const std::vector<SeenPicture>& filmed,
                                        const VideoViewOptions& options) {
  std::vector<StampedMarks> pictures;
  pictures.reserve(filmed.size());
  for (const SeenPicture& picture : filmed)
    pictures.push_back({picture.report.stamp.value_or(SensorTime()), picture.marks});
  const double diagonal_px =
      filmed.empty() ? 0 : std::hypot(filmed.front().report.width_px, filmed.front().report.height_px);
  return choose_views(pictures, diagonal_px, options);
}

/// The pictures of the job in their order; of a video those worth it.
class PictureChoice {
 public:
  PictureChoice(const CalibrateCameraJob& job, const CalibrationTarget& target, const JobControl& control)
      : job_(job), target_(target), control_(control) {}

  Result<SeenPictures> read(const TagFinder& finder) {
    inputs_ = find_inputs(job_.sources, job_.recursive);
    video_ = inputs_.size();
    const DetectSummary summary = detect_all(
        inputs_, finder, control_, [&](std::size_t index, PictureReport& report, const ImageView& image) {
          return take(index, report, image);
        });
    end_video();
    if (!fits_) return tl::unexpected(fits_.error());
    if (summary.stopped) return fail(ErrorCode::InvalidArgument, "stopped");
    return std::move(seen_);
  }

 private:
  bool take(std::size_t index, const PictureReport& report, const ImageView& image) {
    if (index != video_) end_video();
    video_ = index;
    SeenPicture picture{.report = report};
    if (!target_.is_board())
      picture.marks = target_marks(report.detections, target_.tags());
    else if (report.detected && fits_)
      fits_ = find_board(image, picture);
    if (report.stamp && looks_like_video(inputs_[index].path))
      filmed_.push_back(std::move(picture));
    else if (fits_)
      fits_ = add_picture(std::move(picture), seen_);
    return fits_.has_value();
  }

  Status find_board(const ImageView& image, SeenPicture& picture) const {
    auto marks = target_.find(image, {});
    if (!marks) return tl::unexpected(marks.error());
    picture.marks = *std::move(marks);
    return {};
  }

  void end_video() {
    const std::vector<std::size_t> chosen = views_of_video(filmed_, job_.views);
    if (!filmed_.empty())
      control_.note(fmt::format("{}: {} of {} pictures stand still and show the board anew",
                                inputs_[video_].path, chosen.size(), filmed_.size()));
    for (const std::size_t i : chosen)
      if (fits_) fits_ = add_picture(std::move(filmed_[i]), seen_);
    filmed_.clear();
  }

  const CalibrateCameraJob& job_;
  const CalibrationTarget& target_;
  const JobControl& control_;
  std::vector<Input> inputs_{};
  std::size_t video_ = 0;              ///< that is being read
  std::vector<SeenPicture> filmed_{};  ///< its pictures so far
  SeenPictures seen_{};
  Status fits_{};
};

Result<SeenPictures> from_detections(const std::string& path) {
  const auto text = read_text(path == "-" ? "/dev/stdin" : path);
  if (!text) return tl::unexpected(text.error());
  auto reports = parse_reports(*text, path);
  if (!reports) return tl::unexpected(reports.error());
  SeenPictures seen;
  for (PictureReport& report : *reports)
    if (const Status fits = add_picture({.report = std::move(report)}, seen); !fits)
      return tl::unexpected(fits.error());
  return seen;
}

/// PhotonVision writes JSON, the others YAML; whose YAML it is, the ending does not tell.
std::string format_of(const CalibrateCameraJob& job) {
  if (!job.format.empty()) return job.format;
  return job.output.ends_with(".json") ? "photonvision" : "waymark";
}

CameraObservation observation_of(const CalibrateCameraReport& report, std::size_t picture) {
  const CalibratedView& view = report.found.views[picture];
  const SE3 cam_T_target = view.target_T_cam.inverse();
  CameraObservation seen{.picture = report.pictures[picture], .cam_T_target = cam_T_target};
  for (std::size_t i = 0; i < view.used.size(); ++i) {
    const TargetMark& mark = report.marks[picture][i];
    for (std::size_t k = 0; k < mark.seen_px.size(); ++k) {
      const auto px = report.found.camera.project(cam_T_target * mark.target_points_m[k]);
      seen.target_points_m.push_back(mark.target_points_m[k]);
      seen.seen_px.push_back(mark.seen_px[k]);
      seen.errors_px.emplace_back(px ? Eigen::Vector2d(*px - mark.seen_px[k])
                                     : Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()));
      seen.used.push_back(view.used[i]);
    }
  }
  return seen;
}

Result<std::string> text_as(const std::string& format, const NamedCamera& camera,
                            const CalibrateCameraReport& report) {
  if (format == "ros") return to_camera_info_yaml(camera);
  if (format == "kalibr") return to_camchain_yaml({camera});
  if (format == "opencv") return to_opencv_yaml(camera);
  std::vector<CameraObservation> observations;
  for (std::size_t i = 0; i < report.pictures.size(); ++i)
    if (!report.found.views[i].used.empty()) observations.push_back(observation_of(report, i));
  return to_photonvision_json(camera, observations);
}

Status write_as(const std::string& format, const std::string& path, const NamedCamera& camera,
                const CalibrateCameraReport& report) {
  const auto text = text_as(format, camera, report);
  return text ? write_text_file(path, *text) : Status(tl::unexpected(text.error()));
}

Status write_ours(const CalibrateCameraJob& job, const CalibrateCameraReport& report) {
  Calibration calibration = to_calibration(report.found);
  calibration.provenance.insert(calibration.provenance.begin(),
                                {"pictures", fmt::format("{}", report.pictures.size())});
  return write_calibration(job.output, calibration);
}

}  // namespace

const std::vector<std::string>& calibration_formats() {
  static const std::vector<std::string> all = {"waymark", "ros", "kalibr", "photonvision", "opencv"};
  return all;
}

Status check_outputs(const CalibrateCameraJob& job) {
  if (const Status free =
          job.output.empty() || format_of(job) != "waymark" ? Status() : check_calibration_place(job.output);
      !free)
    return free;
  for (const std::string& output : {job.output, job.camera_info}) {
    if (const Status writable = output.empty() ? Status() : check_output_file(output); !writable)
      return writable;
  }
  return {};
}

Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job, const CalibrationTarget& target,
                                               const TagFinder& finder, const JobControl& control) {
  const TagFinder reader = no_tags();
  Result<SeenPictures> seen =
      job.detections.empty() ? PictureChoice(job, target, control).read(target.is_board() ? reader : finder)
                             : from_detections(job.detections);
  if (!seen) return tl::unexpected(seen.error());
  if (seen->names.empty()) return fail(ErrorCode::NotFound, "no picture could be read");
  const auto lens = lens_model(job.lens);  // nothing: auto
  Result<CameraCalibration> found =
      target.is_board() ? calibrate_camera(seen->marks, seen->width_px, seen->height_px, lens, job.options)
                        : calibrate_camera(seen->detections, target.tags(), seen->width_px, seen->height_px,
                                           lens, job.options);
  if (!found) return tl::unexpected(found.error());
  if (!target.is_board())
    for (std::size_t i = 0; i < seen->marks.size(); ++i)
      seen->marks[i] = target_marks(seen->detections[i], target.tags());
  return CalibrateCameraReport{.found = std::move(*found),
                               .pictures = std::move(seen->names),
                               .marks = std::move(seen->marks),
                               .marks_word = target.marks_word()};
}

Status write_camera_calibration(const CalibrateCameraJob& job, const CalibrateCameraReport& report) {
  const NamedCamera camera{.name = "cam0", .camera = report.found.camera};
  if (!job.output.empty()) {
    const std::string format = format_of(job);
    if (Status written =
            format == "waymark" ? write_ours(job, report) : write_as(format, job.output, camera, report);
        !written)
      return written;
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
                                {report.marks_word, view.marks},
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
