#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/detect_all.hpp"
#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/evaluation/detections.hpp"

/// `waymark evaluate detections`: compares detected tags with their true corners.
namespace waymark {

struct EvaluateDetectionsJob {
  std::string truth{};                 ///< CSV file with the true corners
  std::vector<std::string> sources{};  ///< images in which to detect tags
  bool recursive = false;
  std::string detections{};  ///< JSON output of `waymark detect` to use instead; "-" for standard input
  ClassEdges edges{};
  MatchOptions matching{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.sources, JobField("sources SOURCE", "Images: files, folders, or quoted patterns").input());
    visit(self.truth, JobField("truth FILE",
                               "CSV with the columns image, id, x0, y0, x1, y1, x2, y2, x3, y3 and, if "
                               "known, size_px, tilt_deg, family")
                          .required());
    visit(self.detections, JobField("detections FILE",
                                    "Score this output of `waymark detect json=true` instead of running the "
                                    "detector; - is standard input"));
    visit(self.recursive, JobField("recursive", "Search folders for images recursively"));
  }
};

/// Fails unless either images or detections are given. Also fails on invalid class edges, and on options that
/// have no effect.
[[nodiscard]] Status check_effects(const EvaluateDetectionsJob& job, const GivenFields& given);
inline constexpr const char* kNothingDetected = "the detector does not run if `detections` is given";

struct EvaluateDetectionsReport {
  std::optional<DetectionScores> scores{};  ///< empty if `error` is set
  std::optional<Error> error{};
  std::size_t failed = 0;  ///< number of images that were skipped or failed
  bool stopped = false;    ///< whether it was cancelled; if so, only the images up to that point are scored
};

/// Fails if the ground truth or the detections cannot be read. Skipped images are reported in notes. `finder`
/// is used if images are given.
[[nodiscard]] Result<EvaluateDetectionsReport> evaluate_detections(const EvaluateDetectionsJob& job,
                                                                   const TagFinder& finder,
                                                                   const JobControl& control);

[[nodiscard]] ReportFields fields(const DetectionScores& scores);
[[nodiscard]] ReportFields fields(const CornerScores& corners);
[[nodiscard]] ReportFields fields(const CornerConsistency& consistency);

/// Text tables: the totals, then recall, corner error and bias by size and by tilt, and finally recall by
/// both.
[[nodiscard]] std::string to_text(const DetectionScores& scores);

}  // namespace waymark
