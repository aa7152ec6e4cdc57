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

/// The little of POSIX that both ends of the wire need.
namespace waymark {

/// The machine's steady clock: the same in every process.
[[nodiscard]] Duration steady_now();

/// A file descriptor that is closed at the end.
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

/// Reading from it and writing to it never wait from now on.
void never_wait(int descriptor);

enum class Moved : unsigned char { Some, Nothing, Ended };

/// Whatever is there to be read, up to 64 KiB, appended to `bytes`.
[[nodiscard]] Moved read_some(int descriptor, std::string& bytes);
/// Writes what fits; says how much in `written`. Ended: nobody reads any more.
[[nodiscard]] Moved write_some(int descriptor, std::string_view bytes, std::size_t& written);
/// Whether the other end has read everything that was written; true where the system cannot say.
[[nodiscard]] bool all_read(int descriptor);

/// A process with pipes at its standard input and output, in a process group of its own, so that Ctrl-C at
/// the terminal is not its affair.
struct Spawned {
  pid_t pid = -1;
  Descriptor to;    ///< its standard input; never waits
  Descriptor from;  ///< its standard output; never waits
};
[[nodiscard]] Result<Spawned> spawn(const std::vector<std::string>& words);

/// How it ended; nothing while it runs.
[[nodiscard]] std::optional<int> wait_status(pid_t pid);
/// "exit code 3", "signal 9 (Killed)". Exit codes from 129 on are the signal of a shell's child.
[[nodiscard]] std::string ending_words(int exit_code);
/// 0 to 255; 128 + the signal.
[[nodiscard]] int exit_code_of(int wait_status);

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
