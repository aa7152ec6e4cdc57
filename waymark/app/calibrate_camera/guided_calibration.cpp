#include "waymark/app/calibrate_camera/guided_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/app/common/image_files.hpp"
#include "waymark/codecs/image_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

struct GuidePart {
  std::string name{};
  int corners = 0;
  int corners_wanted = 0;
  int corners_in_image = 0;
};

ReportFields fields(const GuidePart& part) {
  return {{"part", "Name of the part, such as top left", part.name},
          {"corners", "Number of corners in this part in all views", part.corners},
          {"corners_wanted", "Number of corners required in this part", part.corners_wanted},
          {"corners_in_image", "Number of corners in this part of the last image", part.corners_in_image}};
}

struct GuideTilt {
  std::string nearer_edge{};
  int views = 0;
  int views_wanted = 0;
};

ReportFields fields(const GuideTilt& tilt) {
  return {{"nearer_edge", "Edge of the board that is nearer to the camera", tilt.nearer_edge},
          {"views", "Number of views with this tilt", tilt.views},
          {"views_wanted", "Number of views required with this tilt", tilt.views_wanted}};
}

}  // namespace

std::string to_text(const GuideStatus& status) {
  std::string text = fmt::format("{} views", status.coverage.views);
  if (status.held_out_rms_px) text += fmt::format(", {:.2f} px", *status.held_out_rms_px);
  if (status.focal_share) text += fmt::format(", focal length +- {:.2g} %", 100 * *status.focal_share);
  text += fmt::format("; {}", to_string(status.image));
  if (status.good_enough) return text + "; good enough";
  if (!status.absence.empty()) return text + "; " + status.absence;
  constexpr std::size_t kMaxListed = 2;
  const std::size_t listed = std::min(kMaxListed, status.missing.size());
  return listed == 0
             ? text
             : text +
                   fmt::format("; still needed: {}",
                               fmt::join(status.missing.begin(),
                                         status.missing.begin() + static_cast<std::ptrdiff_t>(listed), "; "));
}

ReportFields fields(const GuideStatus& status) {
  const CoverageOptions& wanted = status.wanted.coverage;
  std::vector<GuidePart> parts;
  for (std::size_t i = 0; i < status.coverage.corners.size(); ++i)
    parts.push_back({image_part_names().at(i), status.coverage.corners.at(i), wanted.corners_each_part,
                     status.in_image.at(i)});
  std::vector<GuideTilt> tilts;
  for (const auto& [tilt, edge] : tilts_with_edges())
    tilts.push_back({edge, status.coverage.tilts.at(static_cast<std::size_t>(tilt)), wanted.views_each_tilt});
  return {
      {"image", "Result for the last image", to_string(status.image)},
      {"views", "Number of views so far", status.coverage.views},
      {"views_wanted", "Number of views required", wanted.views},
      {"held_out_rms_px", "Root mean square error in held-out views, from the fourth view on",
       if_any(status.held_out_rms_px)},
      {"focal_sigma_share", "Relative standard deviation of the focal length, from the fourth view on",
       if_any(status.focal_share)},
      {"focal_sigma_share_wanted", "Relative standard deviation at which the calibration is accurate enough",
       status.wanted.focal_share},
      {"parts", "One entry per ninth of the image, row by row from the top left", parts},
      {"tilts", "One entry per direction of tilt", tilts},
      {"missing", "Missing views, most important first", status.missing},
      {"good_enough", "Whether no view is missing, or the maximum number of views has been reached",
       status.good_enough}};
}

GuidedCalibration::GuidedCalibration(const CameraFitJob& fit, const CalibrationTarget& target,
                                     const TagFinder& finder, const GuideOptions& options, std::string folder)
    : fit_(fit),
      target_(target),
      finder_(finder),
      options_(options),
      folder_(std::move(folder)),
      capture_(options.capture) {
  status_.wanted = options_;
  status_.missing = missing_views(status_.coverage, options_.coverage);
}

Result<std::size_t> GuidedCalibration::resume(const JobControl& control) {
  std::error_code ignored;
  if (folder_.empty() || !fs::exists(folder_, ignored)) return std::size_t{0};
  for (const Input& input : find_inputs({folder_}, false)) {
    if (control.cancelled()) break;
    const auto image = input.error ? Result<Image>(tl::unexpected(*input.error)) : read_image(input.path);
    if (!image) {
      control.note(to_string(image.error()));
      continue;
    }
    auto seen = target_.find(*image, finder_);
    if (!seen) return tl::unexpected(seen.error());
    if (seen->marks.empty()) continue;
    capture_.add(seen->marks);
    if (seen->marker_share) marker_shares_.push_back(*seen->marker_share);
    if (Status added = add_view(input.path, std::move(seen->marks), image->width(), image->height()); !added)
      return tl::unexpected(added.error());
  }
  judge();
  return views_.size();
}

Result<bool> GuidedCalibration::take(SensorTime stamp, const ImageView& image) {
  auto found = target_.find(image, finder_);
  if (!found) return tl::unexpected(found.error());
  marks_ = std::move(found->marks);
  status_.in_image = corners_by_part(marks_, image.width, image.height);
  explain_absence(stamp, image);
  status_.image = capture_.take(stamp, image, marks_);
  if (status_.image != CaptureVerdict::New) return false;
  if (found->marker_share) marker_shares_.push_back(*found->marker_share);
  std::string name = fmt::format("view {}", views_.size() + 1);
  if (Status kept = keep(image, name); !kept) return tl::unexpected(kept.error());
  if (Status added = add_view(std::move(name), marks_, image.width, image.height); !added)
    return tl::unexpected(added.error());
  judge();
  return true;
}

void GuidedCalibration::explain_absence(SensorTime stamp, const ImageView& image) {
  constexpr Duration kPatience = std::chrono::seconds(3);
  seen_ = seen_ || !marks_.empty() || !views_.empty();
  if (seen_) {
    status_.absence.clear();
    return;
  }
  if (!first_) first_ = stamp;
  if (status_.absence.empty() && stamp - *first_ >= kPatience)
    status_.absence = target_.absence_advice(image);
}

Status GuidedCalibration::keep(const ImageView& image, std::string& name) const {
  if (folder_.empty()) return {};
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error)
    return fail(ErrorCode::Unwritable, "cannot create the folder for the views", {.source = folder_},
                error.message());
  for (std::size_t number = views_.size() + 1;; ++number) {
    name = (fs::path(folder_) / fmt::format("view-{:03}.png", number)).string();
    if (!fs::exists(name, error)) break;
  }
  return write_image(name, image);
}

Status GuidedCalibration::add_view(std::string name, TargetMarks marks, int width_px, int height_px) {
  if (views_.empty()) {
    width_px_ = width_px;
    height_px_ = height_px;
  }
  if (width_px != width_px_ || height_px != height_px_)
    return fail(ErrorCode::InvalidArgument,
                fmt::format("{} x {} pixels, but {} has {} x {}", width_px, height_px, names_.front(),
                            width_px_, height_px_),
                {.source = name}, "All views must have the same resolution. Use a different folder.");
  names_.push_back(std::move(name));
  views_.push_back(std::move(marks));
  return {};
}

void GuidedCalibration::judge() {
  constexpr std::size_t kMinViews = 4;
  status_.coverage = {};
  status_.held_out_rms_px.reset();
  status_.focal_share.reset();
  const auto lens = lens_model(fit_.lens).value_or(LensModel::Radtan4);
  const auto found = views_.size() < kMinViews
                         ? Result<CameraCalibration>(fail(ErrorCode::InvalidArgument, "too few views"))
                         : calibrate_camera(views_, width_px_, height_px_, lens, fit_.options);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    // The tilt of the board is unknown before the first fit.
    const SE3 target_T_cam = found ? found->views[i].target_T_cam : SE3();
    waymark::add_view(status_.coverage, views_[i], target_T_cam, width_px_, height_px_);
  }
  status_.missing = missing_views(status_.coverage, options_.coverage);
  if (found) {
    status_.held_out_rms_px = found->held_out_rms_px;
    status_.focal_share = std::sqrt(std::max(0.0, found->covariance(0, 0))) / found->parameters[0];
  }
  status_.good_enough =
      (status_.missing.empty() && status_.focal_share.value_or(1) <= options_.focal_share) ||
      std::ssize(views_) >= options_.views_at_most;
}

Result<CalibrateCameraReport> GuidedCalibration::finish() const {
  if (views_.empty())
    return fail(ErrorCode::NotFound, "no view was taken", {},
                status_.absence.empty() ? "Hold the board still and in focus." : status_.absence);
  auto found = calibrate_camera(views_, width_px_, height_px_, lens_model(fit_.lens), fit_options(fit_));
  if (!found) return tl::unexpected(found.error());
  if (auto warning = target_.marker_size_warning(marker_shares_))
    found->advice.push_back(*std::move(warning));
  return CalibrateCameraReport{
      .found = *std::move(found), .images = names_, .marks = views_, .mark_kind = target_.mark_kind()};
}

}  // namespace waymark
