#include "waymark/app/evaluate/evaluate_detections.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/base/message_text.hpp"
#include "waymark/config/text_file.hpp"

namespace waymark {
namespace {

/// What was detected.
struct Reports {
  std::vector<PictureReport> reports{};
  DetectSummary summary{};
};

Reports detect(const EvaluateDetectionsJob& job, const TagFinder& finder, const JobControl& control) {
  Reports all;
  all.summary = detect_all(find_inputs(job.sources, job.recursive), finder, nullptr, control,
                           [&](std::size_t, PictureReport& report, const ImageView&) {
                             all.reports.push_back(report);
                             return true;
                           });
  return all;
}

Result<Reports> read_reports(const EvaluateDetectionsJob& job) {
  const auto text = read_text_file(job.detections == "-" ? "/dev/stdin" : job.detections, kMostTextBytes);
  auto reports = text ? parse_reports(*text, job.detections) : tl::unexpected(text.error());
  if (!reports) return tl::unexpected(reports.error());
  return Reports{.reports = std::move(*reports)};
}

/// The pictures to score, each with its truth. Says what is left out and why.
Result<std::vector<ImageDetections>> join(std::vector<PictureReport> reports, const DetectionTruth& truth,
                                          const JobControl& control) {
  std::vector<ImageDetections> images;
  std::map<std::string, std::string> seen;  // name in the truth, path
  std::size_t without_truth = 0;
  for (PictureReport& report : reports) {
    if (report.error) continue;
    const auto name = find_image(truth, report.image);
    if (!name) ++without_truth;
    if (name && !seen.emplace(*name, report.image).second) {
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("'{}' and '{}' are both '{}' of the truth", seen[*name], report.image, *name),
                  {}, "Name the folder in the truth's image column too.");
    }
    images.push_back({std::move(report.detections), name ? truth.at(*name) : std::vector<TrueTag>()});
  }
  if (seen.empty()) {
    return fail(ErrorCode::NotFound, "none of the pictures is in the truth", {},
                truth.empty() ? "The truth has no rows."
                              : fmt::format("The truth names '{}', for example.", truth.begin()->first));
  }
  if (without_truth > 0) {
    control.note("not in the truth, taken as holding no tag: " + counted(without_truth, "picture"));
  }
  if (seen.size() < truth.size()) {
    control.note("of the truth, but not given: " + counted(truth.size() - seen.size(), "picture"));
  }
  return images;
}

nlohmann::ordered_json number(std::optional<double> value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

nlohmann::ordered_json to_json(const std::optional<CornerScores>& corners) {
  if (!corners) return {};
  return {{"tags", corners->tags},           {"rmse_px", corners->rmse_px},
          {"rmse_x_px", corners->rmse_x_px}, {"rmse_y_px", corners->rmse_y_px},
          {"worst_px", corners->worst_px},   {"bias_x_px", corners->bias_x_px},
          {"bias_y_px", corners->bias_y_px}, {"bias_outward_px", corners->bias_outward_px}};
}

nlohmann::ordered_json to_json(const std::vector<ClassScores>& classes, const char* unit) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ClassScores& row : classes) {
    list.push_back({{std::string("min_") + unit, row.low},
                    {std::string("max_") + unit, row.high},
                    {"truth", row.truth},
                    {"found", row.found},
                    {"recall", number(row.recall())},
                    {"corners", to_json(row.corners)}});
  }
  return list;
}

}  // namespace

Result<EvaluateDetectionsReport> evaluate_detections(const EvaluateDetectionsJob& job,
                                                     const TagFinder& finder, const JobControl& control) {
  const auto text = read_text_file(job.truth, kMostTextBytes);
  const auto truth = text ? parse_truth(*text, job.truth) : tl::unexpected(text.error());
  if (!truth) return tl::unexpected(truth.error());
  Result<Reports> all =
      job.sources.empty() ? read_reports(job) : Result<Reports>(detect(job, finder, control));
  if (!all) return tl::unexpected(all.error());
  EvaluateDetectionsReport report{.failed = all->summary.failed, .stopped = all->summary.stopped};
  if (all->reports.empty() && (report.failed > 0 || report.stopped)) return report;
  const auto failed = static_cast<std::size_t>(std::ranges::count_if(
      all->reports, [](const PictureReport& picture) { return picture.error.has_value(); }));
  if (failed > 0) control.note("failed and left out: " + counted(failed, "picture"));
  report.failed = std::max(report.failed, failed);
  const auto images = join(std::move(all->reports), *truth, control);
  if (images)
    report.scores = score_detections(*images, job.matching, job.edges);
  else
    report.error = images.error();
  return report;
}

nlohmann::ordered_json to_json(const DetectionScores& scores) {
  nlohmann::ordered_json value = {{"images", scores.images},
                                  {"truth", scores.truth},
                                  {"detections", scores.detections},
                                  {"correct", scores.correct},
                                  {"recall", number(scores.recall())},
                                  {"wrong_ids", scores.wrong_ids},
                                  {"false_positives", scores.false_positives},
                                  {"corners", to_json(scores.corners)}};
  value["consistency"] = nullptr;
  if (const auto& n = scores.consistency) {
    value["consistency"] = {
        {"tags", n->tags}, {"mean_nes_corner", n->mean_nes_corner}, {"mean_nes_tag", n->mean_nes_tag}};
  }
  value["unusable_covariances"] = scores.unusable_covariances;
  value["by_size"] = to_json(scores.by_size, "px");
  value["by_tilt"] = to_json(scores.by_tilt, "deg");
  value["by_size_and_tilt"] = nlohmann::ordered_json::array();
  for (const auto& row : scores.by_size_and_tilt) value["by_size_and_tilt"].push_back(to_json(row, "deg"));
  return value;
}

Status check_effects(const EvaluateDetectionsJob& job, const GivenFlags& given) {
  if (Status usable = check_edges(job.edges); !usable) return usable;
  if (job.sources.empty() == job.detections.empty())
    return fail(ErrorCode::InvalidArgument,
                "give either pictures to detect in, or --detections with what was detected");
  FlagRefusals refused(given);
  refused.flags(!job.detections.empty(), {"--recursive"}, kNothingDetected,
                "Leave it out, or give pictures.");
  return refused.status();
}

}  // namespace waymark
