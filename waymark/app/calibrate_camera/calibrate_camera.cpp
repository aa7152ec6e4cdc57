#include "waymark/app/calibrate_camera/calibrate_camera.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "waymark/config/text_file.hpp"
#include "waymark/media/video_format.hpp"

namespace waymark {
namespace {

/// A picture and what it shows of the target.
struct SeenPicture {
  PictureReport report{};
  TargetPicture marks{};
};

Image copy_of(const ImageView& image) {
  Image copy(image.width, image.height);
  for (int y = 0; y < image.height; ++y) std::copy_n(image.row(y), image.width, copy.row(y));
  return copy;
}

/// The pictures that could be looked at, all of one size.
struct SeenPictures {
  std::vector<std::string> names{};
  std::vector<std::vector<TagDetection>> detections{};
  std::vector<TargetPicture> marks{};
  std::vector<double> marker_shares{};  ///< SeenTarget::marker_share, where it is known
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
    const DetectSummary summary =
        detect_all(inputs_, finder, nullptr, control_,
                   [&](std::size_t index, PictureReport& report, const ImageView& image) {
                     return take(index, report, image);
                   });
    end_video();
    if (!fits_) return tl::unexpected(fits_.error());
    if (summary.stopped) return fail(ErrorCode::InvalidArgument, "stopped");
    if (!without_.empty() && std::ranges::all_of(seen_.marks, &TargetPicture::empty))
      return fail(ErrorCode::NotFound, "no picture shows the target", {.source = without_name_},
                  target_.words_of_absence(without_.view()));
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
    if (picture.marks.empty() && without_.empty() && !image.empty()) {
      without_ = copy_of(image);
      without_name_ = report.image;
    }
    if (report.stamp && looks_like_video(inputs_[index].path))
      filmed_.push_back(std::move(picture));
    else if (fits_)
      fits_ = add_picture(std::move(picture), seen_);
    return fits_.has_value();
  }

  Status find_board(const ImageView& image, SeenPicture& picture) {
    auto marks = target_.find(image, {});
    if (!marks) return tl::unexpected(marks.error());
    picture.marks = std::move(marks->marks);
    if (marks->marker_share) seen_.marker_shares.push_back(*marks->marker_share);
    return {};
  }

  void end_video() {
    const std::vector<std::size_t> chosen = views_of_video(filmed_, job_.views);
    const auto shows = [](const SeenPicture& picture) { return !picture.marks.empty(); };
    if (!filmed_.empty() && std::ranges::none_of(filmed_, shows))
      control_.note(
          fmt::format("{}: the board is in none of its {} pictures", inputs_[video_].path, filmed_.size()));
    else if (!filmed_.empty())
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
  Image without_{};                    ///< the first picture that does not show the target
  std::string without_name_{};
  SeenPictures seen_{};
  Status fits_{};
};

Result<SeenPictures> from_detections(const std::string& path) {
  const auto text = read_text_file(path == "-" ? "/dev/stdin" : path, kMostTextBytes);
  if (!text) return tl::unexpected(text.error());
  auto reports = parse_reports(*text, path);
  if (!reports) return tl::unexpected(reports.error());
  SeenPictures seen;
  for (PictureReport& report : *reports)
    if (const Status fits = add_picture({.report = std::move(report)}, seen); !fits)
      return tl::unexpected(fits.error());
  return seen;
}

}  // namespace

Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job, const CalibrationTarget& target,
                                               const TagFinder& finder, const JobControl& control) {
  if (const std::string words = words_of_untried_lenses(job); !words.empty()) control.note(words);
  const TagFinder reader = no_tags();
  Result<SeenPictures> seen =
      job.detections.empty() ? PictureChoice(job, target, control).read(target.is_board() ? reader : finder)
                             : from_detections(job.detections);
  if (!seen) return tl::unexpected(seen.error());
  if (seen->names.empty())
    return fail(
        ErrorCode::NotFound, "no picture shows the board, or none could be read", {},
        "Check what the board is (--target, --cols, --rows, --dictionary), and that it stands still now "
        "and then.");
  const auto lens = lens_model(job.lens);  // nothing: auto
  const CameraCalibrationOptions options = fit_options(job);
  Result<CameraCalibration> found =
      target.is_board()
          ? calibrate_camera(seen->marks, seen->width_px, seen->height_px, lens, options)
          : calibrate_camera(seen->detections, target.tags(), seen->width_px, seen->height_px, lens, options);
  if (!found) return tl::unexpected(found.error());
  if (auto words = target.words_of_marker_size(std::move(seen->marker_shares)))
    found->advice.push_back(*std::move(words));
  if (!target.is_board())
    for (std::size_t i = 0; i < seen->marks.size(); ++i)
      seen->marks[i] = target_marks(seen->detections[i], target.tags());
  return CalibrateCameraReport{.found = std::move(*found),
                               .pictures = std::move(seen->names),
                               .marks = std::move(seen->marks),
                               .marks_word = target.marks_word()};
}

}  // namespace waymark
