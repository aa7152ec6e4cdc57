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

/// Text tables, read line by line in bounded memory.
namespace waymark::csv {

struct Line {
  std::string_view text{};  ///< without the line ending; valid until the next call
  std::uint64_t offset = 0;
  std::int64_t number = 0;  ///< 1-based
};

/// Reads lines that end in LF or CRLF. Memory use is the longest line, at most `max_line_bytes`.
class LineReader {
 public:
  LineReader(const ByteSource& source, std::uint64_t size, std::size_t max_line_bytes)
      : source_(source), size_(size), max_line_bytes_(max_line_bytes) {}
  /// The next line; empty at the end of the source or if it cannot be read. Longer lines are truncated.
  std::optional<Line> next();

 private:
  bool fill();
  /// Skips to the beginning of the next line.
  void skip_rest();

  const ByteSource& source_;
  std::uint64_t size_;
  std::size_t max_line_bytes_;
  std::uint64_t read_ = 0;  ///< bytes of the source read so far
  std::string window_;
  std::size_t at_ = 0;
  std::int64_t number_ = 0;
  bool cut_ = false;  ///< the last line was truncated, so its rest must be skipped
};

/// Splits a line into cells, without surrounding blanks or plain quotes.
void split(std::string_view line, std::vector<std::string_view>& cells);

/// A finite number; empty for any other text.
[[nodiscard]] std::optional<double> number(std::string_view cell);
[[nodiscard]] std::optional<std::int64_t> integer(std::string_view cell);
/// Converts decimal seconds to nanoseconds exactly; a double would round "1609357294.4184".
[[nodiscard]] std::optional<std::int64_t> seconds_as_ns(std::string_view cell);

// The kind of a table, recognised only from its column names (docs/formats/importing.md, "CSV").

enum class Kind : std::uint8_t {
  TagCorners,      ///< t, cam, tag, x0 … y3: BL, BR, TR, TL, pixel centres at integers (TagSLAM)
  Detections,      ///< t, camera, tag, tl_x_px … (Waymark)
  RangeBearing,    ///< t, landmark, range_m, bearing_rad
  Odometry,        ///< t, x_m, y_m, theta_rad, speed_m_s, yaw_rate_rad_s
  OdometrySpeeds,  ///< t, v_m_s, omega_rad_s, from which poses are integrated
  OdometryPoses,   ///< t, body, px … qw
  Imu,             ///< t, gyro_x_rad_s …, accel_x_m_s2 …
  Truth,           ///< t, x_m, y_m, theta_rad, valid
};

/// The columns of each kind, for error messages.
[[nodiscard]] std::string known_columns();
[[nodiscard]] std::string_view name_of(Kind kind);
/// The topic of a kind's samples in a Waymark recording.
[[nodiscard]] std::string_view topic_of(Kind kind);

/// Column positions of a table.
class Header {
 public:
  /// Fails if there are duplicate names or if the names match no kind; the error lists the supported kinds.
  static Result<Header> parse(std::string_view line, const std::string& source);

  [[nodiscard]] Kind kind() const { return kind_; }
  [[nodiscard]] std::size_t columns() const { return columns_; }
  /// Index of a column; optional columns may be missing.
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
  /// Time of a row in nanoseconds.
  [[nodiscard]] std::optional<std::int64_t> time(const std::vector<std::string_view>& cells) const;

 private:
  Kind kind_{};
  std::map<std::string, std::size_t, std::less<>> at_;
  std::size_t columns_ = 0;
  std::size_t time_ = 0;
  bool seconds_ = false;
};

/// Converts the rows of a table to samples.
class Rows {
 public:
  Rows(const Header& header, LogProblems& problems, const MessageLog::SampleVisitor& visit)
      : header_(header), problems_(problems), visit_(visit) {}
  /// False if a cell is invalid for its column; the row is then skipped.
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
  std::optional<TagFrame> frame_;         ///< rows for one image are consecutive
  std::set<std::string> cameras_now_;     ///< cameras with the same stamp as frame_
  SE2 odom_T_base_;                       ///< integrated from speeds
  std::optional<SensorTime> integrated_;  ///< stamp up to which speeds are integrated
};

}  // namespace waymark::csv

namespace waymark {

/// Whether the first bytes of a file are text whose first line contains column names.
[[nodiscard]] bool looks_like_csv(ByteSpan head);

/// Opens a table with named columns. Reads the whole file once, because a table has no index.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_csv_log(std::unique_ptr<ByteSource> source,
                                                               const LogOptions& options);

}  // namespace waymark
