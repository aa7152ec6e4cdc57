#include "waymark/recording/csv/csv_log.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include "waymark/geometry/planar.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark::csv {
namespace {

constexpr std::uint64_t kTextPiece = 1 << 18;
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

template <class T>
std::optional<T> parse(std::string_view cell) {
  if (cell.starts_with('+')) cell.remove_prefix(1);
  T value{};
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size()) return std::nullopt;
  return value;
}

}  // namespace

bool LineReader::fill() {
  const std::uint64_t want = std::min(kTextPiece, size_ - read_);
  if (want == 0) return false;
  window_.erase(0, at_);
  at_ = 0;
  const std::size_t old = window_.size();
  window_.resize(old + static_cast<std::size_t>(want));
  auto* begin = reinterpret_cast<std::uint8_t*>(window_.data()) + old;
  if (!source_.read(read_, std::span(begin, static_cast<std::size_t>(want)))) {
    window_.resize(old);
    size_ = read_;
    return false;
  }
  read_ += want;
  return true;
}

void LineReader::skip_rest() {
  cut_ = false;
  do {
    const std::size_t end = window_.find('\n', at_);
    at_ = end == std::string::npos ? window_.size() : end + 1;
    if (end != std::string::npos) return;
  } while (fill());
}

std::optional<Line> LineReader::next() {
  if (cut_) skip_rest();
  std::size_t end = window_.find('\n', at_);
  while (end == std::string::npos && window_.size() - at_ <= max_line_bytes_) {
    const std::size_t seen = window_.size() - at_;
    if (!fill()) break;
    end = window_.find('\n', at_ + seen);
  }
  if (end == std::string::npos && at_ == window_.size()) return std::nullopt;
  Line line{.offset = read_ - (window_.size() - at_), .number = ++number_};
  const std::size_t whole = (end == std::string::npos ? window_.size() : end) - at_;
  cut_ = whole > max_line_bytes_;
  const std::size_t size = std::min(whole, max_line_bytes_);
  line.text = std::string_view(window_).substr(at_, size);
  at_ += size + (end == std::string::npos || cut_ ? 0 : 1);
  if (line.text.ends_with('\r')) line.text.remove_suffix(1);
  return line;
}

void split(std::string_view line, std::vector<std::string_view>& cells) {
  cells.clear();
  for (bool more = true; more;) {
    const std::size_t comma = line.find(',');
    more = comma != std::string_view::npos;
    std::string_view cell = line.substr(0, comma);
    if (more) line.remove_prefix(comma + 1);
    while (!cell.empty() && (cell.front() == ' ' || cell.front() == '\t')) cell.remove_prefix(1);
    while (!cell.empty() && (cell.back() == ' ' || cell.back() == '\t')) cell.remove_suffix(1);
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = cell.substr(1, cell.size() - 2);
    cells.push_back(cell);
  }
}

std::optional<double> number(std::string_view cell) {
  const auto value = parse<double>(cell);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::optional<std::int64_t> integer(std::string_view cell) { return parse<std::int64_t>(cell); }

std::optional<std::int64_t> seconds_as_ns(std::string_view cell) {
  constexpr std::int64_t kMaxSeconds = 4'000'000'000;
  const std::size_t point = std::min(cell.find('.'), cell.size());
  const auto whole = integer(cell.substr(0, point));
  std::string_view fraction = cell.substr(std::min(point + 1, cell.size()));
  const bool plain = whole && *whole <= kMaxSeconds && *whole >= -kMaxSeconds &&
                     std::ranges::all_of(fraction, [](char c) { return c >= '0' && c <= '9'; });
  if (plain) {
    fraction = fraction.substr(0, 9);
    std::int64_t ns = 0;
    for (std::size_t i = 0; i < 9; ++i) ns = 10 * ns + (i < fraction.size() ? fraction[i] - '0' : 0);
    return *whole * kNanosecondsPerSecond + (cell.starts_with('-') ? -ns : ns);
  }
  const auto seconds = number(cell);
  if (!seconds || std::abs(*seconds) > static_cast<double>(kMaxSeconds)) return std::nullopt;
  return std::llround(*seconds * static_cast<double>(kNanosecondsPerSecond));
}

namespace {

struct Layout {
  Kind kind;
  std::string_view name;
  std::string_view topic;
  std::vector<std::string_view> columns;
};

/// The first layout whose columns are all present is used.
const std::vector<Layout>& layouts() {
  static const std::vector<Layout> kLayouts = {
      {Kind::TagCorners,
       "tag corners",
       "/tag_detections",
       {"cam", "tag", "x0", "y0", "x1", "y1", "x2", "y2", "x3", "y3"}},
      {Kind::Detections,
       "detections",
       "/tag_detections",
       {"camera", "tag", "tl_x_px", "tl_y_px", "tr_x_px", "tr_y_px", "br_x_px", "br_y_px", "bl_x_px",
        "bl_y_px"}},
      {Kind::RangeBearing, "range and bearing", "/range_bearing", {"landmark", "range_m", "bearing_rad"}},
      {Kind::Odometry, "odometry", "/odom", {"x_m", "y_m", "theta_rad", "speed_m_s", "yaw_rate_rad_s"}},
      {Kind::OdometrySpeeds, "odometry speeds", "/odom", {"v_m_s", "omega_rad_s"}},
      {Kind::OdometryPoses, "odometry poses", "/odom", {"body", "px", "py", "pz", "qx", "qy", "qz", "qw"}},
      {Kind::Imu,
       "inertial measurements",
       "/imu",
       {"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2", "accel_z_m_s2"}},
      {Kind::Truth, "ground truth poses", "/truth/pose", {"x_m", "y_m", "theta_rad", "valid"}}};
  return kLayouts;
}

const Layout& layout(Kind kind) { return *std::ranges::find(layouts(), kind, &Layout::kind); }

}  // namespace

std::string known_columns() {
  std::string text;
  for (const Layout& one : layouts())
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", one.name, fmt::join(one.columns, ","));
  return text;
}

std::string_view name_of(Kind kind) { return layout(kind).name; }
std::string_view topic_of(Kind kind) { return layout(kind).topic; }

Result<Header> Header::parse(std::string_view line, const std::string& source) {
  if (line.starts_with("\xEF\xBB\xBF")) line.remove_prefix(3);
  std::vector<std::string_view> names;
  split(line, names);
  Header header;
  header.columns_ = names.size();
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!header.at_.try_emplace(std::string(names[i]), i).second)
      return fail(ErrorCode::Unreadable, fmt::format("duplicate column '{}'", names[i]),
                  {.source = source, .line = 1});
  }
  const auto ns = header.find("t_ns");
  const auto s = header.find("t_s");
  if (!ns && !s)
    return fail(ErrorCode::Unsupported, "no time column", {.source = source, .line = 1},
                "Name it t_ns (nanoseconds) or t_s (seconds).");
  header.time_ = ns ? *ns : *s;
  header.seconds_ = !ns;
  for (const Layout& one : layouts()) {
    const bool fits = std::ranges::all_of(
        one.columns, [&](std::string_view name) { return header.find(name).has_value(); });
    // A pose with a covariance is an estimate, not a measurement.
    if (!fits || (one.kind == Kind::OdometryPoses && header.find("cov0"))) continue;
    header.kind_ = one.kind;
    return header;
  }
  return fail(ErrorCode::Unsupported, "unknown table columns", {.source = source, .line = 1},
              "Known columns besides t_ns or t_s: " + known_columns() + ".");
}

std::optional<std::size_t> Header::find(std::string_view name) const {
  const auto it = at_.find(name);
  return it == at_.end() ? std::nullopt : std::optional(it->second);
}

std::optional<std::int64_t> Header::time(const std::vector<std::string_view>& cells) const {
  // Prevents overflow of the difference between two stamps.
  constexpr std::int64_t kMaxNanoseconds = std::numeric_limits<std::int64_t>::max() / 2;
  const auto ns = seconds_ ? seconds_as_ns(cells[time_]) : integer(cells[time_]);
  return ns && *ns >= -kMaxNanoseconds && *ns <= kMaxNanoseconds ? ns : std::nullopt;
}

namespace {

constexpr double kHalf = 0.5;  // offset from the pixel centres in TagSLAM's bags (and ROS) to Waymark's

Error csv_error(std::string message) { return {ErrorCode::Unsupported, std::move(message), {}, {}}; }

/// "tag36h11:7", or the id of a tag36h11 tag.
std::optional<TagId> tag_of(std::string_view cell) {
  if (const auto number = integer(cell)) {
    if (*number < 0 || *number > 1'000'000) return std::nullopt;
    return TagId{FamilyId::Tag36h11, static_cast<int>(*number)};
  }
  const auto tag = parse_tag_id(cell);
  return tag ? std::optional(*tag) : std::nullopt;
}

}  // namespace

std::optional<double> Rows::value(std::string_view column, const std::vector<std::string_view>& cells) const {
  const auto at = header_.find(column);
  return at ? number(cells[*at]) : std::nullopt;
}

bool Rows::values(std::initializer_list<const char*> columns, const std::vector<std::string_view>& cells) {
  values_.clear();
  for (const char* column : columns) {
    const auto one = value(column, cells);
    if (!one) return false;
    values_.push_back(*one);
  }
  return true;
}

Result<bool> Rows::give(const Sample& sample) {
  if (Status status = visit_(sample); !status) return tl::unexpected(status.error());
  return true;
}

Status Rows::finish() {
  if (!frame_) return {};
  const Sample sample = *std::move(frame_);
  frame_.reset();
  return visit_(sample);
}

Result<bool> Rows::add(std::int64_t time, const std::vector<std::string_view>& cells) {
  const SensorTime stamp{Duration(time)};
  switch (header_.kind()) {
    case Kind::TagCorners:
    case Kind::Detections:
      return on_detection(stamp, cells);
    case Kind::RangeBearing: {
      const auto landmark = integer(cells[*header_.find("landmark")]);
      if (!landmark || !values({"range_m", "bearing_rad"}, cells)) return false;
      return give(RangeBearing{stamp, *landmark, values_[0], values_[1]});
    }
    case Kind::Odometry:
    case Kind::OdometrySpeeds:
    case Kind::OdometryPoses:
      return on_odometry(stamp, cells);
    case Kind::Imu:
      if (!values({"gyro_x_rad_s", "gyro_y_rad_s", "gyro_z_rad_s", "accel_x_m_s2", "accel_y_m_s2",
                   "accel_z_m_s2"},
                  cells))
        return false;
      return give(
          ImuSample{stamp, {values_[0], values_[1], values_[2]}, {values_[3], values_[4], values_[5]}});
    case Kind::Truth:
      return on_truth(stamp, cells);
  }
  return false;
}

Result<bool> Rows::on_detection(SensorTime stamp, const std::vector<std::string_view>& cells) {
  const bool ours = header_.kind() == Kind::Detections;
  const std::string camera(cells[*header_.find(ours ? "camera" : "cam")]);
  const auto tag = tag_of(cells[*header_.find("tag")]);
  const bool corners =
      ours ? values({"tl_x_px", "tl_y_px", "tr_x_px", "tr_y_px", "br_x_px", "br_y_px", "bl_x_px", "bl_y_px"},
                    cells)
           : values({"x3", "y3", "x2", "y2", "x1", "y1", "x0", "y0"}, cells);
  if (!tag || !corners) return false;
  TagDetection detection{.tag = *tag};
  for (std::size_t i = 0; i < 4; ++i) {
    detection.corners_px[i] = {values_[2 * i], values_[2 * i + 1]};
    if (!ours) detection.corners_px[i] += Eigen::Vector2d::Constant(kHalf);
  }
  if (!ours)
    problems_.trap("csv.tag_corners", [] {
      return csv_error(
          "corners are taken as BL, BR, TR, TL with pixel centres at integers, tags without a family as "
          "tag36h11");
    });
  if (const auto at = header_.find("hamming")) {
    const auto hamming = integer(cells[*at]);
    if (!hamming || *hamming < 0 || *hamming > 64) return false;
    detection.hamming = static_cast<int>(*hamming);
  }
  detection.decision_margin = value("decision_margin", cells).value_or(0);

  const bool same_time = frame_ && frame_->stamp == stamp;
  if (!same_time || frame_->camera != camera) {
    if (Status status = finish(); !status) return tl::unexpected(status.error());
    if (!same_time) cameras_now_.clear();
    if (!cameras_now_.insert(camera).second)
      problems_.trap("csv.frame_in_pieces", [] {
        return csv_error(
            "rows of one image are not consecutive; each group of consecutive rows is read as a frame");
      });
    frame_ = TagFrame{.stamp = stamp, .camera = camera.empty() ? "cam" : camera};
  }
  frame_->detections.push_back(detection);
  return true;
}

Result<bool> Rows::on_odometry(SensorTime stamp, const std::vector<std::string_view>& cells) {
  if (header_.kind() == Kind::Odometry) {
    if (!values({"x_m", "y_m", "theta_rad", "speed_m_s", "yaw_rate_rad_s"}, cells)) return false;
    return give(Odometry{stamp, SE2(values_[0], values_[1], values_[2]), values_[3], values_[4]});
  }
  if (header_.kind() == Kind::OdometryPoses) {
    if (!values({"px", "py", "pz", "qx", "qy", "qz", "qw"}, cells)) return false;
    const Eigen::Quaterniond q(values_[6], values_[3], values_[4], values_[5]);
    if (std::abs(q.norm() - 1) > 0.01) return false;
    problems_.trap("csv.flattened", [] {
      return csv_error("3D poses are projected onto the floor; x, y and heading are kept");
    });
    const SE3 pose(SO3::from_matrix(q.normalized().toRotationMatrix()), {values_[0], values_[1], values_[2]});
    return give(Odometry{.stamp = stamp, .odom_T_base = project_to_plane(pose)});
  }
  if (!values({"v_m_s", "omega_rad_s"}, cells)) return false;
  problems_.trap("csv.integrated", [] {
    return csv_error(
        "the table has no poses; they are integrated from 0, each speed over the preceding interval");
  });
  const double dt = integrated_ ? std::max(0.0, to_seconds(stamp - *integrated_)) : 0;
  const Eigen::Vector3d step(values_[0] * dt, 0, values_[1] * dt);
  odom_T_base_ = odom_T_base_ * SE2::exp(step);
  integrated_ = stamp;
  return give(Odometry{stamp, odom_T_base_, values_[0], values_[1]});
}

Result<bool> Rows::on_truth(SensorTime stamp, const std::vector<std::string_view>& cells) {
  const auto valid = integer(cells[*header_.find("valid")]);
  if (!valid || !values({"x_m", "y_m", "theta_rad"}, cells)) return false;
  if (*valid == 0) {
    problems_.trap("csv.truth_not_valid", [] { return csv_error("rows marked invalid are skipped"); });
    return true;
  }
  return give(TruthPose{stamp, lift(SE2(values_[0], values_[1], values_[2]))});
}

}  // namespace waymark::csv

namespace waymark {
namespace {

constexpr std::size_t kMaxLine = 1 << 20;

class CsvLog final : public MessageLog {
 public:
  CsvLog(std::unique_ptr<ByteSource> source, std::uint64_t size, csv::Header header, std::string_view names)
      : source_(std::move(source)), size_(size), header_(std::move(header)) {
    channels_.push_back({.topic = std::string(csv::topic_of(header_.kind())),
                         .type = fmt::format("csv/{}", csv::name_of(header_.kind())),
                         .encoding = "csv",
                         .schema_encoding = "csv",
                         .schema = std::string(names),
                         .messages = 0});
    std::optional<std::uint64_t> last;
    LogProblems& problems = opened_;
    (void)visit_rows({}, problems, [&](std::int64_t time, const csv::Line& line, const auto&) -> Status {
      const std::uint64_t log_time = clamped(time);
      ++*channels_[0].messages;
      if (last && log_time < *last)
        problems.trap("csv.time_back", [&] {
          return Error{
              ErrorCode::Unreadable, "time goes backward here; rows are kept in file order", place(line), {}};
        });
      last = log_time;
      start_ = std::min(start_.value_or(log_time), log_time);
      end_ = std::max(end_.value_or(log_time), log_time);
      return {};
    });
  }

  LogFormat format() const override { return LogFormat::Csv; }
  std::string description() const override { return fmt::format("CSV, {}", csv::name_of(header_.kind())); }
  const std::vector<LogChannel>& channels() const override { return channels_; }
  LogSummary summary() const override {
    return {.start = start_,
            .end = end_,
            .messages = channels_[0].messages,
            .size_bytes = size_,
            .files = {source_->name()}};
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    LogProblems known;
    return visit_rows(selection, known, [&](std::int64_t time, const csv::Line& line, const auto&) {
      return visit(channels_[0], {clamped(time), clamped(time), as_bytes(line.text)});
    });
  }

  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    visited_.clear();
    LogProblems known;
    csv::Rows rows(header_, visited_, visit);
    Status status = visit_rows(selection, known,
                               [&](std::int64_t time, const csv::Line& line, const auto& cells) -> Status {
                                 const Result<bool> taken = rows.add(time, cells);
                                 if (!taken) return tl::unexpected(taken.error());
                                 if (!*taken) note_row(line, visited_);
                                 return {};
                               });
    return status ? rows.finish() : status;
  }

  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& /*choice*/) override {
    RecordingSetup setup;
    for (const LogProblem& problem : problems()) setup.problems.push_back(problem.error);
    return setup;
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  static std::uint64_t clamped(std::int64_t time) {
    return static_cast<std::uint64_t>(std::max<std::int64_t>(0, time));
  }
  [[nodiscard]] Place place(const csv::Line& line) const {
    return {.source = source_->name(), .line = line.number, .byte = static_cast<std::int64_t>(line.offset)};
  }
  void note_row(const csv::Line& line, LogProblems& problems) const {
    problems.damage("csv.row", [&] {
      return Error{ErrorCode::Unreadable, "row with invalid cells; skipped", place(line), {}};
    });
  }

  template <class Visit>
  Status visit_rows(const LogSelection& selection, LogProblems& problems, const Visit& visit) {
    if (!selection.takes(channels_[0].topic)) return {};
    csv::LineReader lines(*source_, size_, kMaxLine);
    std::vector<std::string_view> cells;
    (void)lines.next();  // column names
    while (const auto line = lines.next()) {
      if (line->text.empty() || line->text.starts_with('#')) continue;
      csv::split(line->text, cells);
      const auto time = cells.size() == header_.columns() ? header_.time(cells) : std::nullopt;
      if (!time) {
        note_row(*line, problems);
        continue;
      }
      if (!selection.takes(clamped(*time))) continue;
      if (Status status = visit(*time, *line, cells); !status) return status;
    }
    return {};
  }

  std::unique_ptr<ByteSource> source_;
  std::uint64_t size_;
  csv::Header header_;
  std::vector<LogChannel> channels_;
  std::optional<std::uint64_t> start_;
  std::optional<std::uint64_t> end_;
  LogProblems opened_;
  LogProblems visited_;
};

}  // namespace

bool looks_like_csv(ByteSpan head) {
  const std::string_view text = as_text(head);
  const std::string_view line = text.substr(0, text.find('\n'));
  const bool printable = std::ranges::all_of(
      line, [](char c) { return static_cast<unsigned char>(c) >= ' ' || c == '\t' || c == '\r'; });
  return printable && line.find(',') != std::string_view::npos;
}

Result<std::unique_ptr<MessageLog>> open_csv_log(std::unique_ptr<ByteSource> source,
                                                 const LogOptions& /*options*/) {
  const Result<std::uint64_t> size = source->size();
  if (!size) return tl::unexpected(size.error());
  csv::LineReader lines(*source, *size, kMaxLine);
  const auto first = lines.next();
  if (!first) return fail(ErrorCode::Unreadable, "the table is empty", {.source = source->name()});
  Result<csv::Header> header = csv::Header::parse(first->text, source->name());
  if (!header) return tl::unexpected(header.error());
  const std::string names(first->text);
  return std::make_unique<CsvLog>(std::move(source), *size, std::move(*header), names);
}

}  // namespace waymark
