// Writing and reading recordings compared with a plain loop that copies the same bytes and computes their
// CRC-32.
//
// Both sides move messages between memory and memory, so the disk does not matter. The loop does one memcpy
// and one libdeflate CRC-32 per message: about the minimum for checked data. "into a file" is the same
// through the system, where the loop writes each message with one write(), like a recorder without chunks
// that survives a kill. The file is in memory if there is such a file system.
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include <benchmark/benchmark.h>
#include <libdeflate.h>

#include "waymark/base/random.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

constexpr std::size_t kBytes = std::size_t{64} << 20U;
constexpr std::uint64_t kPeriod_ns = 10'000'000;

/// Writes bytes repeatedly into the same memory.
class Ring final : public ByteSink {
 public:
  explicit Ring(Bytes& room) : room_(room) {}
  Status write(ByteSpan bytes) override {
    if (at_ + bytes.size() > room_.size()) at_ = 0;
    std::memcpy(room_.data() + at_, bytes.data(), bytes.size());
    at_ += bytes.size();
    return {};
  }
  Status sync() override { return {}; }
  [[nodiscard]] std::size_t size() const { return at_; }

 private:
  Bytes& room_;
  std::size_t at_ = 0;
};

Bytes noise(std::size_t size) {
  Random random(1);
  Bytes bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.index(256));
  return bytes;
}

/// Messages of one size, 64 MiB in total, each with its own bytes, and memory for a file of them.
struct Load {
  explicit Load(std::size_t bytes_a_message)
      : size(bytes_a_message), count(kBytes / size), all(noise(count * size)), room(kBytes + kBytes / 4) {}
  [[nodiscard]] ByteSpan message(std::size_t i) const { return ByteSpan(all).subspan(i * size, size); }
  std::size_t size;
  std::size_t count;
  Bytes all;
  Bytes room;
};

Load& load_of(std::int64_t size) {
  static std::map<std::int64_t, std::unique_ptr<Load>> loads;
  auto& load = loads[size];
  if (!load) load = std::make_unique<Load>(static_cast<std::size_t>(size));
  return *load;
}

std::size_t write_all(Load& load, Compression compression) {
  auto ring = std::make_unique<Ring>(load.room);
  Ring& sink = *ring;
  auto writer = Writer::open(std::move(ring), {.compression = compression});
  const auto channel = writer->add_channel("/x", 0, "");
  for (std::size_t i = 0; i < load.count; ++i) {
    const std::uint64_t time = i * kPeriod_ns;
    if (!writer->write(*channel, time, time, load.message(i))) std::abort();
  }
  if (!writer->close()) std::abort();
  return sink.size();
}

void write_ours(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  for (auto _ : state) benchmark::DoNotOptimize(write_all(load, Compression::None));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(load.all.size()));
}

void write_plain(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  for (auto _ : state) {
    std::uint32_t crc = 0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < load.count; ++i, at += load.size) {
      std::memcpy(load.room.data() + at, load.message(i).data(), load.size);
      crc = libdeflate_crc32(crc, load.message(i).data(), load.size);
    }
    benchmark::DoNotOptimize(crc);
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(load.all.size()));
}

std::filesystem::path scratch_file() {
  std::error_code ignored;
  const std::filesystem::path memory = "/dev/shm";
  const auto folder =
      std::filesystem::is_directory(memory, ignored) ? memory : std::filesystem::temp_directory_path();
  return folder / ("waymark_benchmark_" + std::to_string(::getpid()));
}

void write_ours_to_file(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  const std::filesystem::path path = scratch_file();
  for (auto _ : state) {
    auto writer = Writer::open(std::move(*create_file(path)), {.compression = Compression::None});
    const auto channel = writer->add_channel("/x", 0, "");
    for (std::size_t i = 0; i < load.count; ++i)
      if (!writer->write(*channel, i * kPeriod_ns, i * kPeriod_ns, load.message(i))) std::abort();
    if (!writer->close()) std::abort();
    std::filesystem::remove(path);
  }
}

void write_plain_to_file(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  const std::filesystem::path path = scratch_file();
  for (auto _ : state) {
    const auto sink = create_file(path);
    std::uint32_t crc = 0;
    for (std::size_t i = 0; i < load.count; ++i) {
      if (!(*sink)->write(load.message(i))) std::abort();
      crc = libdeflate_crc32(crc, load.message(i).data(), load.size);
    }
    benchmark::DoNotOptimize(crc);
    std::filesystem::remove(path);
  }
}

/// A recording of the load, created once.
const Bytes& file_of(Load& load) {
  static std::map<const Load*, Bytes> files;
  Bytes& file = files[&load];
  if (file.empty()) {
    const std::size_t size = write_all(load, Compression::None);
    file.assign(load.room.begin(), load.room.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return file;
}

void read_ours(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  const auto source = memory_source(file_of(load));
  for (auto _ : state) {
    const auto index = read_index(*source);
    std::size_t bytes = 0;
    const Status status = visit_messages(*source, *index, {}, [&](const Channel&, const Message& message) {
      bytes += message.data.bytes.size();
      return Status{};
    });
    if (!index->from_summary || !status || bytes != load.all.size()) std::abort();
    benchmark::DoNotOptimize(bytes);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(load.all.size()));
}

void read_plain(benchmark::State& state) {
  Load& load = load_of(state.range(0));
  const Bytes& file = file_of(load);
  Bytes message(load.size);
  for (auto _ : state) {
    std::uint32_t crc = 0;
    for (std::size_t i = 0, at = 0; i < load.count; ++i, at += message.size()) {
      std::memcpy(message.data(), file.data() + at, message.size());
      crc = libdeflate_crc32(crc, message.data(), message.size());
    }
    benchmark::DoNotOptimize(crc);
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) *
                          static_cast<std::int64_t>(load.all.size()));
}

const bool kRegistered = [] {
  for (const std::int64_t size : {1024, 16384, 640 * 480}) {
    const std::string name = std::to_string(size) + " bytes a message";
    benchmark::RegisterBenchmark(("record/ours/" + name).c_str(), write_ours)->Arg(size);
    benchmark::RegisterBenchmark(("record/peer:copy and CRC-32/" + name).c_str(), write_plain)->Arg(size);
    benchmark::RegisterBenchmark(("record into a file/ours/" + name).c_str(), write_ours_to_file)->Arg(size);
    benchmark::RegisterBenchmark(("record into a file/peer:write and CRC-32/" + name).c_str(),
                                 write_plain_to_file)
        ->Arg(size);
    benchmark::RegisterBenchmark(("read by index/ours/" + name).c_str(), read_ours)->Arg(size);
    benchmark::RegisterBenchmark(("read by index/peer:copy and CRC-32/" + name).c_str(), read_plain)
        ->Arg(size);
  }
  return true;
}();

}  // namespace
}  // namespace waymark::mcap
