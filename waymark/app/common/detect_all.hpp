#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/picture_files.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/camera_model.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// Report of `waymark detect` on one image.
struct PictureReport {
  std::string image{};                   ///< the path as given or found
  std::optional<SensorTime> stamp = {};  ///< of an image of a recording or a video
  int width_px = 0;                      ///< 0 if the image could not be read
  int height_px = 0;
  bool detected = false;  ///< the detector ran; if false, `detections` is meaningless
  std::vector<TagDetection> detections = {};
  std::vector<RefinementOutcome> refinements = {};  ///< one per detection; empty if nothing was refined
  std::optional<Error> error = {};  ///< failure for this image; other members are valid if set
};

/// One line of the JSON output of detect, which parse_reports() reads.
struct PictureLine {
  PictureReport report{};
  PoseList poses{};                ///< one per detection, or empty
  bool with_covariance = false;    ///< corner_covariance_px2 as well
  std::optional<double> age_ms{};  ///< of a live camera
};
/// Keys may be added, but keep their meaning. Corners are rounded to 1e-6 px.
[[nodiscard]] ReportFields fields(const PictureLine& line);

/// Parses the JSON output of `waymark detect`, one object per line; unknown keys are ignored, blank lines
/// skipped. The error names the line and the key. Fails also on JSON that
/// is nested deeper than YamlLimits allows.
[[nodiscard]] Result<std::vector<PictureReport>> parse_reports(std::string_view text,
                                                               const std::string& source);

/// Result for a list of inputs.
struct DetectSummary {
  std::size_t pictures = 0;  ///< processed without an error
  std::size_t tags = 0;
  std::size_t failed = 0;
  bool stopped = false;             ///< cancelled before the end of the list
  bool annotations_failed = false;  ///< their folder could not be created
  std::set<std::string> noted{};    ///< errors already reported as notes; each is reported once
};

/// Called with each report, in the order of the inputs; `image` is empty if it could not be read.
/// May add an error to the report, which then counts as failed. Returns whether to continue. The image is
/// valid only during the call.
using EachPicture = std::function<bool(std::size_t index, PictureReport& report, const ImageView& image)>;

/// Reads each input, including all images of a recording or a video, and detects their tags. Corners are
/// refined with the lens of `camera` in images of its size; null if the lens is unknown. Errors become notes
/// and the next input is processed; cancelling stops between two images. Images of a recording or a video are
/// named FILE#SECONDS by their stamp.
[[nodiscard]] DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder,
                                       const CameraModel* camera, const JobControl& control,
                                       const EachPicture& each);

namespace internal {

/// "lap.mcap#12.345000000".
[[nodiscard]] std::string name_of_picture(const std::string& path, SensorTime stamp);

}  // namespace internal

/// Creates a finder for tags of these families (empty: those of the options), with or without corner
/// refinement.
[[nodiscard]] Result<TagFinder> described_finder(DetectorOptions options, const RefinementOptions& refinement,
                                                 const std::vector<std::string>& families, bool refined);

}  // namespace waymark
