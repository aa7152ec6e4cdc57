#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/mapping/camera/calibration_views.hpp"

/// `waymark calibrate guided`: calibrates a camera while a person holds a board in front of it.
namespace waymark {

struct GuideOptions {
  double focal_share = 0.001;
  int views_at_most = 60;
  CaptureOptions capture{};
  CoverageOptions coverage{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.focal_share, Field{"focal_share",
                                  "Relative standard deviation of the focal length at which a guided "
                                  "calibration ends if no view is missing.",
                                  1e-5, 1});
    visit(self.views_at_most,
          Field{"views_at_most", "Maximum number of views in a guided calibration.", 4, 1000});
    visit(self.capture, Field{"capture", "Selection of images from a live camera."});
    visit(self.coverage, Field{"coverage", "Views required for a guided calibration."});
  }
};

/// State of a guided calibration.
struct GuideStatus {
  GuideOptions wanted{};   ///< the required views and accuracy
  CaptureVerdict image{};  ///< verdict on the last image
  ViewCoverage coverage{};
  std::array<int, 9> in_image{};            ///< number of corners in each ninth of the last image
  std::vector<std::string> missing{};       ///< descriptions of the missing views; empty if there are none
  std::optional<double> held_out_rms_px{};  ///< held-out RMS error with the views so far
  std::optional<double> focal_share{};      ///< relative standard deviation of the focal length
  std::string absence{};  ///< Advice if no image has shown the target for several seconds; otherwise empty.
  bool good_enough = false;
};

/// A text such as "7 views, 0.21 px, focal length +- 0.3 %; hold still; still needed: tilt the board so that
/// its left edge is nearer to the camera".
[[nodiscard]] std::string to_text(const GuideStatus& status);

/// The existing and the required views for each part of the image and each tilt (docs/formats/live.md).
[[nodiscard]] ReportFields fields(const GuideStatus& status);

/// Captures views from camera images until the calibration is accurate enough.
class GuidedCalibration {
 public:
  /// Views are stored as images in `folder`, or not at all if it is empty. All arguments passed by reference
  /// must outlive this object.
  GuidedCalibration(const CameraFitJob& fit, const CalibrationTarget& target, const TagFinder& finder,
                    const GuideOptions& options, std::string folder);

  /// Adds the views stored in the folder by an earlier calibration, and returns their number. Fails if the
  /// images have different sizes.
  [[nodiscard]] Result<std::size_t> resume(const JobControl& control);
  /// Processes the next image, and returns whether it became a view. Fails if its size differs from that of
  /// earlier views, or if it cannot be stored. Each new view requires a fit.
  [[nodiscard]] Result<bool> take(SensorTime stamp, const ImageView& image);
  [[nodiscard]] const GuideStatus& status() const { return status_; }
  /// The marks in the last image.
  [[nodiscard]] const TargetMarks& marks() const { return marks_; }

  /// Calibrates with all views, like calibrate_camera(). Fails if there are too few views.
  [[nodiscard]] Result<CalibrateCameraReport> finish() const;

 private:
  [[nodiscard]] Status add_view(std::string name, TargetMarks marks, int width_px, int height_px);
  [[nodiscard]] Status keep(const ImageView& image, std::string& name) const;
  void judge();
  /// Searches for other boards, once, if no image has shown the target for a while.
  void explain_absence(SensorTime stamp, const ImageView& image);

  const CameraFitJob& fit_;
  const CalibrationTarget& target_;
  const TagFinder& finder_;
  const GuideOptions& options_;
  std::string folder_;
  ViewCapture capture_;
  TargetMarks marks_{};
  std::vector<std::string> names_{};
  std::vector<TargetMarks> views_{};
  std::vector<double> marker_shares_{};
  bool seen_ = false;  ///< whether any image has shown the target
  std::optional<SensorTime> first_{};
  int width_px_ = 0;
  int height_px_ = 0;
  GuideStatus status_{};
};

}  // namespace waymark
