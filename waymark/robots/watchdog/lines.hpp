#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>

namespace waymark {

/// The longest line that a robot may send: a picture of a few megapixels as JPEG in base64.
inline constexpr std::size_t kLongestLine = std::size_t{1} << 22U;

/// A line without its end.
struct Line {
  std::int64_t number = 0;  ///< from 1
  std::string text{};
  bool too_long = false;  ///< `text` is only its beginning
};

/// Cuts bytes into lines as they come. Holds no more than the longest line, whatever comes.
class LineSplitter {
 public:
  explicit LineSplitter(std::size_t longest = kLongestLine) : longest_(longest) {}

  void add(std::string_view bytes);
  /// The oldest whole line that was not taken yet.
  [[nodiscard]] std::optional<Line> next();
  /// What came after the last line end, when nothing more will come.
  [[nodiscard]] std::optional<Line> rest();

 private:
  std::size_t longest_;
  std::string partial_{};
  bool too_long_ = false;
  std::deque<Line> ready_{};
  std::int64_t lines_ = 0;
};

/// Lines that wait to be written. When more than `most_bytes` wait the oldest are dropped, whole lines only.
class LineQueue {
 public:
  explicit LineQueue(std::size_t most_bytes = std::size_t{1} << 23U) : most_bytes_(most_bytes) {}

  /// `line` with its end.
  void push(std::string line);
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  /// What to write next.
  [[nodiscard]] std::string_view front() const { return std::string_view(lines_.front()).substr(written_); }
  /// So many bytes of front() were written.
  void pop(std::size_t bytes);
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

 private:
  std::size_t most_bytes_;
  std::deque<std::string> lines_{};
  std::size_t bytes_ = 0;
  std::size_t written_ = 0;  ///< of the first line
  std::int64_t dropped_ = 0;
};

}  // namespace waymark
