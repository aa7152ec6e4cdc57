#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/message_log.hpp"

/// Tables as text, read line by line so that a long one needs no memory.
namespace waymark::csv {

struct Line {
  std::string_view text{};  ///< without its end; gone with the next call
  std::uint64_t offset = 0;
  std::int64_t number = 0;  ///< 1-based
};

/// Lines that end in LF or CRLF; memory: the longest line, at most `max_line_bytes` of it.
class LineReader {
 public:
  LineReader(const ByteSource& source, std::uint64_t size, std::size_t max_line_bytes)
      : source_(source), size_(size), max_line_bytes_(max_line_bytes) {}
  /// Nothing at the end, or where the source cannot be read. A longer line is cut.
  std::optional<Line> next();

 private:
  bool fill();
  /// To the beginning of the next line.
  void skip_rest();

  const ByteSource& source_;
  std::uint64_t size_;
  std::size_t max_line_bytes_;
  std::uint64_t read_ = 0;  ///< bytes of the source taken so far
  std::string window_;
  std::size_t at_ = 0;
  std::int64_t number_ = 0;
  bool cut_ = false;  ///< the last line: its rest is still to be passed over
};

/// The cells of a line, blanks and plain quotes around them dropped.
void split(std::string_view line, std::vector<std::string_view>& cells);

/// A finite number; nothing for anything else.
[[nodiscard]] std::optional<double> number(std::string_view cell);
[[nodiscard]] std::optional<std::int64_t> integer(std::string_view cell);
/// Seconds as written, to the nanosecond: "1609357294.4184" loses nothing, as a double would.
[[nodiscard]] std::optional<std::int64_t> seconds_as_ns(std::string_view cell);

// What a table with named columns holds, told by the names alone (docs/formats/importing.md, "CSV").

enum class Kind : std::uint8_t {
  TagCorners,      ///< t, cam, tag, x0 … y3: BL, BR, TR, TL, pixel centres at integers (TagSLAM)
  Detections,      ///< t, camera, tag, tl_x_px …: ours
  RangeBearing,    ///< t, landmark, range_m, bearing_rad
  Odometry,        ///< t, x_m, y_m, theta_rad, speed_m_s, yaw_rate_rad_s
  OdometrySpeeds,  ///< t, v_m_s, omega_rad_s: poses are integrated
  OdometryPoses,   ///< t, body, px … qw
  Imu,             ///< t, gyro_x_rad_s …, accel_x_m_s2 …
  Truth,           ///< t, x_m, y_m, theta_rad, valid
};

/// The words of the columns of each kind, for error messages.
[[nodiscard]] std::string known_columns();
[[nodiscard]] std::string_view name_of(Kind kind);
/// Where samples of a kind go in a recording of ours.
[[nodiscard]] std::string_view topic_of(Kind kind);

/// Where the columns of a kind stand.
class Header {
 public:
  /// Fails, naming what is known, when the names are those of no kind, or one stands twice.
  static Result<Header> parse(std::string_view line, const std::string& source);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] std::size_t columns() const { return columns_; }
  /// Where a column stands; one the kind does not need may be missing.
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
  /// [ns]
  [[nodiscard]] std::optional<std::int64_t> time(const std::vector<std::string_view>& cells) const;

 private:
  Kind kind_{};
  std::map<std::string, std::size_t, std::less<>> at_;
  std::size_t columns_ = 0;
  std::size_t time_ = 0;
  bool seconds_ = false;
};

/// Turns the rows of a table into samples.
class Rows {
 public:
  Rows(const Header& header, LogProblems& problems, const MessageLog::SampleVisitor& visit)
      : header_(header), problems_(problems), visit_(visit) {}
  /// False when a cell is not what its column needs; nothing is visited then.
  Result<bool> add(std::int64_t time, const std::vector<std::string_view>& cells);
  Status finish();

 private:
  std::optional<double> value(std::string_view column, const std::vector<std::string_view>& cells) const;
  bool values(std::initializer_list<const char*> columns, const std::vector<std::string_view>& cells);
  Result<bool> on_detection(SensorTime stamp, const std::vector<std::string_view>& cells);
  Result<bool> on_odometry(SensorTime stamp, const std::vector<std::string_view>& cells);
  Result<bool> on_truth(SensorTime stamp, const std::vector<std::string_view>& cells);
  Result<bool> give(const Sample& sample);

  Header header_;
  LogProblems& problems_;
  const MessageLog::SampleVisitor& visit_;
  std::vector<double> values_;
  std::optional<TagFrame> frame_;         ///< rows of one picture follow each other
  std::set<std::string> cameras_now_;     ///< with the stamp of frame_
  SE2 odom_T_base_;                       ///< integrated
  std::optional<SensorTime> integrated_;  ///< until then
};

}  // namespace waymark::csv

namespace waymark {

/// Whether the first bytes of a file are text whose first line names columns.
[[nodiscard]] bool looks_like_csv(ByteSpan head);

/// A table with named columns. Opening reads it once: there is no index.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_csv_log(std::unique_ptr<ByteSource> source,
                                                               const LogOptions& options);

}  // namespace waymark
