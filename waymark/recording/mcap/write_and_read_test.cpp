// Round trips between the writer and the readers, on complete, truncated and damaged files.
#include <algorithm>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

struct Sent {
  std::string topic;
  std::uint64_t time;
  Bytes data;
  friend bool operator==(const Sent&, const Sent&) = default;
};

/// Messages on three topics over 4 s, slightly out of order, as sensors deliver them.
std::vector<Sent> some_messages(std::uint64_t seed) {
  Random random(seed);
  std::vector<Sent> messages;
  for (std::uint64_t i = 0; i < 400; ++i) {
    Bytes data(random.index(300));
    for (auto& byte : data) byte = static_cast<std::uint8_t>(random.index(4));
    const std::uint64_t time = 1'000'000'000 + i * 10'000'000 + random.index(35'000'000);
    messages.push_back({"/topic" + std::to_string(random.index(3)), time, data});
  }
  return messages;
}

Bytes write_file(const std::vector<Sent>& messages, const WriterOptions& options, bool close = true) {
  Bytes file;
  Result<Writer> writer = Writer::open(memory_sink(file), options);
  EXPECT_TRUE(writer);
  const auto schema = writer->add_schema("pkg/msg/Thing", "ros2msg", as_bytes("int32 x\n"));
  std::map<std::string, std::uint16_t> channels;
  for (const Sent& message : messages) {
    if (!channels.contains(message.topic))
      channels[message.topic] = writer->add_channel(message.topic, *schema, "cdr").value();
    EXPECT_TRUE(writer->write(channels[message.topic], message.time, message.time, message.data));
  }
  EXPECT_TRUE(writer->write_metadata({.name = "configuration", .metadata = {{"speed_m_s", "0.25"}}}));
  EXPECT_TRUE(writer->write_attachment({.log_time = 1,
                                        .create_time = 2,
                                        .name = "map.yaml",
                                        .media_type = "text/yaml",
                                        .data = {as_bytes("tags: []\n")}}));
  EXPECT_TRUE(close ? writer->close() : writer->flush());
  return file;
}

std::vector<Sent> read_back(const Bytes& file, const Selection& selection = {}) {
  const auto source = memory_source(file);
  const Result<Index> index = read_index(*source);
  EXPECT_TRUE(index) << to_string(index.error());
  std::vector<Sent> messages;
  if (!index) return messages;
  const Status status =
      visit_messages(*source, *index, selection, [&](const Channel& channel, const Message& message) {
        messages.push_back(
            {channel.topic, message.log_time, Bytes(message.data.bytes.begin(), message.data.bytes.end())});
        return Status{};
      });
  EXPECT_TRUE(status) << to_string(status.error());
  return messages;
}

std::vector<Sent> in_time_order(std::vector<Sent> messages) {
  std::ranges::stable_sort(messages, {}, &Sent::time);
  return messages;
}

class EveryCompression : public ::testing::TestWithParam<Compression> {};
INSTANTIATE_TEST_SUITE_P(Mcap, EveryCompression,
                         ::testing::Values(Compression::None, Compression::Lz4, Compression::Zstd));

TEST_P(EveryCompression, ReadsInTimeOrder) {
  const auto messages = some_messages(1);
  const Bytes file = write_file(messages, {.compression = GetParam(), .chunk_size_bytes = 4096});
  EXPECT_EQ(read_back(file), in_time_order(messages));

  const auto index = read_index(*memory_source(file));
  EXPECT_TRUE(index->from_summary);
  EXPECT_EQ(index->statistics.message_count, messages.size());
  EXPECT_GT(index->chunks.size(), 5U);
  EXPECT_EQ(index->schemas.at(1).name, "pkg/msg/Thing");
}

TEST_P(EveryCompression, ATruncationLosesOnlyTheTail) {
  const auto messages = some_messages(2);
  const Bytes file = write_file(messages, {.compression = GetParam(), .chunk_size_bytes = 4096});
  const auto whole = read_index(*memory_source(file));
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const std::size_t cut = sizeof(kMagic) + random.index(file.size() - sizeof(kMagic));
    const Bytes part(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(cut));
    const auto index = read_index(*memory_source(part));
    ASSERT_TRUE(index) << "truncated at " << cut << ": " << to_string(index.error());
    EXPECT_FALSE(index->from_summary);
    EXPECT_FALSE(index->problems.empty());
    // Every chunk that was complete before the truncation is found.
    const auto kept = std::ranges::count_if(whole->chunks, [&](const ChunkIndex& chunk) {
      return chunk.chunk_start_offset + chunk.chunk_length <= cut;
    });
    EXPECT_EQ(static_cast<std::ptrdiff_t>(index->chunks.size()), kept) << "truncated at " << cut;
    EXPECT_EQ(read_back(part).size(), index->statistics.message_count);
  }
}

TEST(Mcap, AnUnfinishedFileIsReadByScanning) {
  const auto messages = some_messages(4);
  const Bytes file = write_file(messages, {}, false);
  EXPECT_EQ(read_back(file), in_time_order(messages));
  EXPECT_FALSE(read_index(*memory_source(file))->from_summary);
}

TEST(Mcap, SelectsByTopicAndTime) {
  const auto messages = in_time_order(some_messages(5));
  const Bytes file = write_file(messages, {.chunk_size_bytes = 2048});
  const Selection selection{.topics = {"/topic1"}, .from = 2'000'000'000, .to = 3'500'000'000};
  std::vector<Sent> expected;
  std::ranges::copy_if(messages, std::back_inserter(expected), [](const Sent& message) {
    return message.topic == "/topic1" && message.time >= 2'000'000'000 && message.time < 3'500'000'000;
  });
  ASSERT_FALSE(expected.empty());
  EXPECT_EQ(read_back(file, selection), expected);
}

TEST(Mcap, AttachmentAndMetadataRoundTrip) {
  const Bytes file = write_file(some_messages(6), {});
  const auto source = memory_source(file);
  const auto index = read_index(*source);
  ASSERT_EQ(index->attachments.size(), 1U);
  ASSERT_EQ(index->metadata.size(), 1U);
  Bytes data;
  const auto attachment = read_attachment(*source, index->attachments[0], data);
  ASSERT_TRUE(attachment) << to_string(attachment.error());
  EXPECT_EQ(as_text(attachment->data.bytes), "tags: []\n");
  EXPECT_EQ(read_metadata(*source, index->metadata[0])->metadata.at("speed_m_s"), "0.25");
}

TEST(Mcap, AChunkEndsWithinASecondOfLogTime) {
  Bytes file;
  auto writer = Writer::open(memory_sink(file), {});
  const auto channel = writer->add_channel("/x", 0, "");
  for (std::uint64_t i = 0; i < 100; ++i) EXPECT_TRUE(writer->write(*channel, i * 100'000'000, 0, {}));
  EXPECT_TRUE(writer->close());
  const auto index = read_index(*memory_source(file));
  EXPECT_GE(index->chunks.size(), 10U);
  for (const auto& chunk : index->chunks)
    EXPECT_LE(chunk.message_end_time - chunk.message_start_time, 1'000'000'000U);
}

TEST(Mcap, DamageIsReportedAndNeverCrashes) {
  const auto messages = some_messages(7);
  const Bytes file = write_file(messages, {.chunk_size_bytes = 4096});
  Random random(8);
  int noticed = 0;
  for (int i = 0; i < 300; ++i) {
    Bytes damaged = file;
    for (int k = 0; k < 4; ++k)
      damaged[random.index(damaged.size())] ^= static_cast<std::uint8_t>(1 + random.index(255));
    const auto source = memory_source(damaged);
    const auto index = read_index(*source, {.max_record_bytes = 1 << 22});
    if (!index) {
      ++noticed;
      continue;
    }
    const Status status =
        visit_messages(*source, *index, {}, [](const Channel&, const Message&) { return Status{}; },
                       {.max_record_bytes = 1 << 22});
    if (!status || !index->problems.empty() || !index->from_summary) ++noticed;
  }
  EXPECT_GT(noticed, 290);  // damage to unused bytes goes undetected (message indexes, record lengths)
}

TEST(Mcap, RejectsOtherFiles) {
  for (const std::string text : {"", "short", "this is a text file and not a recording at all"}) {
    const Bytes bytes(text.begin(), text.end());
    const auto index = read_index(*memory_source(bytes, "notes.txt"));
    ASSERT_FALSE(index);
    EXPECT_EQ(index.error().place.source, "notes.txt");
    EXPECT_EQ(index.error().place.byte, 0);
    testing::expect_on_page("recording", index.error());
  }
}

TEST(Mcap, RejectsAnExcessiveLengthBeforeAllocation) {
  Bytes file = write_file({}, {}, false);
  file.push_back(static_cast<std::uint8_t>(Opcode::Message));
  append_little_endian(file, std::uint64_t{1} << 62);
  const auto index = read_index(*memory_source(file));
  ASSERT_TRUE(index);
  ASSERT_EQ(index->problems.size(), 1U);
  testing::expect_on_page("recording", index->problems[0]);
}

TEST(Mcap, WritingToAnUnknownChannelIsAnError) {
  Bytes file;
  auto writer = Writer::open(memory_sink(file), {});
  EXPECT_FALSE(writer->write(1, 0, 0, {}));
  EXPECT_FALSE(writer->add_channel("/x", 7, "cdr"));
}

/// Offset of the n-th occurrence of a text in a file, counting from 1.
std::size_t place_of(const Bytes& file, std::string_view text, int n) {
  std::size_t at = 0;
  for (int i = 0; i < n; ++i) at = as_text(file).find(text, i == 0 ? 0 : at + 1);
  EXPECT_NE(at, std::string_view::npos) << text;
  return at;
}

std::string problems_of(const Bytes& file) {
  std::string words;
  const auto index = read_index(*memory_source(file));
  EXPECT_TRUE(index);
  for (const Error& problem : index->problems) words += to_string(problem) + "\n";
  return words;
}

TEST(McapDamage, ReportsAChangedByteOfTheMetadata) {
  Bytes file = write_file(some_messages(3), {});
  EXPECT_EQ(problems_of(file), "");
  file[place_of(file, "0.25", 1)] = '9';
  const std::string problems = problems_of(file);
  EXPECT_NE(problems.find("checksum"), std::string::npos) << problems;
  EXPECT_NE(problems.find("metadata at byte"), std::string::npos) << problems;
}

TEST(McapDamage, ReportsADamagedLengthOfTheMetadata) {
  Bytes file = write_file(some_messages(3), {});
  file[place_of(file, "speed_m_s", 1) - 4] = 5;  // the length of the key
  EXPECT_NE(problems_of(file).find("checksum"), std::string::npos);
}

TEST(McapDamage, ReportsAChangedByteOfAChunkWithItsPlace) {
  Bytes file = write_file(some_messages(3), {.compression = Compression::None});
  const auto index = read_index(*memory_source(file));
  ASSERT_TRUE(index);
  file[index->chunks.at(0).chunk_start_offset + 200] ^= 1;
  const std::string place = "record at byte " + std::to_string(index->chunks[0].chunk_start_offset);
  EXPECT_NE(problems_of(file).find(place), std::string::npos) << problems_of(file);
}

TEST(McapDamage, IgnoresASummaryWithAWrongChecksum) {
  Bytes file = write_file(some_messages(3), {.compression = Compression::None});
  const std::size_t in_summary = as_text(file).rfind("/topic1");
  file[in_summary + 1] = 'v';
  const auto index = read_index(*memory_source(file));
  ASSERT_TRUE(index);
  EXPECT_FALSE(index->from_summary);
  EXPECT_EQ(index->channels.size(), 3U);
  for (const auto& [id, channel] : index->channels)
    EXPECT_TRUE(channel.topic.starts_with("/topic")) << channel.topic;
  EXPECT_NE(problems_of(file).find("summary checksum"), std::string::npos);
  EXPECT_EQ(problems_of(file).find("of the recording"), std::string::npos) << "the data section is undamaged";
}

TEST(McapDamage, DoesNotChecksumLargeFilesOnOpening) {
  Bytes file = write_file(some_messages(3), {});
  file[place_of(file, "0.25", 1)] = '9';
  const auto index = read_index(*memory_source(file), {.max_checked_bytes = file.size() - 1});
  ASSERT_TRUE(index);
  EXPECT_TRUE(index->problems.empty());
}

}  // namespace
}  // namespace waymark::mcap
