#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/tag_detection.hpp"
#include "waymark/tags/refinement.hpp"

namespace waymark {

/// What `waymark detect` has to say about one picture.
struct PictureReport {
  std::string image{};                   ///< the path as it was given or found
  std::optional<SensorTime> stamp = {};  ///< of a picture of a recording or a video
  int width_px = 0;                      ///< 0 when the picture could not be read
  int height_px = 0;
  bool detected = false;  ///< the detector ran; without this, `detections` says nothing
  std::vector<TagDetection> detections = {};
  std::vector<RefinementOutcome> refinements = {};  ///< one a detection; empty when nothing was refined
  std::optional<Error> error = {};  ///< something failed for this picture; the rest holds as far as it goes
};

/// The object of one picture; its keys are the contract of `waymark detect --json` (docs/reference/cli.md).
/// Corners are rounded to 1e-6 px.
[[nodiscard]] nlohmann::ordered_json to_json(const PictureReport& report, bool with_covariance);

/// Reads back what `waymark detect --json` wrote, one object a line; unknown keys are ignored, blank lines
/// skipped. The error names the line and the key. Fails also on JSON that
/// is nested deeper than YamlLimits allows.
[[nodiscard]] Result<std::vector<PictureReport>> parse_reports(std::string_view text,
                                                               const std::string& source);

}  // namespace waymark
