#include "waymark/robots/wire/picture_ring.hpp"

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string_view>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>

namespace waymark {
namespace {

namespace fs = std::filesystem;
constexpr unsigned kNames = 10;
constexpr std::string_view kFolder = "waymark-pictures-";

/// The folders of processes that were killed: nobody else removes them.
void remove_abandoned(const fs::path& where) {
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(where, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kFolder)) continue;
    pid_t process = 0;
    const char* const end = name.data() + name.size();
    const auto [rest, error] = std::from_chars(name.data() + kFolder.size(), end, process);
    const bool of_process = error == std::errc{} && rest != end && *rest == '-' && process > 0;
    if (of_process && ::kill(process, 0) != 0 && errno == ESRCH) fs::remove_all(entry.path(), ignored);
  }
}

}  // namespace

Result<PictureRing> PictureRing::make() {
  std::error_code error;
  const fs::path memory = "/dev/shm";
  const fs::path where = fs::is_directory(memory, error) ? memory : fs::temp_directory_path(error);
  remove_abandoned(where);
  std::string name = (where / fmt::format("{}{}-XXXXXX", kFolder, ::getpid())).string();
  if (mkdtemp(name.data()) == nullptr)
    return fail(ErrorCode::Unwritable, "no folder for pictures can be made", {.source = where.string()});
  return PictureRing(fs::path(name));
}

PictureRing::~PictureRing() {
  std::error_code ignored;
  if (!folder_.empty()) fs::remove_all(folder_, ignored);
}

Result<std::string> PictureRing::put(std::span<const std::uint8_t> bytes) {
  const fs::path unfinished = folder_ / "next";
  const fs::path path = folder_ / fmt::format("{}.picture", next_++ % kNames);
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(unfinished.c_str(), "wb"),
                                                             &std::fclose);
  const bool written = file != nullptr &&
                       std::fwrite(bytes.data(), 1, bytes.size(), file.get()) == bytes.size() &&
                       std::fflush(file.get()) == 0;
  std::error_code error;
  if (written) fs::rename(unfinished, path, error);
  if (!written || error)
    return fail(ErrorCode::Unwritable, "a picture cannot be written", {.source = path.string()},
                "Is the memory full?");
  return path.string();
}

}  // namespace waymark
