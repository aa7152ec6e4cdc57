#include "waymark/evaluation/detections.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "waymark/base/message_text.hpp"
#include "waymark/evaluation/csv.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

constexpr std::array<std::string_view, 8> kCorners = {"x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3"};
constexpr std::array<std::string_view, 14> kKnownColumns = {
    "image", "id", "x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3", "size", "size_px", "tilt_deg", "family"};

/// Indices of the columns used.
struct Columns {
  std::size_t image = 0;
  std::size_t id = 0;
  std::array<std::size_t, 8> corners{};
  std::optional<std::size_t> size, tilt, family;
};

Result<std::size_t> required(const CsvTable& table, std::string_view name) {
  if (const auto found = table.column(name)) return *found;
  std::vector<std::string> unknown;  // a known column is not a misspelling
  for (const std::string& column : table.columns) {
    if (std::find(kKnownColumns.begin(), kKnownColumns.end(), column) == kKnownColumns.end())
      unknown.push_back(column);
  }
  const std::string nearest = nearest_word(name, unknown);
  return fail(ErrorCode::NotFound, fmt::format("no column '{}'", name),
              {.source = table.source, .key = std::string(name)},
              (nearest.empty() ? "" : fmt::format("Did you mean '{}'? ", nearest)) +
                  "Needed: image, id, x0, y0, x1, y1, x2, y2, x3, y3.");
}

Result<Columns> find_columns(const CsvTable& table) {
  Columns columns;
  std::vector<std::pair<std::string_view, std::size_t*>> wanted = {{"image", &columns.image},
                                                                   {"id", &columns.id}};
  for (std::size_t i = 0; i < kCorners.size(); ++i) wanted.emplace_back(kCorners[i], &columns.corners[i]);
  for (const auto& [name, where] : wanted) {
    const auto found = required(table, name);
    if (!found) return tl::unexpected(found.error());
    *where = *found;
  }
  columns.size = table.column("size_px");
  if (!columns.size) columns.size = table.column("size");
  columns.tilt = table.column("tilt_deg");
  columns.family = table.column("family");
  return columns;
}

Result<std::optional<double>> optional_number(const CsvTable& table, const CsvRow& row,
                                              std::optional<std::size_t> column, double min, double max) {
  if (!column || row.cells[*column].empty()) return std::optional<double>();
  const auto value = csv_number(table, row, *column);
  if (!value) return tl::unexpected(value.error());
  if (*value < min || *value > max) {
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is outside [{}, {}]", *value, min, max),
                {.source = table.source, .line = row.line, .key = table.columns[*column]});
  }
  return std::optional<double>(*value);
}

Result<TagId> read_tag(const CsvTable& table, const CsvRow& row, const Columns& columns) {
  const auto number = csv_integer(table, row, columns.id);
  if (!number) return tl::unexpected(number.error());
  TagId tag{.number = *number};
  if (columns.family && !row.cells[*columns.family].empty()) {
    auto id = parse_family(row.cells[*columns.family]);
    if (!id) {
      id.error().place = {.source = table.source, .line = row.line, .key = "family"};
      return tl::unexpected(id.error());
    }
    tag.family = *id;
  }
  const std::size_t known = family(tag.family).codes.size();
  if (tag.number < 0 || static_cast<std::size_t>(tag.number) >= known) {
    return fail(
        ErrorCode::InvalidArgument,
        fmt::format("{} has no tag {}; its ids are 0 to {}", to_string(tag.family), tag.number, known - 1),
        {.source = table.source, .line = row.line, .key = "id"});
  }
  return tag;
}

Result<TrueTag> read_row(const CsvTable& table, const CsvRow& row, const Columns& columns) {
  TrueTag tag;
  const auto id = read_tag(table, row, columns);
  if (!id) return tl::unexpected(id.error());
  tag.tag = *id;
  for (std::size_t i = 0; i < kCorners.size(); ++i) {
    const auto value = csv_number(table, row, columns.corners[i]);
    if (!value) return tl::unexpected(value.error());
    tag.corners_px[i / 2][static_cast<Eigen::Index>(i % 2)] = *value;
  }
  constexpr double kLargestPx = 1e6;
  const auto size = optional_number(table, row, columns.size, 0, kLargestPx);
  if (!size) return tl::unexpected(size.error());
  tag.size_px = size->value_or(mean_side_px(tag.corners_px));
  const auto tilt = optional_number(table, row, columns.tilt, 0, 90);
  if (!tilt) return tl::unexpected(tilt.error());
  tag.tilt_deg = *tilt;
  return tag;
}

bool is_empty_image(const CsvRow& row, std::size_t image) {
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (i != image && !row.cells[i].empty()) return false;
  }
  return true;
}

}  // namespace

Result<DetectionTruth> parse_truth(std::string_view text, std::string source) {
  const auto table = parse_csv(text, std::move(source));
  if (!table) return tl::unexpected(table.error());
  const auto columns = find_columns(*table);
  if (!columns) return tl::unexpected(columns.error());
  DetectionTruth truth;
  for (const CsvRow& row : table->rows) {
    const std::string& image = row.cells[columns->image];
    if (image.empty()) {
      return fail(ErrorCode::InvalidArgument, "missing image name",
                  {.source = table->source, .line = row.line, .key = "image"});
    }
    auto& tags = truth[image];
    if (is_empty_image(row, columns->image)) continue;
    auto tag = read_row(*table, row, *columns);
    if (!tag) return tl::unexpected(tag.error());
    tags.push_back(*tag);
  }
  return truth;
}

std::optional<std::string> find_image(const DetectionTruth& truth, std::string_view path) {
  const std::size_t name_start = path.find_last_of('/') + 1;  // npos + 1 == 0
  const std::size_t dot = path.find_last_of('.');
  const bool has_suffix = dot != std::string_view::npos && dot > name_start;
  for (std::string_view rest = path;;) {
    if (const auto found = truth.find(std::string(rest)); found != truth.end()) return found->first;
    if (has_suffix) {
      const std::string_view stem = rest.substr(0, rest.size() - (path.size() - dot));
      if (const auto found = truth.find(std::string(stem)); found != truth.end()) return found->first;
    }
    const std::size_t slash = rest.find('/');
    if (slash == std::string_view::npos) return std::nullopt;
    rest.remove_prefix(slash + 1);
  }
}

namespace {

/// Detections and true tags that have not been matched yet.
struct Free {
  std::vector<bool> detections;
  std::vector<bool> truth;
};

/// Greedy assignment that starts with the nearest pair. `distance(d, t)` returns a negative number for pairs
/// that must not be matched.
template <class Distance>
std::vector<MatchedPair> take_nearest(Free& free, Distance&& distance) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
  for (std::size_t d = 0; d < free.detections.size(); ++d) {
    for (std::size_t t = 0; t < free.truth.size(); ++t) {
      if (!free.detections[d] || !free.truth[t]) continue;
      if (const double px = distance(d, t); px >= 0) pairs.emplace_back(px, d, t);
    }
  }
  std::sort(pairs.begin(), pairs.end());
  std::vector<MatchedPair> taken;
  for (const auto& [px, d, t] : pairs) {
    if (!free.detections[d] || !free.truth[t]) continue;
    free.detections[d] = false;
    free.truth[t] = false;
    taken.push_back({d, t});
  }
  return taken;
}

double limit_px(const TrueTag& truth, const MatchOptions& options) {
  return std::max(options.match_distance_px, options.match_distance_sides * mean_side_px(truth.corners_px));
}

}  // namespace

double corner_distance_px(const std::array<Eigen::Vector2d, 4>& detected,
                          const std::array<Eigen::Vector2d, 4>& truth, std::size_t quarter_turns) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += (detected[(i + quarter_turns) % 4] - truth[i]).squaredNorm();
  return std::sqrt(sum / 4);
}

Matching match_detections(std::span<const TagDetection> detections, std::span<const TrueTag> truth,
                          const MatchOptions& options) {
  Free free{std::vector<bool>(detections.size(), true), std::vector<bool>(truth.size(), true)};
  Matching matching;
  matching.correct = take_nearest(free, [&](std::size_t d, std::size_t t) {
    if (detections[d].tag != truth[t].tag) return -1.0;
    const double px = corner_distance_px(detections[d].corners_px, truth[t].corners_px);
    return px <= limit_px(truth[t], options) ? px : -1.0;
  });
  for (std::size_t t = 0; t < truth.size(); ++t) {
    if (free.truth[t]) matching.missed.push_back(t);
  }
  matching.wrong_id = take_nearest(free, [&](std::size_t d, std::size_t t) {
    double px = corner_distance_px(detections[d].corners_px, truth[t].corners_px);
    for (std::size_t turns = 1; turns < 4; ++turns) {
      px = std::min(px, corner_distance_px(detections[d].corners_px, truth[t].corners_px, turns));
    }
    return px <= limit_px(truth[t], options) ? px : -1.0;
  });
  for (std::size_t d = 0; d < detections.size(); ++d) {
    if (free.detections[d]) matching.false_positives.push_back(d);
  }
  return matching;
}

namespace {

/// Sums from which CornerScores are computed.
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

/// Sums from which CornerConsistency is computed.
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
          covariance.block<2, 2>(2 * i, 2 * i);  // positive definite because it is a principal block
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

/// Sums for one class.
struct ClassSums {
  std::size_t truth = 0;
  std::size_t found = 0;
  CornerSums corners;

  void add(const TrueTag& tag, const TagDetection* detection) {
    ++truth;
    if (detection == nullptr) return;
    ++found;
    if (usable_corners(*detection)) corners.add(*detection, tag);
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

/// Accumulates all counts and sums, image by image.
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
    if (detection != nullptr && usable_corners(*detection)) {
      all_.add(*detection, tag);
      consistency_.add(*detection, tag);
    } else if (detection != nullptr) {
      ++scores_.unreliable;
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
  return fail(ErrorCode::InvalidArgument, "class edges must be two or more ascending numbers", {.key = key},
              "For example 0,16,32,64.");
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
