// Recordings whose writer was killed, whose disk was full, or that were truncated.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/base/random.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/recover.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kStep = kSecond / 50;

std::uint64_t time_of(std::uint64_t number) { return 5 * kSecond + number * kStep; }

/// The content of message `number`, deterministic: 50 messages per second, 0 to 4 KiB each.
Bytes data_of(std::uint64_t number) {
  Random random(number);
  Bytes data(random.index(4096));
  for (std::size_t i = 0; i < data.size(); i += 7) data[i] = static_cast<std::uint8_t>(random.index(256));
  return data;
}

Result<Writer> start(const fs::path& path, const WriterOptions& options) {
  auto file = create_file(path);
  if (!file) return tl::unexpected(file.error());
  Result<Writer> writer = Writer::open(std::move(*file), options);
  if (writer) (void)writer->add_channel("/x", 0, "");
  return writer;
}

/// Checks that the file contains messages 0, 1, 2, … with their bytes, and returns how many there are.
std::uint64_t whole_messages(const fs::path& path, bool from_summary) {
  const auto source = open_file(path);
  EXPECT_TRUE(source);
  const auto index = read_index(**source);
  EXPECT_TRUE(index) << to_string(index.error());
  if (!index) return 0;
  EXPECT_EQ(index->from_summary, from_summary);
  std::uint64_t next = 0;
  const Status status = visit_messages(**source, *index, {}, [&](const Channel&, const Message& message) {
    EXPECT_EQ(message.log_time, time_of(next));
    EXPECT_EQ(message.sequence, next);
    const Bytes data = data_of(next++);
    EXPECT_TRUE(std::ranges::equal(message.data.bytes, data));
    return Status{};
  });
  EXPECT_TRUE(status) << to_string(status.error());
  EXPECT_EQ(index->statistics.message_count, next);
  return next;
}

/// Memory shared between two processes.
struct Shared {
  std::atomic<std::uint64_t>* taken = nullptr;  ///< number of messages whose write() has returned
  Shared() {
    void* memory = mmap(nullptr, sizeof(*taken), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    taken = new (memory) std::atomic<std::uint64_t>(0);
  }
  ~Shared() { munmap(taken, sizeof(*taken)); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
};

/// Records in a child process and kills it once `enough` messages have been accepted. Returns the number of
/// accepted messages.
std::uint64_t record_until_killed(const fs::path& path, const WriterOptions& options, std::uint64_t enough) {
  const Shared shared;
  const pid_t child = fork();
  if (child == 0) {
    Result<Writer> writer = start(path, options);
    for (std::uint64_t i = 0; writer && writer->write(1, time_of(i), time_of(i), data_of(i)); ++i)
      shared.taken->store(i + 1);
    _exit(1);
  }
  int status = 0;
  while (shared.taken->load() < enough && waitpid(child, &status, WNOHANG) == 0) sched_yield();
  kill(child, SIGKILL);
  EXPECT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status)) << "the recorder was not killed";
  return shared.taken->load();
}

// 200 recorders are killed at random moments. Each file must contain everything except the last second.
TEST(McapCrash, AKilledRecorderLosesAtMostTheLastSecond) {
  Random random(1);
  std::uint64_t most_lost = 0;
  for (int i = 0; i < 200; ++i) {
    const fs::path folder = testing::fresh_folder("killed");
    const fs::path path = folder / "lap.mcap";
    const WriterOptions options{.compression = static_cast<Compression>(i % 3),
                                .chunk_size_bytes = std::size_t{1} << (12U + random.index(9))};
    const std::uint64_t taken = record_until_killed(path, options, 1 + random.index(400));
    const std::uint64_t kept = whole_messages(path, false);
    ASSERT_LE(kept, taken + 1) << i;
    const std::uint64_t lost = taken > kept ? taken - kept : 0;
    ASSERT_LE(lost * kStep, kSecond) << i;
    most_lost = std::max(most_lost, lost);
    if (i % 10 != 0) continue;
    const auto recovery = recover_file(path, folder / "whole.mcap");
    EXPECT_EQ(fs::exists(folder / "whole.mcap"), kept > 0) << "killed within its first second";
    if (kept == 0) continue;
    ASSERT_TRUE(recovery) << to_string(recovery.error());
    EXPECT_FALSE(recovery->was_whole);
    EXPECT_EQ(recovery->messages, kept);
    EXPECT_EQ(whole_messages(folder / "whole.mcap", true), kept);
    EXPECT_EQ(whole_messages(path, false), kept);  // the original is unchanged
    EXPECT_FALSE(fs::exists(folder / "whole.mcap.part"));
  }
  RecordProperty("most_messages_lost_of_50_a_second", std::to_string(most_lost));
}

TEST(McapCrash, RecoveryNeverOverwrites) {
  const fs::path folder = testing::fresh_folder("folder");
  Result<Writer> writer = start(folder / "lap.mcap", {});
  ASSERT_TRUE(writer->flush());
  ASSERT_TRUE(create_file(folder / "taken.mcap"));
  const auto recovery = recover_file(folder / "lap.mcap", folder / "taken.mcap");
  ASSERT_FALSE(recovery);
  EXPECT_EQ(recovery.error().code, ErrorCode::Unwritable);
  EXPECT_EQ(fs::file_size(folder / "taken.mcap"), 0U);
  EXPECT_FALSE(recover_file(folder / "lap.mcap", folder / "lap.mcap"));
}

// On a full disk, data that have already been written are kept. The file still gets its summary, because the
// chunk that did not fit is removed.
TEST(McapCrash, AFullDiskKeepsWrittenDataAndCompletesTheFile) {
  const fs::path folder = testing::fresh_folder("folder");
  const fs::path path = folder / "lap.mcap";
  const Shared shared;
  const pid_t child = fork();
  if (child == 0) {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{1 << 18, 1 << 18};
    setrlimit(RLIMIT_FSIZE, &limit);
    Result<Writer> writer = start(path, {.compression = Compression::None, .chunk_size_bytes = 1 << 15});
    Status status;
    std::uint64_t i = 0;
    for (; status && i < 100'000; ++i) status = writer->write(1, time_of(i), time_of(i), data_of(i));
    const Status again = writer->write(1, time_of(i), time_of(i), data_of(i));
    const Status closed = writer->close();
    const bool failed_as_expected = !status && status.error().code == ErrorCode::Unwritable && !again &&
                                    !closed && status.error().hint.find("space") != std::string::npos;
    shared.taken->store(i);
    _exit(failed_as_expected ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const std::uint64_t kept = whole_messages(path, true);
  EXPECT_LE((shared.taken->load() - kept) * kStep, kSecond);
  EXPECT_GT(kept, 50U);
}

TEST(McapCrash, ARecordingInProgressCanBeRead) {
  const fs::path folder = testing::fresh_folder("folder");
  const fs::path path = folder / "lap.mcap";
  Result<Writer> writer = start(path, {});
  ASSERT_TRUE(writer);
  for (std::uint64_t i = 0; i < 500; ++i) {
    ASSERT_TRUE(writer->write(1, time_of(i), time_of(i), data_of(i)));
    if (i % 50 != 49) continue;
    const std::uint64_t there = whole_messages(path, false);
    EXPECT_LE((i - there) * kStep, kSecond);
  }
  ASSERT_TRUE(writer->close());
  EXPECT_EQ(whole_messages(path, true), 500U);
}

/// Tracks the bytes that would survive a power cut.
class PowerSink final : public ByteSink {
 public:
  PowerSink(std::uint64_t& written, std::uint64_t& safe, int& syncs)
      : written_(written), safe_(safe), syncs_(syncs) {}
  Status write(ByteSpan bytes) override {
    written_ += bytes.size();
    return {};
  }
  Status sync() override {
    safe_ = written_;
    ++syncs_;
    return {};
  }

 private:
  std::uint64_t& written_;
  std::uint64_t& safe_;
  int& syncs_;
};

TEST(McapCrash, ADurableRecordingIsSyncedOncePerSecondNotPerChunk) {
  for (const bool durable : {false, true}) {
    std::uint64_t written = 0;
    std::uint64_t safe = 0;
    int syncs = 0;
    auto writer = Writer::open(std::make_unique<PowerSink>(written, safe, syncs),
                               {.chunk_size_bytes = 1 << 13, .durable = durable});
    ASSERT_TRUE(writer->add_channel("/x", 0, ""));
    std::uint64_t safe_messages = 0;
    for (std::uint64_t i = 0; i < 1000; ++i) {
      const int before = syncs;
      ASSERT_TRUE(writer->write(1, time_of(i), time_of(i), data_of(i)));
      if (syncs != before) safe_messages = i;  // all messages before this one are safe
      if (durable) {
        ASSERT_LE((i - safe_messages) * kStep, kSecond);
      }
    }
    if (durable) {
      EXPECT_NEAR(syncs, 20, 1);
    } else {
      EXPECT_EQ(syncs, 0);
    }
    ASSERT_TRUE(writer->close());
    EXPECT_EQ(safe, durable ? written : 0);
  }
}

}  // namespace
}  // namespace waymark::mcap
