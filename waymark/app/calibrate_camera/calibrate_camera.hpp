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

/// `waymark calibrate camera`: the intrinsics of a camera from images of a printed board.
namespace waymark {

/// Selection of views from a video.
struct VideoViewOptions {
  double fastest_px_s = 60;  ///< corners move no faster: their blur and the rolling shutter stay small
  double new_view_share = 0.04;
  int most_views = 60;
  int fewest_tags = 4;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.fastest_px_s,
          Field{"fastest_px_s",
                "Speed of the corners in the image above which a video image is skipped [px/s].", 1, 1e5});
    visit(self.new_view_share, Field{"new_view_share",
                                     "Smallest mean distance of the corners from every earlier view at which "
                                     "a video image is a new view, "
                                     "as a fraction of the image diagonal.",
                                     0, 1});
    visit(self.most_views, Field{"most_views", "Largest number of views taken from a video.", 4, 10000});
    visit(self.fewest_tags,
          Field{"fewest_tags",
                "Smallest number of tags in a view taken from a video; for corners of a board four times "
                "as many.",
                1, 1000});
  }
};

/// The target in one image of a video.
struct StampedMarks {
  SensorTime stamp{};
  TargetPicture marks{};
};

/// The indices of the still and new views, ascending: pictures in which the corners move slowest against
/// their neighbours, each far enough from all taken before; where there are more than `most_views`, those
/// farthest from each other. `diagonal_px` is that of the pictures. O(pictures * views * marks).
[[nodiscard]] std::vector<std::size_t> choose_views(const std::vector<StampedMarks>& pictures,
                                                    double diagonal_px, const VideoViewOptions& options = {});

/// Fit of a camera to its views, and the outputs.
struct CameraFitJob {
  std::string lens = "auto";
  std::string output{};  ///< calibration.yaml; empty: none
  /// Of the output: waymark (calibration.yaml: each number with its standard deviation), ros, kalibr,
  /// photonvision, opencv; empty: by its ending.
  std::string format{};
  std::string camera_info{};  ///< the camera as ROS writes it; empty: none
  bool force = false;         ///< outputs may replace files
  CameraCalibrationOptions options{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.lens,
          JobField(
              "lens NAME",
              "Distortion model: none, radtan4, radtan5, rational8, equidistant, or auto (the simplest that "
              "the output format can represent and whose cross-validation error is as low as the best)")
              .one_of("auto,none,radtan4,radtan5,rational8,equidistant"));
    visit(self.output, JobField("output FILE",
                                "Calibration to write: Waymark's (.yaml, with standard deviations), "
                                "PhotonVision's (.json), or the one set by `format`"));
    visit(self.format, JobField("format NAME",
                                "Format of `output`: waymark, ros (camera_info), kalibr (camchain), "
                                "photonvision (JSON, with all corners) or opencv (YAML of FileStorage)")
                           .one_of("waymark,ros,kalibr,photonvision,opencv"));
    visit(self.camera_info,
          JobField("camera_info FILE", "Calibration file to write in ROS camera_info format").less());
    visit(self.force, JobField("force", "Replace an existing file").less());
  }
};

/// Refuses options without effect if there is no output.
void refuse_without_output(const CameraFitJob& fit, FieldRefusals& refused);

struct CalibrateCameraJob {
  std::vector<std::string> sources{};  ///< pictures of the board …
  bool recursive = false;
  std::string detections{};  ///< … or the JSON of detect, with the corners' covariance; -: standard input
  TargetOptions target{};
  CameraFitJob fit{};
  VideoViewOptions views{};  ///< which pictures of a video count

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

/// Fails unless either images or detections are named, and on options without effect.
[[nodiscard]] Status check_job(const CalibrateCameraJob& job, const GivenFields& given);

struct CalibrateCameraReport {
  /// A camera of one pixel until it is found.
  CameraCalibration found{
      .camera = CameraModel::make(PinholeRadtan{.fx = 1, .fy = 1, .cx = 0.5, .cy = 0.5}, 1, 1).value()};
  std::vector<std::string> pictures{};  ///< that were used, as found.views
  std::vector<TargetPicture> marks{};   ///< of each picture
  std::string marks_word = "tags";      ///< what a mark of the target is: "tags" or "corners"
};

/// Fails if an output cannot be written, or its format cannot represent the lens, before anything is read.
[[nodiscard]] Status check_outputs(const CameraFitJob& job);

/// Fit options: with the lens "auto" only lenses that the output format can represent.
[[nodiscard]] CameraCalibrationOptions fit_options(const CameraFitJob& job);
/// The lenses that "auto" omits because of the format, as text; empty: none.
[[nodiscard]] std::string words_of_untried_lenses(const CameraFitJob& job);

/// Detects the target, its tags with the finder, if images are given, and fits the camera.
[[nodiscard]] Result<CalibrateCameraReport> calibrate_camera(const CalibrateCameraJob& job,
                                                             const CalibrationTarget& target,
                                                             const TagFinder& finder,
                                                             const JobControl& control);
[[nodiscard]] Status write_camera_calibration(const CameraFitJob& job, const CalibrateCameraReport& report);
/// Standard deviation of a parameter.
[[nodiscard]] double sigma_of(const CameraCalibration& found, std::size_t parameter);
[[nodiscard]] ReportFields fields(const CalibrateCameraReport& report);

/// Parameters with their standard deviations, lenses tried, images, parts of the image, advice.
[[nodiscard]] std::string to_text(const CalibrateCameraReport& report);

}  // namespace waymark
