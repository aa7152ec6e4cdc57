// Tests that memory for writing and reading does not grow with the recording. This is a separate binary,
// because a child process inherits the memory footprint of the tests that ran before it.
#include <cstdlib>
#include <filesystem>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/sanitized.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
constexpr std::size_t kImage = 640 * 480;

/// Writes images at 30 Hz and reads them back by index. Runs in its own process.
bool write_and_read(const std::filesystem::path& path, std::uint64_t bytes) {
  const std::uint64_t count = bytes / kImage;
  {
    auto file = create_file(path);
    if (!file) return false;
    auto writer = Writer::open(std::move(*file), {.compression = Compression::None});
    const auto channel = writer->add_channel("/image_raw", 0, "");
    Bytes image(kImage);
    for (std::uint64_t i = 0; i < count; ++i) {
      image[i % kImage] = static_cast<std::uint8_t>(i);
      if (!writer->write(*channel, i * 33'333'333, 0, image)) return false;
    }
    if (!writer->close()) return false;
  }
  const auto source = open_file(path);
  const auto index = read_index(**source);
  std::uint64_t read = 0;
  const Status status = visit_messages(**source, *index, {}, [&](const Channel&, const Message& message) {
    read += message.data.bytes.size() == kImage ? 1U : 0U;
    return Status{};
  });
  return status && index->from_summary && read == count;
}

/// Peak memory of such a process in KiB.
std::int64_t peak_kib(const std::filesystem::path& path, std::uint64_t bytes) {
  const pid_t child = fork();
  if (child == 0) _exit(write_and_read(path, bytes) ? 0 : 1);
  int status = 0;
  rusage usage{};
  EXPECT_EQ(wait4(child, &status, 0, &usage), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  std::filesystem::remove(path);
  return usage.ru_maxrss;
}

#if defined(WAYMARK_SANITIZED)
constexpr bool kMemoryIsOurs = false;  // the sanitizer retains freed memory to detect its use
#else
constexpr bool kMemoryIsOurs = true;
#endif

TEST(McapMemory, DoesNotGrowWithTheRecording) {
  if (!kMemoryIsOurs) GTEST_SKIP() << "the address sanitizer retains freed memory";
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const std::uint64_t small = full ? 100 * kMiB : 16 * kMiB;
  const std::uint64_t large = full ? 10 * 1024 * kMiB : 160 * kMiB;
  const auto folder = testing::fresh_folder("memory");
  const std::int64_t small_kib = peak_kib(folder / "small.mcap", small);
  const std::int64_t large_kib = peak_kib(folder / "large.mcap", large);
  RecordProperty("small_kib", std::to_string(small_kib));
  RecordProperty("large_kib", std::to_string(large_kib));
  // There is one index entry per 1 MiB chunk, so a recording 100 times as large needs hardly more memory.
  EXPECT_LE(large_kib - small_kib, full ? 8 * 1024 : 1024);
  EXPECT_LE(large_kib, 64 * 1024);
}

}  // namespace
}  // namespace waymark::mcap
