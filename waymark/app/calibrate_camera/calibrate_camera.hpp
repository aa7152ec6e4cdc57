#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/app/calibrate_camera/calibration_target.hpp"
#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/mapping/camera/camera_calibration.hpp"
#include "waymark/mapping/camera/target_mark.hpp"

/// `waymark calibrate camera`: estimates a camera's intrinsics from images of a printed board.
namespace waymark {

/// Selection of views from a video.
struct VideoViewOptions {
  double fastest_px_s = 60;  ///< limits motion blur and rolling-shutter distortion
  double new_view_share = 0.04;
  int most_views = 60;
  int fewest_tags = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.fastest_px_s,
          Field{"fastest_px_s",
                "Speed of the corners in the image above which a video image is skipped [px/s].", 1, 1e5});
    visit(self.new_view_share,
          Field{"new_view_share",
                "A video image is a new view if its corners are at least this far, on average, from those in "
                "every earlier view; as a fraction of the image diagonal.",
                0, 1});
    visit(self.most_views, Field{"most_views", "Maximum number of views from a video.", 4, 10000});
    visit(self.fewest_tags,
          Field{"fewest_tags",
                "Minimum number of tags in a view from a video; for boards with corners, four times as many "
                "corners.",
                1, 1000});
  }
};

/// The target in one image from a video.
struct StampedMarks {
  SensorTime stamp{};
  TargetMarks marks{};
};

/// Ascending indices of the selected views. Images are considered in order of increasing corner speed, and
/// selected if they differ enough from all those already selected. If more than `most_views` are selected,
/// the most similar ones are removed. `diagonal_px` is the image diagonal. O(images * views * marks).
[[nodiscard]] std::vector<std::size_t> choose_views(const std::vector<StampedMarks>& images,
                                                    double diagonal_px, const VideoViewOptions& options = {});

/// Options for the camera fit and for its outputs.
struct CameraFitJob {
  std::string lens = "auto";
  std::string output{};  ///< path of the calibration; if empty, none is written
  /// Format of `output`: waymark (calibration.yaml, with standard deviations), ros, kalibr, photonvision or
  /// opencv. If empty, it is chosen by the file extension.
  std::string format{};
  std::string camera_info{};  ///< path of an output in ROS camera_info format; if empty, none is written
  bool force = false;         ///< whether outputs may replace existing files
  CameraCalibrationOptions options{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lens,
          JobField(
              "lens NAME",
              "Distortion model: none, radtan4, radtan5, rational8, equidistant, or auto (the simplest model "
              "with the lowest cross-validation error, among those that the output format can represent)")
              .one_of("auto,none,radtan4,radtan5,rational8,equidistant"));
    visit(self.output, JobField("output FILE",
                                "Calibration to write: Waymark (.yaml, with standard deviations), "
                                "PhotonVision (.json), or as set by `format`"));
    visit(self.format, JobField("format NAME",
                                "Format of `output`: waymark, ros (camera_info), kalibr (camchain), "
                                "photonvision (JSON, with all corners) or opencv (YAML of FileStorage)")
                           .one_of("waymark,ros,kalibr,photonvision,opencv"));
    visit(self.camera_info,
          JobField("camera_info FILE", "Calibration to write in ROS camera_info format").less());
    visit(self.force, JobField("force", "Replace an existing file").less());
  }
};

/// Rejects options that have no effect because there is no output.
void refuse_without_output(const CameraFitJob& fit, FieldRefusals& refused);

struct CalibrateCameraJob {
  std::vector<std::string> sources{};  ///< images of the board; not used with `detections`
  bool recursive = false;
  /// JSON output of `waymark detect` with corner covariances; "-" for standard input.
  std::string detections{};
  TargetOptions target{};
  CameraFitJob fit{};
  VideoViewOptions views{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.sources, JobField("sources SOURCE",
                                 "Images of the board: files, folders, quoted patterns, recordings, videos")
                            .input());
    visit(self.detections,
          JobField("detections FILE",
                   "Use this output of `waymark detect json=true covariance=true` instead of "
                   "images; - is standard input")
              .less());
    visit(self.recursive, JobField("recursive", "Search folders for images recursively").less());
    TargetOptions::fields(self.target, visit);
    CameraFitJob::fields(self.fit, visit);
  }
};

/// Fails unless either images or detections are given. Also fails on options that have no effect.
[[nodiscard]] Status check_job(const CalibrateCameraJob& job, const GivenFields& given);

struct CalibrateCameraReport {
  /// Initially a placeholder camera with one pixel.
  CameraCalibration found{
      .camera = CameraModel::make(PinholeRadtan{.fx = 1, .fy = 1, .cx = 0.5, .cy = 0.5}, 1, 1).value()};
  std::vector<std::string> images{};  ///< image names, in the order of found.views
  std::vector<TargetMarks> marks{};   ///< one entry per image
  std::string mark_kind = "tags";     ///< kind of marks: "tags" or "corners"
};

/// Fails if an output cannot be written, or if its format cannot represent the lens. Call this before images
/// are read.
[[nodiscard]] Status check_outputs(const CameraFitJob& job);

/// Options for the fit. `lenses` contains those that the output format can represent.
[[nodiscard]] CameraCalibrationOptions fit_options(const CameraFitJob& job);
/// A note about lenses that "auto" does not try because of the output format. Empty if there are none.
[[nodiscard]] std::string untried_lenses_note(const CameraFitJob& job);

/// Detects the target in the images (using `finder` for tags) or reads the detections, and fits the camera.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job,
                                                             const CalibrationTarget& target,
                                                             const TagFinder& finder,
                                                             const JobControl& control);
[[nodiscard]] Status write_camera_calibration(const CameraFitJob& job, const CalibrateCameraReport& report);
/// Standard deviation of a parameter.
[[nodiscard]] double sigma_of(const CameraCalibration& found, std::size_t parameter);
[[nodiscard]] ReportFields fields(const CalibrateCameraReport& report);

/// Tables with the parameters and their standard deviations, the lenses tried, the images, and the parts of
/// the image, followed by advice.
[[nodiscard]] std::string to_text(const CalibrateCameraReport& report);

}  // namespace waymark
