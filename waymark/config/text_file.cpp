#include "waymark/config/text_file.hpp"

#include <array>
#include <cerrno>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/types.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/base/error.hpp"

namespace waymark {
namespace {

/// Magic bytes of file types that are easily mistaken for text.
struct Beginning {
  std::string_view magic;
  std::string_view what;
  std::string_view hint;
};

constexpr std::string_view kRecordingHint =
    "`waymark info` shows its contents, `waymark map` makes a map from it.";
constexpr std::string_view kPackedHint = "Unpack it first: a plain text file is required.";
constexpr std::string_view kImageHint = "Give a text file here (YAML, JSON or CSV).";

std::optional<Beginning> no_text(std::string_view beginning) {
  using namespace std::string_view_literals;
  constexpr std::array<Beginning, 11> kBeginnings = {
      {{"\x89MCAP"sv, "a recording (MCAP)", kRecordingHint},
       {"#ROSBAG"sv, "a recording (a ROS 1 bag)", kRecordingHint},
       {"SQLite format 3"sv, "a recording (rosbag2)", kRecordingHint},
       {"\xED\xA1\xDA\x01"sv, "a recording (an LCM event log)", kRecordingHint},
       {"\x1F\x8B"sv, "packed (gzip)", kPackedHint},
       {"\x28\xB5\x2F\xFD"sv, "packed (zstd)", kPackedHint},
       {"\xFD\x37zXZ"sv, "packed (xz)", kPackedHint},
       {"PK\x03\x04"sv, "packed (zip)", kPackedHint},
       {"BZh"sv, "packed (bzip2)", kPackedHint},
       {"\xFF\xD8\xFF"sv, "an image (JPEG)", kImageHint},
       {"\x89PNG"sv, "an image (PNG)", kImageHint}}};
  for (const Beginning& known : kBeginnings)
    if (beginning.starts_with(known.magic)) return known;
  if (beginning.find('\0') != std::string_view::npos)
    return Beginning{"", "binary (it contains zero bytes)", "Give a text file here, in UTF-8."};
  return std::nullopt;
}

/// A file or a pipe opened for reading. A signal interrupts waiting for a pipe's writer.
class OpenFile {
 public:
  explicit OpenFile(int number) : number_(number) {}
  ~OpenFile() {
    if (number_ >= 0) ::close(number_);
  }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;
  [[nodiscard]] int number() const { return number_; }
  /// Like read(2), returns 0 at the end and -1 with errno on failure.
  [[nodiscard]] ssize_t read(char* into, std::size_t size) const {
    pollfd ready{.fd = number_, .events = POLLIN, .revents = 0};
    while (true) {
      if (::poll(&ready, 1, -1) < 0) return -1;
      const ssize_t got = ::read(number_, into, size);
      if (got >= 0 || errno != EAGAIN) return got;
    }
  }

 private:
  int number_;
};

/// If `text_only`, files that are not text are rejected.
Result<std::string> read(const std::filesystem::path& path, std::size_t max_bytes, bool text_only) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return fail(ErrorCode::NotFound, "there is no such file", {.source = path.string()}, "Check the path.");
  }
  if (std::filesystem::is_directory(status)) {
    return fail(ErrorCode::Unreadable, "this is a folder", {.source = path.string()}, "Give a file.");
  }
  // Opened in non-blocking mode, because opening a pipe without a writer would otherwise block forever.
  const OpenFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.number() < 0) {
    return fail(ErrorCode::Unreadable, "cannot open the file", {.source = path.string()},
                "Check its permissions.");
  }
  // Reading in blocks makes memory depend on the actual size; the size of a pipe is unknown.
  constexpr std::size_t kBlock = std::size_t{1} << 16U;
  std::string text;
  while (text.size() <= max_bytes) {
    const std::size_t before = text.size();
    text.resize(before + kBlock);
    const ssize_t got = file.read(text.data() + before, kBlock);
    if (got < 0) {
      const bool interrupted = errno == EINTR;
      return fail(ErrorCode::Unreadable,
                  interrupted ? "reading was interrupted"
                              : "reading failed: " + std::generic_category().message(errno),
                  {.source = path.string()});
    }
    text.resize(before + static_cast<std::size_t>(got));
    if (got == 0) break;
    if (before > 0 || !text_only) continue;
    if (const auto found = no_text(text))
      return fail(ErrorCode::Unreadable, fmt::format("this is {}, not text", found->what),
                  {.source = path.string()}, std::string(found->hint));
  }
  if (text.size() > max_bytes) {
    return fail(ErrorCode::LimitExceeded, fmt::format("the file exceeds the limit of {} bytes", max_bytes),
                {.source = path.string()}, "Is this the right file?");
  }
  return text;
}

}  // namespace

Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes) {
  return read(path, max_bytes, true);
}

Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  return read(path, max_bytes, false);
}

Status write_text_file(const std::filesystem::path& path, std::string_view text) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::is_directory(status))
    return fail(ErrorCode::Unwritable, "this is a folder", {.source = path.string()},
                "Give the name of a file.");
  // A device or a pipe is written to directly, because a rename would replace it.
  const bool direct = std::filesystem::exists(status) && !std::filesystem::is_regular_file(status);
  std::filesystem::path beside = path;
  if (!direct) beside += ".tmp";
  {
    errno = 0;
    std::ofstream file(beside, std::ios::binary | std::ios::trunc);
    file.write(text.data(), static_cast<std::streamsize>(text.size()));
    file.close();
    if (!file) {
      const std::error_code why(errno, std::generic_category());
      std::error_code ignored;
      if (!direct) std::filesystem::remove(beside, ignored);
      return fail(ErrorCode::Unwritable,
                  why ? "the file cannot be written: " + why.message() : "the file cannot be written",
                  {.source = path.string()}, write_hint(why.value(), path.parent_path().string()));
    }
  }
  if (direct) return {};
  std::filesystem::rename(beside, path, error);
  if (!error) return {};
  std::error_code ignored;
  std::filesystem::remove(beside, ignored);
  return fail(ErrorCode::Unwritable, fmt::format("cannot rename the written file: {}", error.message()),
              {.source = path.string()});
}

}  // namespace waymark
