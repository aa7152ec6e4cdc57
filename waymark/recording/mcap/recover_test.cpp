// Recovery of truncated and damaged files.
#include "waymark/recording/mcap/recover.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

std::uint64_t time_of(std::uint64_t number) { return 5'000'000'000 + number * 20'000'000; }

/// The content of message `number`: 0 to 4 KiB.
Bytes data_of(std::uint64_t number) {
  Random random(number);
  Bytes data(random.index(4096));
  for (std::size_t i = 0; i < data.size(); i += 7) data[i] = static_cast<std::uint8_t>(random.index(256));
  return data;
}

Bytes some_recording(std::uint64_t count, const WriterOptions& options) {
  Bytes file;
  Result<Writer> writer = Writer::open(memory_sink(file), options);
  EXPECT_TRUE(writer->add_channel("/x", 0, ""));
  for (std::uint64_t i = 0; i < count; ++i) EXPECT_TRUE(writer->write(1, time_of(i), time_of(i), data_of(i)));
  EXPECT_TRUE(writer->write_metadata({.name = "waymark", .metadata = {{"seed", "1"}}}));
  EXPECT_TRUE(writer->close());
  return file;
}

TEST(McapRecover, RecoversEverythingBeforeATruncation) {
  const Bytes whole = some_recording(300, {.chunk_size_bytes = 1 << 15});
  const auto index = read_index(*memory_source(whole));
  Random random(2);
  for (int i = 0; i < 200; ++i) {
    const std::size_t cut = 8 + random.index(whole.size() - 8);
    const Bytes part(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut));
    Bytes file;
    const auto recovery = recover(*memory_source(part), memory_sink(file));
    ASSERT_TRUE(recovery) << "truncated at " << cut << ": " << to_string(recovery.error());
    EXPECT_FALSE(recovery->was_whole);
    const auto after = read_index(*memory_source(file));
    ASSERT_TRUE(after);
    EXPECT_TRUE(after->from_summary);
    EXPECT_TRUE(after->problems.empty());
    const auto kept = std::ranges::count_if(index->chunks, [&](const ChunkIndex& chunk) {
      return chunk.chunk_start_offset + chunk.chunk_length <= cut;
    });
    EXPECT_EQ(static_cast<std::ptrdiff_t>(after->chunks.size()), kept) << "truncated at " << cut;
    EXPECT_LE(recovery->lost_bytes, cut);
  }
}

TEST(McapRecover, ACompleteFileIsCopiedUnchanged) {
  const Bytes whole = some_recording(100, {});
  Bytes file;
  const auto recovery = recover(*memory_source(whole), memory_sink(file));
  ASSERT_TRUE(recovery);
  EXPECT_TRUE(recovery->was_whole);
  EXPECT_EQ(recovery->lost_bytes, 0U);
  EXPECT_EQ(file, whole);
}

TEST(McapRecover, OmitsADamagedChunkAndKeepsTheOthers) {
  Bytes damaged = some_recording(300, {.chunk_size_bytes = 1 << 15});
  const auto index = read_index(*memory_source(damaged));
  ASSERT_GT(index->chunks.size(), 3U);
  damaged[index->chunks[1].chunk_start_offset + 200] ^= 0xFF;
  Bytes file;
  const auto recovery = recover(*memory_source(damaged), memory_sink(file));
  ASSERT_TRUE(recovery);
  EXPECT_FALSE(recovery->was_whole);
  ASSERT_EQ(recovery->problems.size(), 1U);
  EXPECT_EQ(recovery->chunks, index->chunks.size() - 1);
  EXPECT_EQ(recovery->lost_bytes, index->chunks[1].chunk_length);
  EXPECT_EQ(read_index(*memory_source(file))->metadata.size(), 1U);
  // Without recovery, a visit skips damage only if on_damage is set; otherwise it fails.
  const auto visit = [](const Channel&, const Message&) { return Status{}; };
  EXPECT_FALSE(visit_messages(*memory_source(damaged), *index, {}, visit));
  int reported = 0;
  EXPECT_TRUE(visit_messages(*memory_source(damaged), *index, {}, visit,
                             {.on_damage = [&](const Error&) { ++reported; }}));
  EXPECT_EQ(reported, 1);
}

/// Changes each byte of a chunk's length and opcode; the summary contains the offset of the next record.
TEST(McapRecover, ContinuesAtTheNextChunkAfterADamagedLength) {
  const Bytes whole = some_recording(300, {.chunk_size_bytes = 1 << 15});
  const auto index = read_index(*memory_source(whole));
  ASSERT_GT(index->chunks.size(), 3U);
  const ChunkIndex& chunk = index->chunks[1];
  for (std::size_t byte = 0; byte < kRecordPrefixSize; ++byte) {
    Bytes damaged = whole;
    damaged[chunk.chunk_start_offset + byte] ^= 0x5A;
    Bytes file;
    const auto recovery = recover(*memory_source(damaged), memory_sink(file));
    ASSERT_TRUE(recovery);
    EXPECT_FALSE(recovery->was_whole) << byte;
    EXPECT_FALSE(recovery->problems.empty()) << byte;
    EXPECT_GE(recovery->chunks, index->chunks.size() - 1) << byte;
    const auto read = read_index(*memory_source(file));
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->problems.empty()) << byte;
    EXPECT_EQ(read->metadata.size(), 1U) << byte;
    std::size_t others = 0;
    for (const ChunkIndex& kept : read->chunks)
      others += kept.message_start_time != chunk.message_start_time ? 1 : 0;
    EXPECT_EQ(others, index->chunks.size() - 1) << byte;
    EXPECT_GT(recovery->lost_bytes, 0U) << byte;
    EXPECT_LE(recovery->lost_bytes, index->chunks[2].chunk_start_offset - chunk.chunk_start_offset) << byte;
  }
}

/// The writer was killed and a part of the file is lost; without a summary, the next chunk must be found by
/// its bytes.
TEST(McapRecover, ContinuesAtTheNextChunkWithoutASummary) {
  for (const Compression compression : {Compression::None, Compression::Lz4, Compression::Zstd}) {
    const Bytes whole = some_recording(300, {.compression = compression, .chunk_size_bytes = 1 << 15});
    const auto index = read_index(*memory_source(whole));
    ASSERT_GT(index->chunks.size(), 4U);
    const ChunkIndex& gap = index->chunks[1];
    const ChunkIndex& last = index->chunks.back();
    Bytes damaged(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(last.chunk_start_offset));
    for (std::size_t i = 0; i < 100; ++i) damaged[gap.chunk_start_offset + i] = 0;
    Bytes file;
    const auto recovery = recover(*memory_source(damaged), memory_sink(file));
    ASSERT_TRUE(recovery);
    EXPECT_FALSE(recovery->was_whole);
    EXPECT_EQ(recovery->chunks, index->chunks.size() - 2);
    EXPECT_GT(recovery->lost_bytes, 100U);
    const auto read = read_index(*memory_source(file));
    ASSERT_TRUE(read);
    EXPECT_TRUE(read->problems.empty());
  }
}

/// The first block of a file is lost, with or without a summary.
TEST(McapRecover, AFileWithoutItsBeginningKeepsItsChunks) {
  const Bytes whole = some_recording(300, {.chunk_size_bytes = 1 << 15});
  const auto index = read_index(*memory_source(whole));
  ASSERT_GT(index->chunks.size(), 4U);
  const std::uint64_t last = index->chunks.back().chunk_start_offset;
  for (const bool summary : {true, false}) {
    for (const std::uint64_t lost :
         {std::uint64_t{4}, index->chunks[0].chunk_start_offset, index->chunks[1].chunk_start_offset}) {
      Bytes damaged = whole;
      if (!summary) damaged.resize(static_cast<std::size_t>(last));
      std::fill_n(damaged.begin(), lost, std::uint8_t{0});
      Bytes file;
      const auto recovery = recover(*memory_source(damaged), memory_sink(file));
      ASSERT_TRUE(recovery) << to_string(recovery.error());
      EXPECT_FALSE(recovery->was_whole);
      const std::size_t expected =
          index->chunks.size() - (lost == index->chunks[1].chunk_start_offset ? 1 : 0) - (summary ? 0 : 1);
      EXPECT_EQ(recovery->chunks, expected) << lost;
      EXPECT_GE(recovery->lost_bytes, lost);
      EXPECT_NE(to_string(recovery->problems.at(0)).find("does not begin with the MCAP magic"),
                std::string::npos);
      const auto read = read_index(*memory_source(file));
      ASSERT_TRUE(read);
      EXPECT_TRUE(read->problems.empty());
      EXPECT_EQ(read->channels.size(), summary || expected + 1 == index->chunks.size() ? 1U : 0U) << lost;
    }
  }
}

/// The writer was killed and bytes in the middle are missing. A reader finds the same messages as recovery.
TEST(McapRecover, AReaderContinuesAfterMissingBytes) {
  const Bytes whole = some_recording(300, {.chunk_size_bytes = 1 << 15});
  const auto index = read_index(*memory_source(whole));
  Bytes damaged(whole.begin(),
                whole.begin() + static_cast<std::ptrdiff_t>(index->chunks.back().chunk_start_offset));
  const auto from = damaged.begin() + static_cast<std::ptrdiff_t>(index->chunks[1].chunk_start_offset + 50);
  damaged.erase(from, from + 1000);
  Bytes file;
  const auto recovery = recover(*memory_source(damaged), memory_sink(file));
  ASSERT_TRUE(recovery);
  const auto read = read_index(*memory_source(damaged));
  ASSERT_TRUE(read);
  EXPECT_FALSE(read->problems.empty());
  EXPECT_EQ(read->chunks.size(), recovery->chunks);
  EXPECT_EQ(read->chunks.size(), index->chunks.size() - 3)
      << "without the last, the damaged and the following chunk";
  EXPECT_EQ(read->statistics.message_count, recovery->messages);
}

TEST(McapRecover, RejectsOtherFiles) {
  const Bytes text(5000, 'w');
  Bytes file;
  const auto recovery = recover(*memory_source(text), memory_sink(file));
  ASSERT_FALSE(recovery);
  EXPECT_EQ(recovery.error().code, ErrorCode::Unreadable);
  testing::expect_on_page("recording", recovery.error());
}

TEST(McapRecover, OmitsAndReportsAnAttachmentWithAWrongChecksum) {
  Bytes damaged;
  Result<Writer> writer = Writer::open(memory_sink(damaged), {});
  ASSERT_TRUE(writer->add_channel("/x", 0, ""));
  ASSERT_TRUE(writer->write(1, 0, 0, data_of(0)));
  const Bytes text(40, 'w');
  for (const char* name : {"first.yaml", "second.yaml"})
    ASSERT_TRUE(writer->write_attachment({.name = name, .data = {text}}));
  ASSERT_TRUE(writer->close());
  const auto index = read_index(*memory_source(damaged));
  ASSERT_EQ(index->attachments.size(), 2U);
  damaged[index->attachments[0].offset + index->attachments[0].length - 10] ^= 1;
  Bytes file;
  const auto recovery = recover(*memory_source(damaged), memory_sink(file));
  ASSERT_TRUE(recovery);
  EXPECT_FALSE(recovery->was_whole);
  ASSERT_EQ(recovery->problems.size(), 1U);
  EXPECT_NE(recovery->problems[0].message.find("'first.yaml'"), std::string::npos);
  testing::expect_on_page("recording", recovery->problems[0]);
  const auto read = read_index(*memory_source(file));
  ASSERT_EQ(read->attachments.size(), 1U);
  EXPECT_EQ(read->attachments[0].name, "second.yaml");
}

}  // namespace
}  // namespace waymark::mcap
