#include "waymark/app/common/detect_all.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/config/yaml_tree.hpp"
#include "waymark/media/video_format.hpp"
#include "waymark/media/video_reader.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using nlohmann::json;

/// Rounds to the given resolution and replaces -0 with 0, so that results that differ only in the last bit
/// are printed identically.
double rounded_to(double value, double per_unit) {
  constexpr double kMaxRounded = 1e9;  // larger doubles have fewer decimals than this
  return std::abs(value) < kMaxRounded ? std::round(value * per_unit) / per_unit + 0.0 : value;
}

std::array<double, 2> rounded_point(const Eigen::Vector2d& px) {
  constexpr double kPerPx = 1e6;
  return {rounded_to(px.x(), kPerPx), rounded_to(px.y(), kPerPx)};
}

using FourPoints = std::array<std::array<double, 2>, 4>;

FourPoints rounded_points(const std::array<Eigen::Vector2d, 4>& px) {
  FourPoints points{};
  for (std::size_t i = 0; i < 4; ++i) points[i] = rounded_point(px[i]);
  return points;
}

FourPoints sigma_points(const CornerCovariance& covariance) {
  const Eigen::Matrix<double, 8, 1> sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  FourPoints points{};
  for (Eigen::Index i = 0; i < 4; ++i)
    points[static_cast<std::size_t>(i)] = rounded_point(sigma.segment<2>(2 * i));
  return points;
}

using CovarianceRows = std::array<std::array<double, 8>, 8>;

CovarianceRows rows_of(const CornerCovariance& covariance) {
  CovarianceRows rows{};
  for (std::size_t r = 0; r < 8; ++r)
    for (std::size_t c = 0; c < 8; ++c)
      rows[r][c] = covariance(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
  return rows;
}

TagDetection detection_at_origin() {
  TagDetection detection;
  detection.corners_px.fill(Eigen::Vector2d::Zero());
  return detection;
}

struct DetectionLine {
  TagDetection detection = detection_at_origin();
  std::optional<RefinementOutcome> refinement{};
  std::optional<Result<TagPose>> pose{};
  bool with_covariance = false;
};

ReportFields fields(const DetectionLine& line) {
  const TagDetection& detection = line.detection;
  const auto& covariance = detection.corner_covariance_px2;
  const auto refinement = [](RefinementOutcome outcome) { return std::string(to_string(outcome)); };
  ReportFields all = {
      {"tag", "Family and id, such as tag36h11:7", to_string(detection.tag)},
      {"family", "Family of the tag", to_string(detection.tag.family)},
      {"id", "Id of the tag", detection.tag.number},
      {"hamming", "Number of corrected bits", detection.hamming},
      {"decision_margin", "Mean distance of the data bits from the black/white threshold [grey level]",
       rounded_to(detection.decision_margin, 1e4)},
      {"corners_px", "Distorted [x, y] of top left, top right, bottom right, bottom left of the printed tag",
       rounded_points(detection.corners_px)},
      {"center_px", "[x, y] of the intersection of the diagonals, the image of the tag's centre",
       rounded_point(center_px(detection.corners_px))},
      {"corner_sigma_px", "Standard deviations [x, y] of each corner; absent with `no_refine`",
       if_any(part(covariance, sigma_points))},
      {"corner_covariance_px2", "With `covariance`: 8 x 8, row by row, of x0 y0 x1 y1 x2 y2 x3 y3",
       if_any(line.with_covariance ? part(covariance, rows_of) : std::nullopt)},
      {"refinement", "refined, or why the detector's corners were kept; absent with `no_refine`",
       if_any(part(line.refinement, refinement))},
      {"corners",
       "unreliable if the image contradicts corners_px, so that no pose uses them; absent otherwise",
       if_any(usable_corners(detection) ? std::nullopt
                                        : std::optional(std::string(to_string(detection.corner_state))))}};
  for (ReportField& field : pose_fields(line.pose)) all.push_back(std::move(field));
  return all;
}

/// Whether brackets and braces are nested deeper than YamlLimits allows, which is also the limit for the
/// other text readers.
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

/// Reads values from one JSON object. The error of the first value that is missing or has the wrong type is
/// kept.
class ReportReader {
 public:
  ReportReader(const json& object, Place place, std::string path)
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
    refuse(key, "is not a string");
    return {};
  }
  /// Reads rows x columns numbers, row by row; all are zero after an error.
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
    status_ = fail(ErrorCode::Unreadable, why, place_, "Expected the output of `waymark detect json=true`.");
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
  ReportReader reader(object, place, fmt::format("detections[{}]", index));
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
    detection.corner_covariance_px2 = Eigen::Map<const CornerCovariance>(
        numbers.data());  // symmetric, so the storage order does not matter
  }
  if (reader.has("corners")) {
    if (reader.text("corners") == to_string(CornerState::Unreliable))
      detection.corner_state = CornerState::Unreliable;
  }
  if (!reader.status()) return tl::unexpected(reader.status().error());
  return detection;
}

Result<ImageReport> read_report(const json& object, const Place& place) {
  ReportReader reader(object, place, "");
  ImageReport report{.image = reader.text("image")};
  if (reader.has("width_px")) report.width_px = reader.integer("width_px");
  if (reader.has("height_px")) report.height_px = reader.integer("height_px");
  if (reader.has("error"))
    report.error = Error{ErrorCode::Unreadable, "failed during detection", {.source = report.image}};
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

ReportFields fields(const ImageLine& line) {
  const ImageReport& report = line.report;
  const auto seconds = [](SensorTime stamp) {
    return static_cast<double>(stamp.time_since_epoch().count()) / 1e9;
  };
  const auto cause = [](const NoTagReason& reason) { return std::string(to_string(reason.cause)); };
  const bool is_read = report.width_px > 0;
  std::optional<std::vector<DetectionLine>> detections;
  if (report.detected) detections.emplace();
  for (std::size_t i = 0; report.detected && i < report.detections.size(); ++i) {
    DetectionLine one{.detection = report.detections[i], .with_covariance = line.with_covariance};
    if (i < report.refinements.size()) one.refinement = report.refinements[i];
    if (i < line.poses.size()) one.pose = line.poses[i];
    detections->push_back(std::move(one));
  }
  return {
      {"image", "Path as given or found; in a recording or a video FILE#SECONDS", report.image},
      {"stamp_s", "Stamp in the recording, time since the first image of the video, or (cameras) since 1970",
       if_any(part(report.stamp, seconds))},
      {"width_px", "Width of the image; absent if it could not be read",
       if_any(is_read ? std::optional(report.width_px) : std::nullopt)},
      {"height_px", "Height of the image; absent if it could not be read",
       if_any(is_read ? std::optional(report.height_px) : std::nullopt)},
      {"lens",
       "Source of the lens model for the corners: camera (as given), recording or unknown; absent without "
       "detections",
       if_any(report.detected ? std::optional(std::string(to_string(report.lens))) : std::nullopt)},
      {"detections", "Tags by family, id and position; absent if the image is unreadable or too large",
       if_any(detections)},
      {"no_tag_cause",
       "Last image, if no image of the run contains a tag: other_family, mirrored, inverted, small, dark, "
       "bright, faint or blurred; absent if the cause is unknown",
       if_any(part(report.no_tag_reason, cause))},
      {"error", "What failed for this input; absent if nothing did", if_any(report.error)},
      {"age_ms", "Cameras: time from the middle of the exposure until the tags were found",
       if_any(line.age_ms)}};
}

Result<std::vector<ImageReport>> parse_reports(std::string_view text, const std::string& source) {
  std::vector<ImageReport> reports;
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
                  "Expected one object per line, as written by `waymark detect json=true`.");
    }
    auto report = read_report(object, place);
    if (!report) return tl::unexpected(report.error());
    reports.push_back(std::move(*report));
  }
  return reports;
}

std::string_view to_string(LensSource source) {
  switch (source) {
    case LensSource::Unknown:
      return "unknown";
    case LensSource::Camera:
      return "camera";
    case LensSource::Recording:
      return "recording";
  }
  return "unknown";
}

std::string beyond_lens_note(std::size_t tags) {
  return fmt::format(
      "dropped {} outside the range of the lens model. Calibrate with views that reach the image corners.",
      counted(tags, "tag"));
}

std::string without_lens_note(std::size_t tags) {
  return fmt::format(
      "lens unknown: {} detected without a lens model. Corners are biased if the lens distorts, and "
      "poses are not possible. Set `camera` to the calibration of the images, and `tag_size_m`.",
      counted(tags, "tag"));
}

std::string unreliable_note(std::size_t tags) {
  return fmt::format(
      "unreliable corners: {}, not used for poses or maps. Check whether these tags are flat, uncovered, "
      "sharp and surrounded by their white margin.",
      counted(tags, "tag"));
}

std::string internal::name_of_image(const std::string& path, SensorTime stamp) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = stamp.time_since_epoch().count();
  return fmt::format("{}#{}.{:09}", path, ns / kSecond, std::abs(ns % kSecond));
}

namespace {

/// A lens and its source; Unknown if the lens is unknown.
struct SourcedLens {
  ImageLens lens;
  LensSource source = LensSource::Unknown;
};

SourcedLens lens_given(const LensChoice& choice) {
  return {choice.camera, choice.camera.known() ? LensSource::Camera : LensSource::Unknown};
}

/// Detects the tags in the image of the report. A lens model is used only if the image has its size.
void find_in(const ImageView& image, const TagFinder& finder, const SourcedLens& lens, ImageReport& report) {
  const bool fits =
      lens.lens.known() && check_image_size(*lens.lens.camera(), image.width, image.height).has_value();
  if (fits) report.lens = lens.source;
  auto found = find_tags(image, finder, fits ? lens.lens : ImageLens::unknown());
  if (!found) {
    report.error = found.error();
    report.error->place.source = report.image;
    return;
  }
  report.detected = true;
  report.detections = std::move(found->detections);
  report.refinements = std::move(found->refinements);
  report.beyond_lens = found->beyond_lens;
}

/// Reads the image and detects its tags; a failure is recorded in the report.
Image process(const Input& input, const TagFinder& finder, const SourcedLens& lens, ImageReport& report) {
  report.image = input.path;
  report.error = input.error;
  if (report.error) return {};
  auto image = or_wrong_kind(read_image(input.path), input.path, FileUse::Image);
  if (!image) {
    report.error = image.error();
    return {};
  }
  report.width_px = image->width();
  report.height_px = image->height();
  find_in(*image, finder, lens, report);
  return std::move(*image);
}

/// Detects the tags in one image from a recording or a video.
ImageReport report_on(const std::string& path, SensorTime stamp, const ImageView& image,
                      const TagFinder& finder, const SourcedLens& lens) {
  ImageReport report{.image = internal::name_of_image(path, stamp),
                     .stamp = stamp,
                     .width_px = image.width,
                     .height_px = image.height};
  find_in(image, finder, lens, report);
  return report;
}

/// Counts a processed image. Its error is printed as a note, unless an earlier image had the same one.
void count(const ImageReport& report, const JobControl& control, DetectSummary& summary) {
  summary.tags += report.detections.size();
  summary.beyond_lens += report.beyond_lens;
  summary.unreliable += count_unreliable(report.detections);
  ++(report.error ? summary.failed : summary.images);
  if (!report.error && report.lens == LensSource::Unknown) summary.without_lens += report.refinements.size();
  if (!report.error) return;
  const std::string words = to_string(*report.error);
  if (summary.noted.insert(words).second) control.note(words);
}

/// Records a failure that affects the whole file.
void fail_with(Error error, const std::string& path, const JobControl& control, DetectSummary& summary) {
  if (error.place.source.empty()) error.place.source = path;
  control.note(to_string(error));
  ++summary.failed;
}

/// The image topics except those with depth images. Fails if the recording has no other.
Result<LogSelection> images_of(const MessageLog& log, const CameraFacts& facts) {
  LogSelection selection;
  for (const LogChannel& channel : log.channels()) {
    if (channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType)
      selection.topics.insert(channel.topic);
  }
  if (const auto depth = only_depth_images(facts)) return tl::unexpected(*depth);
  for (const RecordedView& view : facts.views)
    if (shows_distances(view)) selection.topics.erase(view.topic);
  if (!selection.topics.empty()) return selection;
  return fail(ErrorCode::NotFound, "this recording contains no images", {},
              "`waymark info` lists its contents.");
}

/// Selects the lens models for the images in a recording.
class RecordedLenses {
 public:
  RecordedLenses(const CameraFacts& facts, const LensChoice& choice) : given_(lens_given(choice)) {
    if (!given_.lens.known() && choice.use_recorded) cameras_ = image_cameras(facts);
  }
  [[nodiscard]] SourcedLens of(const std::string& camera) const {
    const auto found = cameras_.find(camera);
    return found == cameras_.end() ? given_
                                   : SourcedLens{ImageLens::of(found->second), LensSource::Recording};
  }

 private:
  SourcedLens given_;
  std::map<std::string, CameraModel> cameras_{};  ///< by camera name
};

/// Processes every image of the recording that is input number `index`. Returns whether to continue.
bool detect_recording(std::size_t index, const std::string& path, const TagFinder& finder,
                      const LensChoice& choice, const JobControl& control, const EachImage& each,
                      DetectSummary& summary) {
  const Result<std::unique_ptr<MessageLog>> log = open_recording(path, control);
  if (!log) {
    fail_with(log.error(), path, control, summary);
    return true;
  }
  const Result<RecordingSetup> setup = (*log)->setup();  // errors recur when the images are read
  const CameraFacts facts = setup ? setup->facts : CameraFacts();
  const Result<LogSelection> images = images_of(**log, facts);
  if (!images) {
    fail_with(images.error(), path, control, summary);
    return true;
  }
  for (const RecordedView& view : facts.views)
    if (view.image && shows_distances(view))
      control.note(fmt::format("note: depth images of {} are ignored", view.topic));
  const RecordedLenses lenses(facts, choice);
  bool going = true;
  const Status status = (*log)->visit_samples(*images, [&](const Sample& sample) -> Status {
    const auto* frame = std::get_if<CameraFrame>(&sample);
    if (frame == nullptr) return {};
    ImageReport report = report_on(path, frame->stamp, frame->image, finder, lenses.of(frame->camera));
    going = each(index, report, frame->image);
    summary.no_tags.add(frame->image, report.detections.size() + report.beyond_lens);
    count(report, control, summary);
    control.progress({fmt::format("{}, {} tags", report.image, report.detections.size())});
    summary.stopped = control.cancelled();
    going = going && !summary.stopped;
    return going ? Status{} : fail(ErrorCode::LimitExceeded, "stopped");
  });
  if (summary.stopped) control.note(fmt::format("stopped within {}", path));
  if (!status && going) fail_with(status.error(), path, control, summary);
  for (const LogProblem& problem : (*log)->problems())
    if (problem.kind == LogProblem::Kind::Damage) fail_with(problem.error, path, control, summary);
  return going;
}

/// Counts missing images as failures and prints other problems as notes.
void report_problems(const std::string& path, const VideoReader& reader, const JobControl& control,
                     DetectSummary& summary) {
  for (const VideoProblem& problem : reader.problems()) {
    if (problem.key == "video.damaged" || problem.key == "video.truncated")
      fail_with(problem.error, path, control, summary);
    else
      control.note(to_string(problem.error));
  }
}

/// The same for a video. Damage counts as one failure; other problems with the file are printed as notes.
bool detect_video(std::size_t index, const std::string& path, const TagFinder& finder,
                  const SourcedLens& lens, const JobControl& control, const EachImage& each,
                  DetectSummary& summary) {
  Result<VideoReader> reader = VideoReader::open(path);
  if (!reader) {
    ImageReport report{.image = path, .error = reader.error()};
    fail_with(reader.error(), path, control, summary);
    return each(index, report, {});
  }
  bool going = true;
  while (going) {
    const Result<std::optional<VideoFrame>> frame = reader->next();
    if (!frame) fail_with(frame.error(), path, control, summary);
    if (!frame || !*frame) break;
    ImageReport report = report_on(path, (*frame)->stamp, (*frame)->luma, finder, lens);
    going = each(index, report, (*frame)->luma);
    summary.no_tags.add((*frame)->luma, report.detections.size() + report.beyond_lens);
    count(report, control, summary);
    control.progress({fmt::format("{} {:.0f} %, {} tags", report.image, 100 * reader->progress(),
                                  report.detections.size())});
    summary.stopped = control.cancelled();
    going = going && !summary.stopped;
  }
  if (summary.stopped) control.note(fmt::format("stopped within {}", path));
  report_problems(path, *reader, control, summary);
  return going;
}

}  // namespace

DetectSummary detect_all(const std::vector<Input>& inputs, const TagFinder& finder, const LensChoice& lens,
                         const JobControl& control, const EachImage& each) {
  DetectSummary summary;
  bool going = true;
  for (std::size_t i = 0; i < inputs.size() && going; ++i) {
    summary.stopped = control.cancelled();
    if (summary.stopped) {
      control.note(fmt::format("stopped after {} of {} inputs", i, inputs.size()));
      break;
    }
    control.progress({inputs[i].path, i, inputs.size()});
    const FileKind kind = inputs[i].error ? FileKind::Unknown : kind_of(inputs[i].path);
    if (is_recording(kind)) {
      going = detect_recording(i, inputs[i].path, finder, lens, control, each, summary);
      continue;
    }
    if (kind == FileKind::Video) {
      going = detect_video(i, inputs[i].path, finder, lens_given(lens), control, each, summary);
      continue;
    }
    ImageReport report;
    const Image image = process(inputs[i], finder, lens_given(lens), report);
    going = each(i, report, image);
    if (report.detected) summary.no_tags.add(image, report.detections.size() + report.beyond_lens);
    count(report, control, summary);
  }
  if (summary.beyond_lens > 0) control.note("note: " + beyond_lens_note(summary.beyond_lens));
  if (summary.unreliable > 0) control.note("note: " + unreliable_note(summary.unreliable));
  return summary;
}

std::optional<NoTagReason> no_tag_reason(const DetectSummary& summary, const TagFinder& finder) {
  if (summary.stopped) return std::nullopt;
  return summary.no_tags.reason(finder.tracking.detector);
}

Result<TagFinder> described_finder(DetectorOptions options, const RefinementOptions& refinement,
                                   const std::vector<std::string>& families, bool refined) {
  for (const std::string& name : families) {
    auto id = parse_family(name);
    if (id) continue;
    id.error().place.key = "family";
    return tl::unexpected(std::move(id.error()));
  }
  if (!families.empty()) options.families = families;
  auto finder = make_tag_finder(options, refinement);
  if (finder && !refined) finder->refinement.reset();
  return finder;
}

}  // namespace waymark
