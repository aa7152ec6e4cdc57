#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"

/// Thin POSIX wrappers for both ends of a pipe.
namespace waymark {

/// The computer's steady clock, which is the same in every process.
[[nodiscard]] Duration steady_now();

/// Owns a file descriptor; the destructor closes it.
class Descriptor {
 public:
  explicit Descriptor(int number = -1) : number_(number) {}
  ~Descriptor() { close(); }
  Descriptor(Descriptor&& other) noexcept : number_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] bool open() const { return number_ >= 0; }
  int release();
  void close();

 private:
  int number_;
};

/// Makes the descriptor non-blocking.
void never_wait(int descriptor);

enum class Moved : unsigned char { Some, Nothing, Ended };

/// Appends the available data, up to 64 KiB, to `bytes`.
[[nodiscard]] Moved read_some(int descriptor, std::string& bytes);
/// Writes as much as possible without blocking and stores the count in `written`. Ended means that the reader
/// has disconnected.
[[nodiscard]] Moved write_some(int descriptor, std::string_view bytes, std::size_t& written);
/// Whether the other end has read everything that was written; true if the system cannot report this.
[[nodiscard]] bool all_read(int descriptor);

/// A process with pipes at its standard input and output. It has its own process group, so Ctrl-C in the
/// terminal does not reach it.
struct Spawned {
  pid_t pid = -1;
  Descriptor to;    ///< to its standard input; non-blocking
  Descriptor from;  ///< from its standard output; non-blocking
};
[[nodiscard]] Result<Spawned> spawn(const std::vector<std::string>& words);

/// The status of a process that has ended, as returned by waitpid(); `nullopt` while it is running.
[[nodiscard]] std::optional<int> wait_status(pid_t pid);
/// Text such as "exit code 3" or "signal 9 (Killed)". Exit codes above 128 are 128 + signal, as in a shell.
[[nodiscard]] std::string ending_words(int exit_code);
/// The exit code, or 128 + signal.
[[nodiscard]] int exit_code_of(int wait_status);

/// Maximum length of a line from a robot, enough for an image of a few megapixels as JPEG in base64.
inline constexpr std::size_t kLongestLine = std::size_t{1} << 22U;

/// A line without its newline.
struct Line {
  std::int64_t number = 0;  ///< line number, starting at 1
  std::string text{};
  bool too_long = false;  ///< whether `text` is truncated
};

/// Splits a byte stream into lines. Buffers at most one incomplete line of maximum length.
class LineSplitter {
 public:
  explicit LineSplitter(std::size_t longest = kLongestLine) : longest_(longest) {}

  void add(std::string_view bytes);
  /// The next complete line.
  [[nodiscard]] std::optional<Line> next();
  /// The text after the last newline, at the end of the stream.
  [[nodiscard]] std::optional<Line> rest();

 private:
  std::size_t longest_;
  std::string partial_{};
  bool too_long_ = false;
  std::deque<Line> ready_{};
  std::int64_t lines_ = 0;
};

/// A queue of lines to write. If it exceeds `max_bytes`, the oldest lines are dropped, each as a whole.
class LineQueue {
 public:
  explicit LineQueue(std::size_t max_bytes = std::size_t{1} << 23U) : max_bytes_(max_bytes) {}

  /// `line` includes its newline.
  void push(std::string line);
  [[nodiscard]] bool empty() const { return lines_.empty(); }
  /// The bytes to write next.
  [[nodiscard]] std::string_view front() const { return std::string_view(lines_.front()).substr(written_); }
  /// Removes the first `bytes` bytes of front(), which have been written.
  void pop(std::size_t bytes);
  [[nodiscard]] std::int64_t dropped() const { return dropped_; }

 private:
  std::size_t max_bytes_;
  std::deque<std::string> lines_{};
  std::size_t bytes_ = 0;
  std::size_t written_ = 0;  ///< number of bytes of the first line already written
  std::int64_t dropped_ = 0;
};

}  // namespace waymark
