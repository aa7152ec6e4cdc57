#include "waymark/cli/detections_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/samples/corners.hpp"

namespace waymark::cli {
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

/// Standard deviation of a corner coordinate, root mean square over the tag; nothing when the detector does
/// not know.
std::optional<double> sigma_px(const TagDetection& detection) {
  if (!detection.corner_covariance_px2) return std::nullopt;
  return std::sqrt(std::max(0.0, detection.corner_covariance_px2->trace() / 8));
}

void put_corner_columns(Text& text, const std::optional<CornerScores>& corners) {
  if (!corners) return put(text, "{:>9}{:>9}{:>9}{:>9}", "-", "-", "-", "-");
  put(text, "{:>9.4f}{:>+9.4f}{:>+9.4f}{:>+9.4f}", corners->rmse_px, corners->bias_x_px, corners->bias_y_px,
      corners->bias_outward_px);
}

/// One row a class: how many, recall, corner error.
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

/// Recall in percent, a row a size, a column a tilt.
void put_grid(Text& text, const DetectionScores& scores) {
  if (scores.by_tilt.empty()) return;
  put(text, "\nrecall %, by size across and tilt\n{:<14}", "size px");
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
      "{} pictures, {} true tags, {} reported: {} correct (recall {} %), {} wrong ids, {} false positives\n",
      scores.images, scores.truth, scores.detections, scores.correct, percent(scores.recall()),
      scores.wrong_ids, scores.false_positives);
  if (const auto& c = scores.corners) {
    put(text, "corner error: RMSE {:.4f} px (x {:.4f}, y {:.4f}), worst {:.3f} px\n", c->rmse_px,
        c->rmse_x_px, c->rmse_y_px, c->worst_px);
    put(text, "corner bias:  x {:+.4f}, y {:+.4f}, outward {:+.4f} px\n", c->bias_x_px, c->bias_y_px,
        c->bias_outward_px);
  }
  if (const auto& n = scores.consistency) {
    put(text,
        "covariance:   mean normalised error squared {:.2f} a corner (honest: 2), {:.2f} a tag (honest: 8), "
        "{} tags\n",
        n->mean_nes_corner, n->mean_nes_tag, n->tags);
  }
  if (scores.unusable_covariances > 0) {
    put(text, "covariance:   {} are not positive definite\n", scores.unusable_covariances);
  }
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

std::string to_text(const PictureReport& report) {
  Text text;
  put(text, "{}: {} tag{} in {} x {} px\n", report.image, report.detections.size(),
      report.detections.size() == 1 ? "" : "s", report.width_px, report.height_px);
  if (report.detections.empty()) return fmt::to_string(text);
  put(text, "  {:<22}{:>10}{:>10}{:>9}{:>9}{:>8}{:>8}\n", "tag", "centre x", "centre y", "side px",
      "sigma px", "margin", "hamming");
  for (std::size_t i = 0; i < report.detections.size(); ++i) {
    const TagDetection& tag = report.detections[i];
    const Eigen::Vector2d center = center_px(tag.corners_px);
    const auto sigma = sigma_px(tag);
    const bool refined =
        i >= report.refinements.size() || report.refinements[i] == RefinementOutcome::Refined;
    put(text, "  {:<22}{:>10.2f}{:>10.2f}{:>9.1f}{:>9}{:>8.1f}{:>8}{}\n", to_string(tag.tag), center.x(),
        center.y(), mean_side_px(tag.corners_px), sigma ? fmt::format("{:.3f}", *sigma) : "-",
        tag.decision_margin, tag.hamming,
        refined ? "" : fmt::format("   corners not refined: {}", to_string(report.refinements[i])));
  }
  return fmt::to_string(text);
}

std::string to_text(const DetectionScores& scores) {
  Text text;
  put_sums(text, scores);
  put_classes(text, "size px", scores.by_size);
  if (!scores.by_tilt.empty()) put_classes(text, "tilt deg", scores.by_tilt);
  put_grid(text, scores);
  return fmt::to_string(text);
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

}  // namespace waymark::cli
