#include "waymark/evaluation/detections.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/Cholesky>

namespace waymark {
namespace {

/// Running sums behind CornerScores.
struct CornerSums {
  std::size_t tags = 0;
  Eigen::Vector2d error = Eigen::Vector2d::Zero();
  Eigen::Vector2d squared = Eigen::Vector2d::Zero();
  double outward = 0;
  double worst = 0;

  void add(const TagDetection& detection, const TrueTag& truth) {
    const auto& corners = truth.corners_px;
    const Eigen::Vector2d center = (corners[0] + corners[1] + corners[2] + corners[3]) / 4;
    for (std::size_t i = 0; i < 4; ++i) {
      const Eigen::Vector2d e = detection.corners_px[i] - corners[i];
      error += e;
      squared += e.cwiseAbs2();
      outward += e.dot((corners[i] - center).normalized());  // a zero vector stays zero
      worst = std::max(worst, e.norm());
    }
    ++tags;
  }

  [[nodiscard]] std::optional<CornerScores> scores() const {
    if (tags == 0) return std::nullopt;
    const double corners = 4.0 * static_cast<double>(tags);
    return CornerScores{.tags = tags,
                        .rmse_px = std::sqrt(squared.sum() / corners),
                        .rmse_x_px = std::sqrt(squared.x() / corners),
                        .rmse_y_px = std::sqrt(squared.y() / corners),
                        .worst_px = worst,
                        .bias_x_px = error.x() / corners,
                        .bias_y_px = error.y() / corners,
                        .bias_outward_px = outward / corners};
  }
};

/// Running sums behind CornerConsistency.
struct ConsistencySums {
  std::size_t tags = 0;
  std::size_t unusable = 0;
  double corner = 0;
  double tag = 0;

  void add(const TagDetection& detection, const TrueTag& truth) {
    if (!detection.corner_covariance_px2) return;
    const CornerCovariance& covariance = *detection.corner_covariance_px2;
    const Eigen::LLT<CornerCovariance> llt(covariance);
    if (!covariance.allFinite() || llt.info() != Eigen::Success) {
      ++unusable;
      return;
    }
    Eigen::Matrix<double, 8, 1> e;
    for (Eigen::Index i = 0; i < 4; ++i) {
      const auto corner_index = static_cast<std::size_t>(i);
      e.segment<2>(2 * i) = detection.corners_px[corner_index] - truth.corners_px[corner_index];
      const Eigen::Matrix2d block =
          covariance.block<2, 2>(2 * i, 2 * i);  // definite, as part of a definite whole
      corner += e.segment<2>(2 * i).dot(block.llt().solve(e.segment<2>(2 * i)));
    }
    tag += e.dot(llt.solve(e));
    ++tags;
  }

  [[nodiscard]] std::optional<CornerConsistency> scores() const {
    if (tags == 0) return std::nullopt;
    const auto count = static_cast<double>(tags);
    return CornerConsistency{
        .tags = tags, .mean_nes_corner = corner / (4 * count), .mean_nes_tag = tag / count};
  }
};

/// One class being filled.
struct ClassSums {
  std::size_t truth = 0;
  std::size_t found = 0;
  CornerSums corners;

  void add(const TrueTag& tag, const TagDetection* detection) {
    ++truth;
    if (detection == nullptr) return;
    ++found;
    corners.add(*detection, tag);
  }
};

std::vector<ClassScores> finish(const std::vector<ClassSums>& sums, const std::vector<double>& edges) {
  std::vector<ClassScores> scores;
  for (std::size_t i = 0; i < sums.size(); ++i) {
    scores.push_back({edges[i], edges[i + 1], sums[i].truth, sums[i].found, sums[i].corners.scores()});
  }
  return scores;
}

std::optional<std::size_t> class_of(double value, const std::vector<double>& edges) {
  if (!(value >= edges.front() && value <= edges.back())) return std::nullopt;
  const auto above = std::upper_bound(edges.begin(), edges.end(), value);
  const auto index = static_cast<std::size_t>(above - edges.begin()) - 1;
  return std::min(index, edges.size() - 2);
}

/// Everything being counted, image by image.
class Scorer {
 public:
  Scorer(const MatchOptions& options, const ClassEdges& edges)
      : options_(options),
        edges_(edges),
        by_size_(edges.size_px.size() - 1),
        by_tilt_(edges.tilt_deg.size() - 1),
        by_both_(by_size_.size(), std::vector<ClassSums>(by_tilt_.size())) {}

  void add(const ImageDetections& image) {
    const Matching matching = match_detections(image.detections, image.truth, options_);
    ++scores_.images;
    scores_.truth += image.truth.size();
    scores_.detections += image.detections.size();
    scores_.correct += matching.correct.size();
    scores_.wrong_ids += matching.wrong_id.size();
    scores_.false_positives += matching.false_positives.size();
    for (const auto& [d, t] : matching.correct) add_tag(image.truth[t], &image.detections[d]);
    for (const std::size_t t : matching.missed) add_tag(image.truth[t], nullptr);
  }

  [[nodiscard]] DetectionScores scores() {
    scores_.corners = all_.scores();
    scores_.consistency = consistency_.scores();
    scores_.unusable_covariances = consistency_.unusable;
    scores_.by_size = finish(by_size_, edges_.size_px);
    if (any_tilt_) {
      scores_.by_tilt = finish(by_tilt_, edges_.tilt_deg);
      for (const auto& row : by_both_) scores_.by_size_and_tilt.push_back(finish(row, edges_.tilt_deg));
    }
    return scores_;
  }

 private:
  void add_tag(const TrueTag& tag, const TagDetection* detection) {
    if (detection != nullptr) {
      all_.add(*detection, tag);
      consistency_.add(*detection, tag);
    }
    const auto size = class_of(tag.size_px, edges_.size_px);
    if (size) by_size_[*size].add(tag, detection);
    if (!tag.tilt_deg) return;
    any_tilt_ = true;
    const auto tilt = class_of(*tag.tilt_deg, edges_.tilt_deg);
    if (tilt) by_tilt_[*tilt].add(tag, detection);
    if (size && tilt) by_both_[*size][*tilt].add(tag, detection);
  }

  const MatchOptions& options_;
  const ClassEdges& edges_;
  DetectionScores scores_;
  CornerSums all_;
  ConsistencySums consistency_;
  std::vector<ClassSums> by_size_;
  std::vector<ClassSums> by_tilt_;
  std::vector<std::vector<ClassSums>> by_both_;
  bool any_tilt_ = false;
};

Status check(const std::vector<double>& edges, const char* key) {
  const bool finite =
      std::all_of(edges.begin(), edges.end(), [](double edge) { return std::isfinite(edge); });
  const bool ascending =
      std::adjacent_find(edges.begin(), edges.end(), std::greater_equal<>()) == edges.end();
  if (edges.size() >= 2 && finite && ascending) return {};
  return fail(ErrorCode::InvalidArgument, "the edges of the classes must be two or more ascending numbers",
              {.key = key}, "For example 0,16,32,64.");
}

std::optional<double> ratio(std::size_t part, std::size_t whole) {
  if (whole == 0) return std::nullopt;
  return static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::optional<double> ClassScores::recall() const { return ratio(found, truth); }

std::optional<double> DetectionScores::recall() const { return ratio(correct, truth); }

Status check_edges(const ClassEdges& edges) {
  if (auto size = check(edges.size_px, "size_edges_px"); !size) return size;
  return check(edges.tilt_deg, "tilt_edges_deg");
}

DetectionScores score_detections(std::span<const ImageDetections> images, const MatchOptions& options,
                                 const ClassEdges& edges) {
  assert(check_edges(edges));
  Scorer scorer(options, edges);
  for (const ImageDetections& image : images) scorer.add(image);
  return scorer.scores();
}

}  // namespace waymark
