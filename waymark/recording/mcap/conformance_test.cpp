// Reads the files of the MCAP conformance corpus (github.com/foxglove/mcap, tests/conformance) and compares
// every record with the JSON next to each file.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/recording/mcap/reader.hpp"
#include "waymark/recording/mcap/stream.hpp"
#include "waymark/recording/mcap/writer.hpp"

namespace waymark::mcap {
namespace {

using Json = nlohmann::json;

template <class Number>
  requires std::integral<Number>
Json value(Number number) {
  return std::to_string(number);
}
Json value(const std::string& text) { return text; }
Json value(ByteSpan bytes) {
  Json list = Json::array();
  for (const std::uint8_t byte : bytes) list.push_back(std::to_string(byte));
  return list;
}
Json value(const std::map<std::string, std::string>& pairs) { return pairs; }
Json value(const std::map<std::uint16_t, std::uint64_t>& pairs) {
  Json object = Json::object();
  for (const auto& [key, number] : pairs) object[std::to_string(key)] = std::to_string(number);
  return object;
}

Json fields(const Header& r) { return {{"profile", value(r.profile)}, {"library", value(r.library)}}; }
Json fields(const Footer& r) {
  return {{"summary_start", value(r.summary_start)},
          {"summary_offset_start", value(r.summary_offset_start)},
          {"summary_crc", value(r.summary_crc)}};
}
Json fields(const Schema& r) {
  return {{"id", value(r.id)},
          {"name", value(r.name)},
          {"encoding", value(r.encoding)},
          {"data", value(r.data.bytes)}};
}
Json fields(const Channel& r) {
  return {{"id", value(r.id)},
          {"schema_id", value(r.schema_id)},
          {"topic", value(r.topic)},
          {"message_encoding", value(r.message_encoding)},
          {"metadata", value(r.metadata)}};
}
Json fields(const Message& r) {
  return {{"channel_id", value(r.channel_id)},
          {"sequence", value(r.sequence)},
          {"log_time", value(r.log_time)},
          {"publish_time", value(r.publish_time)},
          {"data", value(r.data.bytes)}};
}
Json fields(const ChunkIndex& r) {
  return {{"message_start_time", value(r.message_start_time)},
          {"message_end_time", value(r.message_end_time)},
          {"chunk_start_offset", value(r.chunk_start_offset)},
          {"chunk_length", value(r.chunk_length)},
          {"message_index_offsets", value(r.message_index_offsets)},
          {"message_index_length", value(r.message_index_length)},
          {"compression", value(r.compression)},
          {"compressed_size", value(r.compressed_size)},
          {"uncompressed_size", value(r.uncompressed_size)}};
}
Json fields(const Attachment& r) {
  return {{"log_time", value(r.log_time)},
          {"create_time", value(r.create_time)},
          {"name", value(r.name)},
          {"media_type", value(r.media_type)},
          {"data", value(r.data.bytes)}};
}
Json fields(const AttachmentIndex& r) {
  return {{"offset", value(r.offset)},        {"length", value(r.length)},
          {"log_time", value(r.log_time)},    {"create_time", value(r.create_time)},
          {"data_size", value(r.data_size)},  {"name", value(r.name)},
          {"media_type", value(r.media_type)}};
}
Json fields(const Statistics& r) {
  return {{"message_count", value(r.message_count)},
          {"schema_count", value(r.schema_count)},
          {"channel_count", value(r.channel_count)},
          {"attachment_count", value(r.attachment_count)},
          {"metadata_count", value(r.metadata_count)},
          {"chunk_count", value(r.chunk_count)},
          {"message_start_time", value(r.message_start_time)},
          {"message_end_time", value(r.message_end_time)},
          {"channel_message_counts", value(r.channel_message_counts)}};
}
Json fields(const Metadata& r) { return {{"name", value(r.name)}, {"metadata", value(r.metadata)}}; }
Json fields(const MetadataIndex& r) {
  return {{"offset", value(r.offset)}, {"length", value(r.length)}, {"name", value(r.name)}};
}
Json fields(const SummaryOffset& r) {
  return {{"group_opcode", value(r.group_opcode)},
          {"group_start", value(r.group_start)},
          {"group_length", value(r.group_length)}};
}
Json fields(const DataEnd& r) { return {{"data_section_crc", value(r.data_section_crc)}}; }

/// Appends {"type": …, "fields": {…}} if the opcode is that of Record.
template <class Record>
bool describe_as(const char* type, const RecordView& view, Json& list) {
  if (view.opcode != static_cast<std::uint8_t>(Record::kOpcode)) return false;
  const auto record = decode<Record>(view.content);
  EXPECT_TRUE(record) << to_string(record.error());
  if (record) list.push_back({{"type", type}, {"fields", fields(*record)}});
  return true;
}

// The corpus lists the records inside chunks, but neither chunks nor message indexes.
void describe(const RecordView& view, Json& list) {
  const bool known =
      describe_as<Header>("Header", view, list) || describe_as<Footer>("Footer", view, list) ||
      describe_as<Schema>("Schema", view, list) || describe_as<Channel>("Channel", view, list) ||
      describe_as<Message>("Message", view, list) || describe_as<ChunkIndex>("ChunkIndex", view, list) ||
      describe_as<Attachment>("Attachment", view, list) ||
      describe_as<AttachmentIndex>("AttachmentIndex", view, list) ||
      describe_as<Statistics>("Statistics", view, list) || describe_as<Metadata>("Metadata", view, list) ||
      describe_as<MetadataIndex>("MetadataIndex", view, list) ||
      describe_as<SummaryOffset>("SummaryOffset", view, list) || describe_as<DataEnd>("DataEnd", view, list);
  (void)known;
}

Json expected(const std::filesystem::path& path) {
  Json list = Json::array();
  const Json document = Json::parse(std::ifstream(path));
  for (const Json& record : document.at("records")) {
    Json object = Json::object();
    for (const Json& field : record.at("fields")) object[field.at(0).get<std::string>()] = field.at(1);
    list.push_back({{"type", record.at("type")}, {"fields", object}});
  }
  return list;
}

/// The files in the corpus; skips the test if there is no corpus.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& corpus) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(corpus))
    if (entry.path().extension() == ".mcap") files.push_back(entry.path());
  std::ranges::sort(files);
  EXPECT_EQ(files.size(), 416U);
  return files;
}

TEST(McapConformance, EveryFileMatchesItsJson) {
  WAYMARK_REAL_DATA(corpus, "mcap-conformance");
  for (const auto& path : files_of(corpus)) {
    const auto source = open_file(path);
    ASSERT_TRUE(source) << to_string(source.error());
    Json records = Json::array();
    const auto summary = read_stream(**source, {}, [&](const RecordView& view) {
      describe(view, records);
      return Status{};
    });
    ASSERT_TRUE(summary) << to_string(summary.error());
    EXPECT_TRUE(summary->complete) << path;
    EXPECT_EQ(records, expected(std::filesystem::path(path).replace_extension(".json"))) << path;
  }
}

Json of_type(const Json& records, const std::string& type) {
  Json list = Json::array();
  for (const Json& record : records)
    if (record.at("type") == type) list.push_back(record.at("fields"));
  return list;
}

// Messages, attachments and metadata are found in order of time, whatever a summary omits.
TEST(McapConformance, EveryFileReadsByIndexWithPartialSummaries) {
  WAYMARK_REAL_DATA(corpus, "mcap-conformance");
  for (const auto& path : files_of(corpus)) {
    const auto source = open_file(path);
    const auto index = read_index(**source);
    ASSERT_TRUE(index) << path;
    EXPECT_TRUE(index->problems.empty()) << path;
    const Json records = expected(std::filesystem::path(path).replace_extension(".json"));
    Json messages = Json::array();
    const Status status = visit_messages(**source, *index, {}, [&](const Channel&, const Message& message) {
      messages.push_back(fields(message));
      return Status{};
    });
    ASSERT_TRUE(status) << path << ": " << to_string(status.error());
    Json in_order = of_type(records, "Message");
    const auto time_of = [](const Json& message) {
      return std::stoull(message.at("log_time").get<std::string>());
    };
    std::stable_sort(in_order.begin(), in_order.end(),
                     [&](const Json& a, const Json& b) { return time_of(a) < time_of(b); });
    EXPECT_EQ(messages, in_order) << path;
    Json attachments = Json::array();
    for (const AttachmentIndex& entry : index->attachments) {
      Bytes data;
      const auto attachment = read_attachment(**source, entry, data);
      ASSERT_TRUE(attachment) << path << ": " << to_string(attachment.error());
      attachments.push_back(fields(*attachment));
    }
    EXPECT_EQ(attachments, of_type(records, "Attachment")) << path;
    Json metadata = Json::array();
    for (const MetadataIndex& entry : index->metadata)
      metadata.push_back(fields(*read_metadata(**source, entry)));
    EXPECT_EQ(metadata, of_type(records, "Metadata")) << path;
  }
}

/// Options from the features listed in a file's name: "OneMessage-ch-mx-st.mcap".
WriterOptions options_of(const std::string& name) {
  const auto has = [&](const std::string& feature) {
    return name.find("-" + feature + "-") != std::string::npos || name.ends_with("-" + feature);
  };
  return {.profile = "",
          .library = "",
          .compression = Compression::None,
          .chunked = has("ch"),
          .message_index = has("mx"),
          .summary = {.schemas = has("rsh"),
                      .channels = has("rch"),
                      .statistics = has("st"),
                      .chunk_indexes = has("chx"),
                      .attachment_indexes = has("ax"),
                      .metadata_indexes = has("mdx"),
                      .offsets = has("sum")}};
}

/// Writes the data section of a file again, using Writer.
Bytes rewritten(const ByteSource& source, const WriterOptions& options) {
  Bytes file;
  Result<Writer> writer = Writer::open(memory_sink(file), options);
  EXPECT_TRUE(writer);
  bool data = true;
  const auto write = [&](const RecordView& view) -> Status {
    data = data && view.opcode != static_cast<std::uint8_t>(Opcode::DataEnd);
    if (!data) return {};
    switch (static_cast<Opcode>(view.opcode)) {
      case Opcode::Schema: {
        const auto schema = decode<Schema>(view.content);
        EXPECT_EQ(*writer->add_schema(schema->name, schema->encoding, schema->data.bytes), schema->id);
        return {};
      }
      case Opcode::Channel: {
        const auto channel = decode<Channel>(view.content);
        EXPECT_EQ(*writer->add_channel(channel->topic, channel->schema_id, channel->message_encoding,
                                       channel->metadata),
                  channel->id);
        return {};
      }
      case Opcode::Message:
        return writer->write(*decode<Message>(view.content));
      case Opcode::Attachment:
        return writer->write_attachment(*decode<Attachment>(view.content));
      case Opcode::Metadata:
        return writer->write_metadata(*decode<Metadata>(view.content));
      default:
        return {};
    }
  };
  EXPECT_TRUE(read_stream(source, {}, write));
  EXPECT_TRUE(writer->close());
  return file;
}

// Files with padding for future fields ("pad") are written without it, so their bytes equal those of the file
// whose name lacks "pad".
TEST(McapConformance, WriterReproducesEveryFileByteForByte) {
  WAYMARK_REAL_DATA(corpus, "mcap-conformance");
  for (const auto& path : files_of(corpus)) {
    const auto source = open_file(path);
    const Bytes ours = rewritten(**source, options_of(path.stem().string()));
    std::string plain = path.string();
    if (const std::size_t pad = plain.find("-pad"); pad != std::string::npos) plain.erase(pad, 4);
    std::ifstream file(plain, std::ios::binary);
    const Bytes theirs{std::istreambuf_iterator<char>(file), {}};
    EXPECT_FALSE(theirs.empty()) << plain;
    EXPECT_EQ(ours, theirs) << path;
  }
}

}  // namespace
}  // namespace waymark::mcap
