#include "waymark/app/detect/detections_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/counted.hpp"
#include "waymark/samples/corners.hpp"

namespace waymark {
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

/// Rounded to the digits that are shown, and never -0: the mean of errors that cancel has either sign.
double shown(double value) { return std::round(value * 1e4) / 1e4 + 0.0; }

void put_corner_columns(Text& text, const std::optional<CornerScores>& corners) {
  if (!corners) return put(text, "{:>9}{:>9}{:>9}{:>9}", "-", "-", "-", "-");
  put(text, "{:>9.4f}{:>+9.4f}{:>+9.4f}{:>+9.4f}", corners->rmse_px, shown(corners->bias_x_px),
      shown(corners->bias_y_px), shown(corners->bias_outward_px));
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
    put(text, "corner bias:  x {:+.4f}, y {:+.4f}, outward {:+.4f} px\n", shown(c->bias_x_px),
        shown(c->bias_y_px), shown(c->bias_outward_px));
  }
  if (const auto& n = scores.consistency) {
    put(text,
        "covariance:   mean normalised error squared {:.2f} a corner (consistent: 2), {:.2f} a tag "
        "(consistent: 8), "
        "{} tags\n",
        n->mean_nes_corner, n->mean_nes_tag, n->tags);
  }
  if (scores.unusable_covariances > 0) {
    put(text, "covariance:   {} are not positive definite\n", scores.unusable_covariances);
  }
}

/// Between the line of sight and the tag's normal.
double incidence_deg(const SE3& cam_T_tag) {
  const Eigen::Vector3d normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  return to_degrees(std::acos(std::clamp(normal.dot(cam_T_tag.translation().normalized()), -1.0, 1.0)));
}

std::string row(const std::string& name, const TagPoseSolution& solution) {
  const PoseDeviations sigma = standard_deviations(solution.cam_T_tag, solution.covariance);
  const Eigen::Vector3d& t = solution.cam_T_tag.translation();
  return fmt::format("  {:<22}{:>9.4f}{:>9.4f}{:>9.4f}{:>9.1f}{:>9.1f}{:>9.1f}{:>9.2f}{:>8.1f}{:>8.3f}\n",
                     name, t.x(), t.y(), t.z(), 1e3 * sigma.position_m.x(), 1e3 * sigma.position_m.y(),
                     1e3 * sigma.position_m.z(), to_degrees(sigma.rotation_rad.maxCoeff()),
                     incidence_deg(solution.cam_T_tag), solution.rms_px);
}

}  // namespace

std::string to_text(const PictureReport& report) {
  Text text;
  put(text, "{}: {} in {} x {} px\n", report.image, counted(report.detections.size(), "tag"), report.width_px,
      report.height_px);
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

std::string to_text(std::span<const TagDetection> detections, const PoseList& poses) {
  if (poses.empty()) return {};
  std::string text =
      fmt::format("  {:<22}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>8}{:>8}\n", "pose in the camera", "x m",
                  "y m", "z m", "±x mm", "±y mm", "±z mm", "±rot °", "tilt °", "rms px");
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = to_string(detections[i].tag);
    if (!poses[i]) {
      text += fmt::format("  {:<22}{}\n", name, to_string(poses[i].error()));
      continue;
    }
    text += row(name, poses[i]->best);
    if (poses[i]->other)
      text += row(fmt::format("  or (ratio {:.2f})", poses[i]->ambiguity_ratio()), *poses[i]->other);
  }
  return text;
}

}  // namespace waymark
