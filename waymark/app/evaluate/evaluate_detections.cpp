#include "waymark/app/evaluate/evaluate_detections.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

/// Detections in all images, and counts.
struct Reports {
  std::vector<ImageReport> reports{};
  DetectSummary summary{};
};

Reports detect(const EvaluateDetectionsJob& job, const TagFinder& finder, const JobControl& control) {
  Reports all;
  const LensChoice lens{.camera = ImageLens::unknown(), .use_recorded = true};
  all.summary = detect_all(find_inputs(job.sources, job.recursive), finder, lens, control,
                           [&](std::size_t, ImageReport& report, const ImageView&) {
                             all.reports.push_back(report);
                             return true;
                           });
  if (const auto reason = no_tag_reason(all.summary, finder)) control.note("note: " + reason->message);
  return all;
}

Result<Reports> read_reports(const EvaluateDetectionsJob& job) {
  const auto text = read_text_file(job.detections == "-" ? "/dev/stdin" : job.detections, kMaxTextBytes);
  auto reports = or_wrong_kind(text ? parse_reports(*text, job.detections) : tl::unexpected(text.error()),
                               job.detections, FileUse::Detections);
  if (!reports) return tl::unexpected(reports.error());
  return Reports{.reports = std::move(*reports)};
}

/// The images to score, each with its ground truth. Notes report which images are skipped, and why.
Result<std::vector<ImageDetections>> join(std::vector<ImageReport> reports, const DetectionTruth& truth,
                                          const JobControl& control) {
  std::vector<ImageDetections> images;
  std::map<std::string, std::string> seen;  // from the name in the ground truth to the path
  std::size_t without_truth = 0;
  for (ImageReport& report : reports) {
    if (report.error) continue;
    const auto name = find_image(truth, report.image);
    if (!name) ++without_truth;
    if (name && !seen.emplace(*name, report.image).second) {
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("'{}' and '{}' both match '{}' in the ground truth", seen[*name], report.image, *name),
          {}, "Add the folder to the image column in the ground truth.");
    }
    images.push_back({std::move(report.detections), name ? truth.at(*name) : std::vector<TrueTag>()});
  }
  if (seen.empty()) {
    return fail(ErrorCode::NotFound, "none of the images is in the ground truth", {},
                truth.empty()
                    ? "The ground truth has no rows."
                    : fmt::format("The ground truth contains, for example, '{}'.", truth.begin()->first));
  }
  if (without_truth > 0) {
    control.note("not in the ground truth and therefore assumed to contain no tag: " +
                 counted(without_truth, "image"));
  }
  if (seen.size() < truth.size()) {
    control.note("in the ground truth but not given: " + counted(truth.size() - seen.size(), "image"));
  }
  return images;
}

}  // namespace

Result<EvaluateDetectionsReport> evaluate_detections(const EvaluateDetectionsJob& job,
                                                     const TagFinder& finder, const JobControl& control) {
  const auto text = read_text_file(job.truth, kMaxTextBytes);
  const auto truth = or_wrong_kind(text ? parse_truth(*text, job.truth) : tl::unexpected(text.error()),
                                   job.truth, FileUse::TrueCorners);
  if (!truth) return tl::unexpected(truth.error());
  Result<Reports> all =
      job.sources.empty() ? read_reports(job) : Result<Reports>(detect(job, finder, control));
  if (!all) return tl::unexpected(all.error());
  EvaluateDetectionsReport report{.failed = all->summary.failed, .stopped = all->summary.stopped};
  if (all->reports.empty() && (report.failed > 0 || report.stopped)) return report;
  const auto failed = static_cast<std::size_t>(
      std::ranges::count_if(all->reports, [](const ImageReport& image) { return image.error.has_value(); }));
  if (failed > 0) control.note("failed and skipped: " + counted(failed, "image"));
  report.failed = std::max(report.failed, failed);
  const auto images = join(std::move(all->reports), *truth, control);
  if (images)
    report.scores = score_detections(*images, job.matching, job.edges);
  else
    report.error = images.error();
  return report;
}

// Conversion to report fields.
ReportFields fields(const CornerScores& corners) {
  return {{"tags", "Number of correct detections with usable corners", corners.tags},
          {"rmse_px", "Root mean square of the Euclidean corner error", corners.rmse_px},
          {"rmse_x_px", "Root mean square corner error along x", corners.rmse_x_px},
          {"rmse_y_px", "Root mean square corner error along y", corners.rmse_y_px},
          {"worst_px", "Largest Euclidean corner error", corners.worst_px},
          {"bias_x_px", "Mean error to the right", corners.bias_x_px},
          {"bias_y_px", "Mean error downwards", corners.bias_y_px},
          {"bias_outward_px", "Mean error away from the centre of the true tag", corners.bias_outward_px}};
}

ReportFields fields(const CornerConsistency& consistency) {
  return {{"tags", "Number of correct detections with a positive definite covariance", consistency.tags},
          {"mean_nes_corner", "Mean normalised error squared per corner; 2 if the covariances are consistent",
           consistency.mean_nes_corner},
          {"mean_nes_tag", "Mean normalised error squared per tag; 8 if the covariances are consistent",
           consistency.mean_nes_tag}};
}

namespace {

ReportFields fields_of_class(const ClassScores& scores, const char* unit) {
  return {{fmt::format("min_{}", unit), "Lower edge of the class, inclusive", scores.low},
          {fmt::format("max_{}", unit), "Upper edge of the class, inclusive for the last class only",
           scores.high},
          {"truth", "Number of true tags", scores.truth},
          {"found", "Number of true tags that were detected correctly", scores.found},
          {"recall", "found / truth; null without true tags", scores.recall()},
          {"corners", "Corner errors, with the keys of all tags; null if none was found", scores.corners}};
}

struct SizeClass {
  ClassScores scores{};
};
ReportFields fields(const SizeClass& of_size) { return fields_of_class(of_size.scores, "px"); }

struct TiltClass {
  ClassScores scores{};
};
ReportFields fields(const TiltClass& of_tilt) { return fields_of_class(of_tilt.scores, "deg"); }

std::vector<TiltClass> tilt_classes(const std::vector<ClassScores>& classes) {
  return {classes.begin(), classes.end()};
}

}  // namespace

ReportFields fields(const DetectionScores& scores) {
  const std::vector<SizeClass> by_size(scores.by_size.begin(), scores.by_size.end());
  std::vector<std::vector<TiltClass>> grid;
  for (const auto& row : scores.by_size_and_tilt) grid.push_back(tilt_classes(row));
  return {
      {"images", "Number of images that were scored", scores.images},
      {"truth", "Number of true tags", scores.truth},
      {"detections", "Number of detections: correct + wrong_ids + false_positives", scores.detections},
      {"correct", "Detections with correct family, id, corner order and position", scores.correct},
      {"recall", "correct / truth; null without true tags", scores.recall()},
      {"unreliable", "Correct detections with unreliable corners, which are not in the corner errors",
       scores.unreliable},
      {"wrong_ids", "Detections with another id or rotation on a true tag that was not detected correctly",
       scores.wrong_ids},
      {"false_positives", "All other detections, including duplicates of a tag", scores.false_positives},
      {"corners", "Corner errors, detected - true; null if no detection is correct", scores.corners},
      {"consistency", "Consistency of the covariances; null without covariances", scores.consistency},
      {"unusable_covariances", "Number of covariances that are not positive definite",
       scores.unusable_covariances},
      {"by_size", "Scores by tag size", by_size},
      {"by_tilt", "Scores by angle between the line of sight and the normal of the tag",
       tilt_classes(scores.by_tilt)},
      {"by_size_and_tilt", "For each class of by_size, a list of scores by tilt", grid}};
}

Status check_effects(const EvaluateDetectionsJob& job, const GivenFields& given) {
  if (Status usable = check_edges(job.edges); !usable) return usable;
  if (job.sources.empty() == job.detections.empty())
    return fail(ErrorCode::InvalidArgument, "give either images or `detections`");
  FieldRefusals refused(given);
  refused.fields(!job.detections.empty(), {"recursive"}, kNothingDetected,
                 "Omit this option, or give images.");
  return refused.status();
}

namespace {

using Text = fmt::memory_buffer;

template <class... Values>
void put(Text& text, fmt::format_string<Values...> format, Values&&... values) {
  fmt::format_to(std::back_inserter(text), format, std::forward<Values>(values)...);
}

std::string percent(std::optional<double> ratio) { return ratio ? fmt::format("{:.1f}", 100 * *ratio) : "-"; }

std::string between(const ClassScores& scores) {
  constexpr double kOpen = 1e5;
  return scores.high > kOpen ? fmt::format(">= {:g}", scores.low)
                             : fmt::format("{:g} - {:g}", scores.low, scores.high);
}

/// Rounds to the printed digits and turns -0 into 0, because the mean of errors that cancel out may have
/// either sign.
double rounded_to_print(double value) { return std::round(value * 1e4) / 1e4 + 0.0; }

void put_corner_columns(Text& text, const std::optional<CornerScores>& corners) {
  if (!corners) return put(text, "{:>9}{:>9}{:>9}{:>9}", "-", "-", "-", "-");
  put(text, "{:>9.4f}{:>+9.4f}{:>+9.4f}{:>+9.4f}", corners->rmse_px, rounded_to_print(corners->bias_x_px),
      rounded_to_print(corners->bias_y_px), rounded_to_print(corners->bias_outward_px));
}

/// One row per class: number of tags, recall, and corner errors.
void put_classes(Text& text, const char* title, const std::vector<ClassScores>& classes) {
  put(text, "\n{:<14}{:>7}{:>9}{:>9}{:>9}{:>9}{:>9}\n", title, "tags", "recall %", "RMSE px", "bias x",
      "bias y", "outward");
  for (const ClassScores& row : classes) {
    if (row.truth == 0) continue;
    put(text, "{:<14}{:>7}{:>9}", between(row), row.truth, percent(row.recall()));
    put_corner_columns(text, row.corners);
    put(text, "\n");
  }
}

/// Recall in percent, with one row per size and one column per tilt.
void put_grid(Text& text, const DetectionScores& scores) {
  if (scores.by_tilt.empty()) return;
  put(text, "\nrecall %, by size (rows) and tilt (columns)\n{:<14}", "size px");
  for (const ClassScores& tilt : scores.by_tilt) {
    if (tilt.truth > 0) put(text, "{:>9}", fmt::format("{:g}-{:g}°", tilt.low, tilt.high));
  }
  put(text, "\n");
  for (std::size_t s = 0; s < scores.by_size.size(); ++s) {
    if (scores.by_size[s].truth == 0) continue;
    put(text, "{:<14}", between(scores.by_size[s]));
    for (std::size_t t = 0; t < scores.by_tilt.size(); ++t) {
      if (scores.by_tilt[t].truth > 0) put(text, "{:>9}", percent(scores.by_size_and_tilt[s][t].recall()));
    }
    put(text, "\n");
  }
}

void put_sums(Text& text, const DetectionScores& scores) {
  put(text,
      "{} images, {} true tags, {} detections: {} correct (recall {} %), {} wrong ids, {} false positives\n",
      scores.images, scores.truth, scores.detections, scores.correct, percent(scores.recall()),
      scores.wrong_ids, scores.false_positives);
  if (scores.unreliable > 0)
    put(text, "unreliable corners: {}, not in the errors below\n", counted(scores.unreliable, "tag"));
  if (const auto& c = scores.corners) {
    put(text, "corner error: RMSE {:.4f} px (x {:.4f}, y {:.4f}), worst {:.3f} px\n", c->rmse_px,
        c->rmse_x_px, c->rmse_y_px, c->worst_px);
    put(text, "corner bias:  x {:+.4f}, y {:+.4f}, outward {:+.4f} px\n", rounded_to_print(c->bias_x_px),
        rounded_to_print(c->bias_y_px), rounded_to_print(c->bias_outward_px));
  }
  if (const auto& n = scores.consistency) {
    put(text,
        "covariance:   mean normalised error squared {:.2f} per corner (consistent: 2), {:.2f} per tag "
        "(consistent: 8), "
        "{} tags\n",
        n->mean_nes_corner, n->mean_nes_tag, n->tags);
  }
  if (scores.unusable_covariances > 0) {
    put(text, "covariance:   {} invalid (not positive definite)\n", scores.unusable_covariances);
  }
}

}  // namespace

std::string to_text(const DetectionScores& scores) {
  Text text;
  put_sums(text, scores);
  put_classes(text, "size px", scores.by_size);
  if (!scores.by_tilt.empty()) put_classes(text, "tilt deg", scores.by_tilt);
  put_grid(text, scores);
  return fmt::to_string(text);
}

}  // namespace waymark
