#include "waymark/app/common/detections_json.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/json_line.hpp"
#include "waymark/config/yaml_node.hpp"
#include "waymark/samples/corners.hpp"

namespace waymark {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

/// So many decimals, and -0 as 0: the same bytes wherever only the last bit of the arithmetic differs.
double rounded(double value, double per_unit) {
  constexpr double kLargest = 1e9;  // beyond it a double has no such decimals
  return std::abs(value) < kLargest ? std::round(value * per_unit) / per_unit + 0.0 : value;
}

ordered_json point(const Eigen::Vector2d& px) {
  constexpr double kPerPx = 1e6;
  return ordered_json::array({rounded(px.x(), kPerPx), rounded(px.y(), kPerPx)});
}

ordered_json rows(const CornerCovariance& covariance) {
  ordered_json all = ordered_json::array();
  for (Eigen::Index r = 0; r < 8; ++r) {
    ordered_json row = ordered_json::array();
    for (Eigen::Index c = 0; c < 8; ++c) row.push_back(covariance(r, c));
    all.push_back(std::move(row));
  }
  return all;
}

ordered_json to_json(const TagDetection& detection, bool with_covariance) {
  const auto& corners = detection.corners_px;
  ordered_json value;
  value["tag"] = to_string(detection.tag);
  value["family"] = std::string(to_string(detection.tag.family));
  value["id"] = detection.tag.number;
  value["hamming"] = detection.hamming;
  value["decision_margin"] = rounded(detection.decision_margin, 1e4);
  value["corners_px"] = ordered_json::array();
  for (const auto& corner : corners) value["corners_px"].push_back(point(corner));
  value["center_px"] = point(center_px(corners));
  if (!detection.corner_covariance_px2) return value;
  value["corner_sigma_px"] = ordered_json::array();
  const Eigen::Matrix<double, 8, 1> sigma =
      detection.corner_covariance_px2->diagonal().cwiseMax(0).cwiseSqrt();
  for (Eigen::Index i = 0; i < 4; ++i) value["corner_sigma_px"].push_back(point(sigma.segment<2>(2 * i)));
  if (with_covariance) value["corner_covariance_px2"] = rows(*detection.corner_covariance_px2);
  return value;
}

/// Whether brackets and braces are nested deeper than the other readers of text go.
bool is_nested_too_deep(std::string_view json_text) {
  std::size_t depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json_text.size(); ++i) {
    const char c = json_text[i];
    if (in_string && c == '\\') {
      ++i;
    } else if (c == '"') {
      in_string = !in_string;
    } else if (!in_string && (c == '[' || c == '{')) {
      if (++depth > YamlLimits{}.depth) return true;
    } else if (!in_string && (c == ']' || c == '}')) {
      depth -= depth > 0 ? 1 : 0;
    }
  }
  return false;
}

/// Reads values of one JSON object; the first that is missing or of the wrong kind is kept as the error.
class Reader {
 public:
  Reader(const json& object, Place place, std::string path)
      : object_(object), place_(std::move(place)), path_(std::move(path)) {}

  double number(const char* key) {
    const json* value = find(key);
    if (value == nullptr) return 0;
    if (value->is_number() && std::isfinite(value->get<double>())) return value->get<double>();
    refuse(key, "is not a finite number");
    return 0;
  }
  int integer(const char* key) {
    const double value = number(key);
    constexpr double kLargest = 1e9;
    if (value == std::floor(value) && std::abs(value) <= kLargest) return static_cast<int>(value);
    refuse(key, "is not a whole number");
    return 0;
  }
  std::string text(const char* key) {
    const json* value = find(key);
    if (value == nullptr) return {};
    if (value->is_string()) return value->get<std::string>();
    refuse(key, "is not a text");
    return {};
  }
  /// rows x columns numbers, row by row; all zero when there is an error.
  std::vector<double> table(const char* key, std::size_t rows, std::size_t columns) {
    std::vector<double> numbers;
    const json* value = find(key);
    const bool is_table = value != nullptr && value->is_array() && value->size() == rows;
    for (std::size_t r = 0; is_table && r < rows; ++r) {
      const json& row = (*value)[r];
      for (std::size_t c = 0; row.is_array() && row.size() == columns && c < columns; ++c) {
        if (row[c].is_number()) numbers.push_back(row[c].get<double>());
      }
    }
    const bool finite =
        std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
    if (numbers.size() == rows * columns && finite) return numbers;
    refuse(key, fmt::format("is not a table of {} x {} finite numbers", rows, columns));
    return std::vector<double>(rows * columns, 0.0);
  }
  [[nodiscard]] bool has(const char* key) const { return object_.contains(key); }
  void refuse(const char* key, const std::string& why) {
    if (!status_) return;
    place_.key = path_.empty() ? key : fmt::format("{}.{}", path_, key);
    status_ = fail(ErrorCode::Unreadable, why, place_, "Expected what `waymark detect --json` writes.");
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  const json* find(const char* key) {
    const auto found = object_.find(key);
    if (found != object_.end()) return &*found;
    refuse(key, "is missing");
    return nullptr;
  }

  const json& object_;
  Place place_;
  std::string path_;
  Status status_;
};

Result<TagDetection> read_detection(const json& object, const Place& place, std::size_t index) {
  Reader reader(object, place, fmt::format("detections[{}]", index));
  TagDetection detection;
  const auto tag = parse_tag_id(reader.text("tag"));
  if (tag) detection.tag = *tag;
  if (!tag) reader.refuse("tag", to_string(tag.error()));
  if (reader.has("hamming")) detection.hamming = reader.integer("hamming");
  if (reader.has("decision_margin")) detection.decision_margin = reader.number("decision_margin");
  const auto corners = reader.table("corners_px", 4, 2);
  for (std::size_t i = 0; i < 4; ++i) detection.corners_px[i] = {corners[2 * i], corners[2 * i + 1]};
  if (reader.has("corner_covariance_px2")) {
    const auto numbers = reader.table("corner_covariance_px2", 8, 8);
    detection.corner_covariance_px2 =
        Eigen::Map<const CornerCovariance>(numbers.data());  // symmetric: order is no matter
  }
  if (!reader.status()) return tl::unexpected(reader.status().error());
  return detection;
}

Result<PictureReport> read_report(const json& object, const Place& place) {
  Reader reader(object, place, "");
  PictureReport report{.image = reader.text("image")};
  if (reader.has("width_px")) report.width_px = reader.integer("width_px");
  if (reader.has("height_px")) report.height_px = reader.integer("height_px");
  if (reader.has("error"))
    report.error = Error{ErrorCode::Unreadable, "failed when it was detected", {.source = report.image}};
  const bool has_detections = reader.has("detections");
  if (has_detections && !object["detections"].is_array()) reader.refuse("detections", "is not a list");
  if (!has_detections && !report.error) reader.refuse("detections", "is missing");
  if (!reader.status()) return tl::unexpected(reader.status().error());
  if (!has_detections) return report;
  report.detected = true;
  for (const json& item : object["detections"]) {
    const std::size_t index = report.detections.size();
    if (!item.is_object())
      return fail(ErrorCode::Unreadable, "is not an object", {place.source, place.line, {}, "detections"});
    auto detection = read_detection(item, place, index);
    if (!detection) return tl::unexpected(detection.error());
    report.detections.push_back(std::move(*detection));
  }
  return report;
}

}  // namespace

nlohmann::ordered_json to_json(const PictureReport& report, bool with_covariance) {
  ordered_json value;
  value["image"] = report.image;
  if (report.stamp) value["stamp_s"] = static_cast<double>(report.stamp->time_since_epoch().count()) / 1e9;
  if (report.width_px > 0) {
    value["width_px"] = report.width_px;
    value["height_px"] = report.height_px;
  }
  if (report.detected) {
    value["detections"] = ordered_json::array();
    for (std::size_t i = 0; i < report.detections.size(); ++i) {
      ordered_json detection = to_json(report.detections[i], with_covariance);
      if (i < report.refinements.size())
        detection["refinement"] = std::string(to_string(report.refinements[i]));
      value["detections"].push_back(std::move(detection));
    }
  }
  if (report.error) value["error"] = to_json(*report.error);
  return value;
}

Result<std::vector<PictureReport>> parse_reports(std::string_view text, const std::string& source) {
  std::vector<PictureReport> reports;
  for (std::int64_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
    const Place place{.source = source, .line = number};
    if (is_nested_too_deep(line))
      return fail(ErrorCode::LimitExceeded, fmt::format("nested more than {} deep", YamlLimits{}.depth),
                  place);
    const json object = json::parse(line, nullptr, false);
    if (!object.is_object()) {
      return fail(ErrorCode::Unreadable, "is not a JSON object", place,
                  "Expected one object a line, as `waymark detect --json` writes.");
    }
    auto report = read_report(object, place);
    if (!report) return tl::unexpected(report.error());
    reports.push_back(std::move(*report));
  }
  return reports;
}

}  // namespace waymark
