#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_file.hpp"

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

}  // namespace waymark::csv
