#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/app/common/camera_description.hpp"
#include "waymark/app/common/image_files.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/camera/image_lens.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/no_tags.hpp"
#include "waymark/tags/refinement/corner_refinement.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// The source of the lens model with which the tags in an image were detected.
enum class LensSource : std::uint8_t {
  Unknown,    ///< no model: corners are biased if the lens distorts
  Camera,     ///< the caller's camera
  Recording,  ///< the calibration in the recording of the image
};
/// "unknown", "camera" or "recording".
[[nodiscard]] std::string_view to_string(LensSource source);

/// Report of `waymark detect` for one image.
struct ImageReport {
  std::string image{};                   ///< the path as specified or found
  std::optional<SensorTime> stamp = {};  ///< timestamp of an image from a recording or a video
  int width_px = 0;                      ///< 0 if the image could not be read
  int height_px = 0;
  LensSource lens = LensSource::Unknown;
  bool detected = false;  ///< whether the detector ran; if not, `detections` is meaningless
  std::vector<TagDetection> detections = {};
  std::vector<RefinementOutcome> refinements = {};  ///< one per detection; empty if nothing was refined
  std::size_t beyond_lens = 0;                      ///< number of tags dropped: see FoundTags::beyond_lens
  /// Only in the last report of a run: why no image contains a tag.
  std::optional<NoTagReason> no_tag_reason = {};
  std::optional<Error> error = {};  ///< failure for this image; other members that are set remain valid
};

/// One line of the JSON output of detect, which parse_reports() reads.
struct ImageLine {
  ImageReport report{};
  PoseList poses{};                ///< one per detection, or empty
  bool with_covariance = false;    ///< whether corner_covariance_px2 is included
  std::optional<double> age_ms{};  ///< age of an image from a live camera
};
/// Keys may be added, but existing keys never change their meaning. Corners are rounded to 1e-6 px.
[[nodiscard]] ReportFields fields(const ImageLine& line);

/// Parses the JSON output of `waymark detect`, one object per line. Unknown keys are ignored and blank lines
/// are skipped. Errors name the line and the key. Fails also if the JSON is nested deeper than YamlLimits
/// allows.
[[nodiscard]] Result<std::vector<ImageReport>> parse_reports(std::string_view text,
                                                             const std::string& source);

/// Summary of a run over a list of inputs.
struct DetectSummary {
  std::size_t images = 0;  ///< number of images processed without an error
  std::size_t tags = 0;
  std::size_t failed = 0;
  std::size_t beyond_lens = 0;      ///< number of tags dropped: see FoundTags::beyond_lens
  std::size_t without_lens = 0;     ///< number of these tags refined without a lens model
  std::size_t unreliable = 0;       ///< number of these tags with unreliable corners
  bool stopped = false;             ///< cancelled before the end of the list
  bool annotations_failed = false;  ///< a folder for annotated images could not be created
  std::set<std::string> noted{};    ///< errors already printed as notes, so that each is printed only once
  NoTagDiagnosis no_tags{};         ///< for no_tag_reason()
};

/// Called with each report, in the order of the inputs; `image` is empty if it could not be read, and is
/// valid only during the call. May add an error to the report, which then counts as failed. Returns whether
/// to continue.
using EachImage = std::function<bool(std::size_t index, ImageReport& report, const ImageView& image)>;

/// The lens models that detect_all() may use.
struct LensChoice {
  ImageLens camera;   ///< used for images of its size
  bool use_recorded;  ///< whether recordings are detected with their own calibration if `camera` is unknown
};

/// Detects the tags in each input, including all images in a recording or a video. After an error, a note is
/// printed and the next input is processed. The job can be cancelled between two images. Images
/// from a recording or a video are named FILE#SECONDS after their timestamps.
[[nodiscard]] DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder,
                                       const LensChoice& lens, const JobControl& control,
                                       const EachImage& each);

/// Why no image of a run contains a tag. `nullopt` if a tag was found, the run was stopped, or the cause is
/// unknown. May take about a second.
[[nodiscard]] std::optional<NoTagReason> no_tag_reason(const DetectSummary& summary, const TagFinder& finder);

/// A note that this many tags were dropped: see FoundTags::beyond_lens.
[[nodiscard]] std::string beyond_lens_note(std::size_t tags);

/// A note that this many tags were refined without a lens model.
[[nodiscard]] std::string without_lens_note(std::size_t tags);

/// A note that the corners of this many tags are unreliable: see CornerState.
[[nodiscard]] std::string unreliable_note(std::size_t tags);

namespace internal {

/// Returns a name such as "lap.mcap#12.345000000".
[[nodiscard]] std::string name_of_image(const std::string& path, SensorTime stamp);

}  // namespace internal

/// Creates a finder for tags of these families (those in the options if empty), with or without corner
/// refinement.
[[nodiscard]] Result<TagFinder> described_finder(DetectorOptions options, const RefinementOptions& refinement,
                                                 const std::vector<std::string>& families, bool refined);

}  // namespace waymark
