#include "waymark/app/calibrate_camera/calibrate_camera.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/config/exchange/camera_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/tags/detector.hpp"

namespace waymark {

// Selection of views from a video.
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Speed of the marks in each image: the larger of the speeds from the previous image and to the next
/// one. Images at a start or a stop therefore count as moving.
std::vector<double> speeds_px_s(const std::vector<StampedMarks>& images) {
  std::vector<double> speeds(images.size(), 0);
  for (std::size_t i = 1; i < images.size(); ++i) {
    const double dt_s = std::max(to_seconds(images[i].stamp - images[i - 1].stamp), 1e-6);
    const double apart = apart_px(images[i - 1].marks, images[i].marks);
    const double speed = std::isfinite(apart) ? apart / dt_s : kInfinity;
    speeds[i] = std::max(speeds[i], speed);
    speeds[i - 1] = std::max(speeds[i - 1], speed);
  }
  return speeds;
}

/// Repeatedly removes one of the two most similar views until at most `max_views` remain.
void keep_most_distinct(std::vector<std::size_t>& chosen, const std::vector<StampedMarks>& images,
                        std::size_t max_views) {
  while (chosen.size() > max_views) {
    std::size_t redundant = 0;
    double nearest = kInfinity;
    for (std::size_t i = 1; i < chosen.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const double apart = apart_px(images[chosen[i]].marks, images[chosen[j]].marks);
        if (apart >= nearest) continue;
        nearest = apart;
        redundant = i;
      }
    }
    chosen.erase(chosen.begin() +
                 static_cast<std::ptrdiff_t>(redundant == 0 ? chosen.size() - 1 : redundant));
  }
}

std::size_t points_of(const TargetMarks& marks) {
  std::size_t points = 0;
  for (const TargetMark& mark : marks) points += mark.seen_px.size();
  return points;
}

}  // namespace

std::vector<std::size_t> choose_views(const std::vector<StampedMarks>& images, double diagonal_px,
                                      const VideoViewOptions& options) {
  const std::vector<double> speeds = speeds_px_s(images);
  const std::size_t min_points = 4 * static_cast<std::size_t>(options.fewest_tags);
  std::vector<std::size_t> by_speed;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (points_of(images[i].marks) >= min_points && speeds[i] <= options.fastest_px_s) by_speed.push_back(i);
  }
  std::ranges::stable_sort(by_speed, {}, [&](std::size_t i) { return speeds[i]; });
  std::vector<std::size_t> chosen;
  for (const std::size_t i : by_speed) {
    const bool is_new = std::ranges::all_of(chosen, [&](std::size_t c) {
      return apart_px(images[c].marks, images[i].marks) > options.new_view_share * diagonal_px;
    });
    if (is_new) chosen.push_back(i);
  }
  std::ranges::sort(chosen);
  keep_most_distinct(chosen, images, static_cast<std::size_t>(options.most_views));
  return chosen;
}

// Detecting the target and calibrating.
namespace {

/// An image and the target detected in it.
struct TargetImage {
  ImageReport report{};
  TargetMarks marks{};
};

Image copy_of(const ImageView& image) {
  Image copy(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, copy.row(y));
  return copy;
}

/// The target in all readable images. All images must have the same size.
struct TargetImages {
  std::vector<std::string> names{};
  std::vector<std::vector<TagDetection>> detections{};
  std::vector<TargetMarks> marks{};
  std::vector<double> marker_shares{};  ///< SeenTarget::marker_share for the images in which it is known
  int width_px = 0;
  int height_px = 0;
};

Status add_image(TargetImage image, TargetImages& seen) {
  const ImageReport& report = image.report;
  if (report.error || !report.detected) return {};
  if (seen.names.empty()) {
    seen.width_px = report.width_px;
    seen.height_px = report.height_px;
  }
  if (report.width_px != seen.width_px || report.height_px != seen.height_px)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} x {} pixels, but {} has {} x {}", report.width_px, report.height_px,
                            seen.names.front(), seen.width_px, seen.height_px),
                {.source = report.image}, "Calibrate with images from one camera at one resolution.");
  seen.names.push_back(report.image);
  seen.marks.push_back(std::move(image.marks));
  seen.detections.push_back(std::move(image.report.detections));
  return {};
}

std::vector<std::size_t> views_of_video(const std::vector<TargetImage>& images,
                                        const VideoViewOptions& options) {
  std::vector<StampedMarks> stamped;
  stamped.reserve(images.size());
  for (const TargetImage& image : images)
    stamped.push_back({image.report.stamp.value_or(SensorTime()), image.marks});
  const double diagonal_px =
      images.empty() ? 0 : std::hypot(images.front().report.width_px, images.front().report.height_px);
  return choose_views(stamped, diagonal_px, options);
}

/// Reads the images for a job in order, and selects views from videos.
class ImageReader {
 public:
  ImageReader(const CalibrateCameraJob& job, const CalibrationTarget& target, const JobControl& control)
      : job_(job), target_(target), control_(control) {}

  Result<TargetImages> read(const TagFinder& finder) {
    inputs_ = find_inputs(job_.sources, job_.recursive);
    video_ = inputs_.size();
    const LensChoice unknown{.camera = ImageLens::unknown(), .use_recorded = false};
    const DetectSummary summary =
        detect_all(inputs_, finder, unknown, control_,
                   [&](std::size_t index, ImageReport& report, const ImageView& image) {
                     return take(index, report, image);
                   });
    end_video();
    if (!status_) return tl::unexpected(status_.error());
    if (summary.stopped) return fail(ErrorCode::InvalidArgument, "stopped");
    if (summary.images == 0 && summary.failed > 0)
      return fail(ErrorCode::NotFound, "none of the inputs could be read", {},
                  "Give images, videos or recordings of the board.");
    if (!target_.is_board())
      if (const auto reason = no_tag_reason(summary, finder)) control_.note("note: " + reason->message);
    if (!without_target_.empty() && std::ranges::all_of(seen_.marks, &TargetMarks::empty))
      return fail(ErrorCode::NotFound, "no image shows the target", {.source = without_target_name_},
                  target_.absence_advice(without_target_.view()));
    return std::move(seen_);
  }

 private:
  bool take(std::size_t index, const ImageReport& report, const ImageView& image) {
    if (index != video_) end_video();
    video_ = index;
    TargetImage photo{.report = report};
    if (!target_.is_board())
      photo.marks = target_marks(report.detections, target_.tags());
    else if (report.detected && status_)
      status_ = find_board(image, photo);
    if (photo.marks.empty() && without_target_.empty() && !image.empty()) {
      without_target_ = copy_of(image);
      without_target_name_ = report.image;
    }
    if (report.stamp && kind_of(inputs_[index].path) == FileKind::Video)
      video_images_.push_back(std::move(photo));
    else if (status_)
      status_ = add_image(std::move(photo), seen_);
    return status_.has_value();
  }

  Status find_board(const ImageView& image, TargetImage& photo) {
    if (std::int64_t{image.width} * image.height > kMaxImagePixels)  // OpenCV would take minutes
      return fail(ErrorCode::LimitExceeded,
                  fmt::format("image of {} x {} px is too large", image.width, image.height),
                  {.source = photo.report.image},
                  fmt::format("Crop or scale it to at most {} pixels.", kMaxImagePixels));
    auto marks = target_.find(image, {});
    if (!marks) return tl::unexpected(marks.error());
    photo.marks = std::move(marks->marks);
    if (marks->marker_share) seen_.marker_shares.push_back(*marks->marker_share);
    return {};
  }

  void end_video() {
    const std::vector<std::size_t> chosen = views_of_video(video_images_, job_.views);
    const auto shows = [](const TargetImage& photo) { return !photo.marks.empty(); };
    if (!video_images_.empty() && std::ranges::none_of(video_images_, shows))
      control_.note(fmt::format("{}: none of the {} images shows the board", inputs_[video_].path,
                                video_images_.size()));
    else if (!video_images_.empty())
      control_.note(fmt::format("{}: {} of {} images are new views of the board at rest",
                                inputs_[video_].path, chosen.size(), video_images_.size()));
    for (const std::size_t i : chosen)
      if (status_) status_ = add_image(std::move(video_images_[i]), seen_);
    video_images_.clear();
  }

  const CalibrateCameraJob& job_;
  const CalibrationTarget& target_;
  const JobControl& control_;
  std::vector<Input> inputs_{};
  std::size_t video_ = 0;                    ///< index of the current input
  std::vector<TargetImage> video_images_{};  ///< images read so far from the current input, if it is a video
  Image without_target_{};                   ///< the first image in which the target was not found
  std::string without_target_name_{};
  TargetImages seen_{};
  Status status_{};
};

Result<TargetImages> from_detections(const std::string& path) {
  const auto text = or_wrong_kind(read_text_file(path == "-" ? "/dev/stdin" : path, kMaxTextBytes), path,
                                  FileUse::Detections);
  if (!text) return tl::unexpected(text.error());
  auto reports = or_wrong_kind(parse_reports(*text, path), path, FileUse::Detections);
  if (!reports) return tl::unexpected(reports.error());
  TargetImages seen;
  for (ImageReport& report : *reports)
    if (const Status fits = add_image({.report = std::move(report)}, seen); !fits)
      return tl::unexpected(fits.error());
  return seen;
}

}  // namespace

Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job, const CalibrationTarget& target,
                                               const TagFinder& finder, const JobControl& control) {
  if (const std::string note = untried_lenses_note(job.fit); !note.empty()) control.note(note);
  const TagFinder reader = no_tags();
  Result<TargetImages> seen =
      job.detections.empty() ? ImageReader(job, target, control).read(target.is_board() ? reader : finder)
                             : from_detections(job.detections);
  if (!seen) return tl::unexpected(seen.error());
  if (seen->names.empty())
    return fail(ErrorCode::NotFound, "no image of the board could be read", {},
                "Check the board (`target`, `cols`, `rows`, `dictionary`). In a video, hold it still from "
                "time to time.");
  const auto lens = lens_model(job.fit.lens);  // `nullopt` for "auto"
  CameraCalibrationOptions options = fit_options(job.fit);
  options.goes_on = [&control] { return !control.cancelled(); };
  Result<CameraCalibration> found =
      target.is_board()
          ? calibrate_camera(seen->marks, seen->width_px, seen->height_px, lens, options)
          : calibrate_camera(seen->detections, target.tags(), seen->width_px, seen->height_px, lens, options);
  if (const Status status = control.go_on(); !status) return tl::unexpected(status.error());
  if (!found) return tl::unexpected(found.error());
  if (auto warning = target.marker_size_warning(std::move(seen->marker_shares)))
    found->advice.push_back(*std::move(warning));
  if (!target.is_board())
    for (std::size_t i = 0; i < seen->marks.size(); ++i)
      seen->marks[i] = target_marks(seen->detections[i], target.tags());
  return CalibrateCameraReport{.found = std::move(*found),
                               .images = std::move(seen->names),
                               .marks = std::move(seen->marks),
                               .mark_kind = target.mark_kind()};
}

// Output files and JSON.
namespace {

/// The output format. If none is given, it is chosen by the file extension: .json means PhotonVision, and
/// .yaml, which is used by several formats, means Waymark's own.
std::string format_of(const CameraFitJob& job) {
  if (!job.format.empty()) return job.format;
  return job.output.ends_with(".json") ? "photonvision" : "waymark";
}

CameraObservation observation_of(const CalibrateCameraReport& report, std::size_t image) {
  const CalibratedView& view = report.found.views[image];
  const SE3 cam_T_target = view.target_T_cam.inverse();
  CameraObservation seen{.image = report.images[image], .cam_T_target = cam_T_target};
  for (std::size_t i = 0; i < view.used.size(); ++i) {
    const TargetMark& mark = report.marks[image][i];
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
  for (std::size_t i = 0; i < report.images.size(); ++i)
    if (!report.found.views[i].used.empty()) observations.push_back(observation_of(report, i));
  return to_photonvision_json(camera, observations);
}

Status write_as(const std::string& format, const std::string& path, const NamedCamera& camera,
                const CalibrateCameraReport& report) {
  const auto text = text_as(format, camera, report);
  return text ? write_text_file(path, *text) : Status(tl::unexpected(text.error()));
}

Status write_calibration_yaml(const CameraFitJob& job, const CalibrateCameraReport& report) {
  Calibration calibration = to_calibration(report.found);
  calibration.provenance.insert(calibration.provenance.begin(),
                                {"images", fmt::format("{}", report.images.size())});
  return write_calibration(job.output, calibration);
}

/// Tests with a sample camera whether the output format can represent a lens.
Status check_format_supports(const CameraFitJob& job, LensModel lens) {
  if (job.output.empty() || format_of(job) == "waymark") return {};
  constexpr int kSide_px = 100;
  Eigen::VectorXd parameters = Eigen::VectorXd::Zero(std::ssize(parameter_names(lens)));
  parameters.head<4>().setConstant(kSide_px);
  const auto camera = camera_of(lens, parameters, kSide_px, kSide_px);
  if (!camera) return tl::unexpected(camera.error());
  const auto text =
      text_as(format_of(job), {.name = "cam0", .camera = *camera}, {.found = {.camera = *camera}});
  if (text) return {};
  return fail(ErrorCode::InvalidArgument, text.error().message, {.key = "lens"}, text.error().hint);
}

/// Fails if the extension of the output belongs to another format.
Status check_extension(const CameraFitJob& job) {
  const std::filesystem::path output(job.output);
  if (job.output.empty() || is_device(job.output)) return {};
  const std::string extension = output.extension().string();
  const bool yaml = extension == ".yaml" || extension == ".yml";
  const bool json = extension == ".json" && (job.format.empty() || job.format == "photonvision");
  if (json || (yaml && job.format != "photonvision")) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("invalid file name {} for a calibration{}", job.output,
                          job.format.empty() ? "" : " in format " + job.format),
              {.key = "output"}, "Use the extension .yaml, or .json for PhotonVision.");
}

}  // namespace

void refuse_without_output(const CameraFitJob& fit, FieldRefusals& refused) {
  refused.fields(fit.output.empty(), {"format"}, "this option applies to `output`",
                 "Set `output`, or omit this option.");
  refused.fields(fit.output.empty() && fit.camera_info.empty(), {"force"}, "nothing is written",
                 "Set `output`, or omit this option.");
}

Status check_job(const CalibrateCameraJob& job, const GivenFields& given) {
  FieldRefusals refused(given);
  refused.fields(!job.detections.empty(), {"recursive"}, "with `detections` nothing is detected",
                 "Omit this option, or give images.");
  refused.fields(!job.target.map.empty(), {"spacing", "first_id", "target"},
                 "this option applies to a board, but `map` is set", "Omit this option.");
  refuse_without_output(job.fit, refused);
  refuse_of_other_targets(job.target, refused);
  if (!refused.status() || job.sources.empty() != job.detections.empty()) return refused.status();
  return fail(ErrorCode::InvalidArgument, "give either images or `detections`");
}

Status check_outputs(const CameraFitJob& job) {
  if (const Status fits = check_extension(job); !fits) return fits;
  if (const Status free =
          job.output.empty() || format_of(job) != "waymark" ? Status() : check_calibration_place(job.output);
      !free)
    return free;
  for (const std::string& output : {job.output, job.camera_info}) {
    if (const Status writable = output.empty() ? Status() : check_new_file(output, job.force); !writable)
      return writable;
  }
  const auto lens = lens_model(job.lens);
  return lens ? check_format_supports(job, *lens) : Status();
}

CameraCalibrationOptions fit_options(const CameraFitJob& job) {
  CameraCalibrationOptions options = job.options;
  for (const LensModel lens : lens_models())
    if (check_format_supports(job, lens)) options.lenses.push_back(lens);
  return options;
}

std::string untried_lenses_note(const CameraFitJob& job) {
  std::vector<std::string_view> untried;
  if (lens_model(job.lens)) return {};
  for (const LensModel lens : lens_models())
    if (!check_format_supports(job, lens)) untried.push_back(to_string(lens));
  if (untried.empty()) return {};
  return fmt::format("not tried, because format {} cannot represent it: `lens={}`", format_of(job),
                     fmt::join(untried, ", "));
}

Status write_camera_calibration(const CameraFitJob& job, const CalibrateCameraReport& report) {
  const NamedCamera camera{.name = "cam0", .camera = report.found.camera};
  if (!job.output.empty()) {
    const std::string format = format_of(job);
    if (Status written = format == "waymark" ? write_calibration_yaml(job, report)
                                             : write_as(format, job.output, camera, report);
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

namespace {

struct TriedLens {
  LensTrial trial{};
};

ReportFields fields(const TriedLens& tried) {
  return {{"lens", "Lens model", to_string(tried.trial.lens)},
          {"held_out_rms_px", "Root mean square error in held-out images; null if the fit failed",
           tried.trial.held_out_rms_px}};
}

struct UsedImage {
  std::string image{};
  std::string mark_kind = "tags";
  CalibratedView view{};
};

ReportFields fields(const UsedImage& used) {
  return {
      {"image", "Name of the image", used.image},
      {used.mark_kind, "Number of tags in the fit; for a board with corners, the key is `corners`",
       used.view.marks},
      {"rejected", "Number of tags or corners rejected as outliers", used.view.rejected},
      {"rms_px", "Root mean square reprojection error", used.view.rms_px},
      {"tilt_deg", "Angle between the optical axis and the normal of the target", used.view.tilt_deg},
      {"distance_m", "Distance from the camera to the centre of the visible marks", used.view.distance_m}};
}

struct FittedRegion {
  ImageRegion region{};
};

ReportFields fields(const FittedRegion& part) {
  return {{"corners", "Number of corners in this ninth", part.region.corners},
          {"rms_px", "Root mean square reprojection error of these corners", part.region.rms_px}};
}

}  // namespace

ReportFields fields(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  ReportFields parameters;
  parameters.reserve(found.names.size());
  for (std::size_t i = 0; i < found.names.size(); ++i)
    parameters.push_back({found.names[i], "",
                          ReportFields{{"value", "", found.parameters[static_cast<Eigen::Index>(i)]},
                                       {"sigma", "", sigma_of(found, i)}}});
  std::vector<TriedLens> lenses;
  lenses.reserve(found.trials.size());
  for (const LensTrial& trial : found.trials) lenses.push_back({trial});
  std::vector<UsedImage> images;
  images.reserve(found.views.size());
  for (std::size_t i = 0; i < found.views.size(); ++i)
    images.push_back({report.images[i], report.mark_kind, found.views[i]});
  std::vector<FittedRegion> regions;
  regions.reserve(found.regions.size());
  for (const ImageRegion& region : found.regions) regions.push_back({region});
  return {{"lens", "Lens model: none, radtan4, radtan5, rational8 or equidistant", to_string(found.lens)},
          {"width_px", "Width of the images", found.camera.width_px()},
          {"height_px", "Height of the images", found.camera.height_px()},
          {"rms_px", "Root mean square reprojection error of the corners in the fit", found.rms_px},
          {"held_out_rms_px", "Root mean square reprojection error in images held out of the fit",
           found.held_out_rms_px},
          {"noise_scale", "Residuals relative to the standard deviations of the detected corners",
           found.noise_scale},
          {"parameters", "Value and standard deviation (sigma) by parameter", parameters},
          {"lenses", "One entry per lens model that was tried", lenses},
          {"images", "One entry per image", images},
          {"regions", "One entry per ninth of the image, row by row from the top left", regions},
          {"advice", "Missing images and other advice; empty if none", found.advice}};
}

// Text tables.
namespace {

std::string lenses_text(const CameraCalibration& found) {
  std::string text = "lens         held-out images, RMS px\n";
  for (const LensTrial& trial : found.trials)
    text += fmt::format("{:<12} {}{}\n", to_string(trial.lens),
                        trial.held_out_rms_px ? fmt::format("{:.4f}", *trial.held_out_rms_px) : "no fit",
                        trial.lens == found.lens ? "   <- chosen" : "");
  return text;
}

std::string views_text(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  const std::vector<std::string>& images = report.images;
  std::string text = fmt::format("{:>7}{:>9}{:>10}{:>10}{:>12}  image\n", report.mark_kind, "rejected",
                                 "RMS px", "tilt deg", "distance m");
  for (std::size_t i = 0; i < found.views.size(); ++i) {
    const CalibratedView& view = found.views[i];
    if (view.marks == 0) {
      text += fmt::format("{:>7}{:>9}{:>10}{:>10}{:>12}  {}\n", 0, view.rejected, "-", "-", "-", images[i]);
    } else {
      text += fmt::format("{:>7}{:>9}{:>10.4f}{:>10.1f}{:>12.3f}  {}\n", view.marks, view.rejected,
                          view.rms_px, view.tilt_deg, view.distance_m, images[i]);
    }
  }
  return text;
}

std::string regions_text(const CameraCalibration& found) {
  std::string text = "by part of the image: RMS px (corners)\n";
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < 3; ++column) {
      const ImageRegion& region = found.regions[3 * row + column];
      text += fmt::format(
          "{:>18}", region.corners == 0 ? "-" : fmt::format("{:.4f} ({})", region.rms_px, region.corners));
    }
    text += "\n";
  }
  return text;
}

}  // namespace

std::string to_text(const CalibrateCameraReport& report) {
  const CameraCalibration& found = report.found;
  std::string text;
  for (std::size_t i = 0; i < found.names.size(); ++i)
    text += fmt::format("{:<8}{:>14.6g} +- {:.2g}\n", found.names[i],
                        found.parameters[static_cast<Eigen::Index>(i)], sigma_of(found, i));
  text += fmt::format(
      "reprojection error {:.4f} px RMS, {:.4f} px in held-out images; residuals {:.2f} times the "
      "corner standard deviations\n\n",
      found.rms_px, found.held_out_rms_px, found.noise_scale);
  if (found.trials.size() > 1) text += lenses_text(found) + "\n";
  text += views_text(report) + "\n" + regions_text(found);
  for (const std::string& advice : found.advice) text += "\n" + advice + "\n";
  return text;
}

}  // namespace waymark
