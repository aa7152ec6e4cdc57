#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_io.hpp"

/// Records of an MCAP file as plain structs, named as in the "MCAP Format Specification", section "Records".
/// Each lists its fields once, in file order; encode() and decode() use that list.
///
/// Spans point into the bytes from which a record was decoded.
namespace waymark::mcap {

inline constexpr std::uint8_t kMagic[8] = {0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
/// Size of the opcode (1 byte) and content length (8 bytes) before every record.
inline constexpr std::size_t kRecordPrefixSize = 9;

enum class Opcode : std::uint8_t {
  Header = 0x01,
  Footer = 0x02,
  Schema = 0x03,
  Channel = 0x04,
  Message = 0x05,
  Chunk = 0x06,
  MessageIndex = 0x07,
  ChunkIndex = 0x08,
  Attachment = 0x09,
  AttachmentIndex = 0x0A,
  Statistics = 0x0B,
  Metadata = 0x0C,
  MetadataIndex = 0x0D,
  SummaryOffset = 0x0E,
  DataEnd = 0x0F,
};

/// Bytes that are either preceded by a 32-bit or 64-bit count, or the rest of the record.
struct Bytes32 {
  ByteSpan bytes{};
};
struct Bytes64 {
  ByteSpan bytes{};
};
struct Rest {
  ByteSpan bytes{};
};

struct Header {
  static constexpr auto kOpcode = Opcode::Header;
  std::string profile{};
  std::string library{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.profile, self.library);
  }
};

struct Footer {
  static constexpr auto kOpcode = Opcode::Footer;
  std::uint64_t summary_start = 0;
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.summary_start, self.summary_offset_start, self.summary_crc);
  }
};

struct Schema {
  static constexpr auto kOpcode = Opcode::Schema;
  std::uint16_t id = 0;  ///< never 0, which means "no schema" in a channel
  std::string name{};
  std::string encoding{};
  Bytes32 data{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.id, self.name, self.encoding, self.data);
  }
};

struct Channel {
  static constexpr auto kOpcode = Opcode::Channel;
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;
  std::string topic{};
  std::string message_encoding{};
  std::map<std::string, std::string> metadata{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.id, self.schema_id, self.topic, self.message_encoding, self.metadata);
  }
};

struct Message {
  static constexpr auto kOpcode = Opcode::Message;
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0;      ///< [ns] time of recording
  std::uint64_t publish_time = 0;  ///< [ns] time of publication
  Rest data{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.channel_id, self.sequence, self.log_time, self.publish_time, self.data);
  }
};

struct Chunk {
  static constexpr auto kOpcode = Opcode::Chunk;
  std::uint64_t message_start_time = 0;
  std::uint64_t message_end_time = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0 if not computed
  std::string compression{};           ///< "", "lz4" or "zstd"
  Bytes64 records{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.message_start_time, self.message_end_time, self.uncompressed_size, self.uncompressed_crc,
          self.compression, self.records);
  }
};

struct MessageIndex {
  static constexpr auto kOpcode = Opcode::MessageIndex;
  std::uint16_t channel_id = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>>
      records{};  ///< log_time [ns], offset in the uncompressed chunk
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.channel_id, self.records);
  }
};

struct ChunkIndex {
  static constexpr auto kOpcode = Opcode::ChunkIndex;
  std::uint64_t message_start_time = 0;
  std::uint64_t message_end_time = 0;
  std::uint64_t chunk_start_offset = 0;
  std::uint64_t chunk_length = 0;
  std::map<std::uint16_t, std::uint64_t> message_index_offsets{};
  std::uint64_t message_index_length = 0;
  std::string compression{};
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.message_start_time, self.message_end_time, self.chunk_start_offset, self.chunk_length,
          self.message_index_offsets, self.message_index_length, self.compression, self.compressed_size,
          self.uncompressed_size);
  }
};

struct Attachment {
  static constexpr auto kOpcode = Opcode::Attachment;
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::string name{};
  std::string media_type{};
  Bytes64 data{};
  std::uint32_t crc = 0;  ///< CRC of all fields before it; 0 if not computed
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.log_time, self.create_time, self.name, self.media_type, self.data, self.crc);
  }
};

struct AttachmentIndex {
  static constexpr auto kOpcode = Opcode::AttachmentIndex;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::uint64_t log_time = 0;
  std::uint64_t create_time = 0;
  std::uint64_t data_size = 0;
  std::string name{};
  std::string media_type{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.offset, self.length, self.log_time, self.create_time, self.data_size, self.name,
          self.media_type);
  }
};

struct Statistics {
  static constexpr auto kOpcode = Opcode::Statistics;
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t attachment_count = 0;
  std::uint32_t metadata_count = 0;
  std::uint32_t chunk_count = 0;
  std::uint64_t message_start_time = 0;
  std::uint64_t message_end_time = 0;
  std::map<std::uint16_t, std::uint64_t> channel_message_counts{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.message_count, self.schema_count, self.channel_count, self.attachment_count,
          self.metadata_count, self.chunk_count, self.message_start_time, self.message_end_time,
          self.channel_message_counts);
  }
};

struct Metadata {
  static constexpr auto kOpcode = Opcode::Metadata;
  std::string name{};
  std::map<std::string, std::string> metadata{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.name, self.metadata);
  }
};

struct MetadataIndex {
  static constexpr auto kOpcode = Opcode::MetadataIndex;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name{};
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.offset, self.length, self.name);
  }
};

struct SummaryOffset {
  static constexpr auto kOpcode = Opcode::SummaryOffset;
  std::uint8_t group_opcode = 0;
  std::uint64_t group_start = 0;
  std::uint64_t group_length = 0;
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.group_opcode, self.group_start, self.group_length);
  }
};

struct DataEnd {
  static constexpr auto kOpcode = Opcode::DataEnd;
  std::uint32_t data_section_crc = 0;  ///< 0 if not computed
  template <class Self, class Visit>
  static void fields(Self& self, Visit&& visit) {
    visit(self.data_section_crc);
  }
};

/// Appends a record's content (without opcode and length).
template <class Record>
void encode_content(Bytes& out, const Record& record);

/// Appends a whole record: opcode, length, content.
template <class Record>
void encode(Bytes& out, const Record& record);

/// Decodes a record from its content. Additional bytes at the end, which the specification allows for future
/// fields, are ignored. Fails if the content is truncated.
template <class Record>
[[nodiscard]] Result<Record> decode(ByteSpan content);

}  // namespace waymark::mcap
