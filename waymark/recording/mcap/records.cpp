#include "waymark/recording/mcap/records.hpp"

#include <fmt/format.h>

namespace waymark::mcap {
namespace {

struct Encoder {
  Bytes& out;

  template <class... Fields>
  void operator()(const Fields&... fields) {
    (write(fields), ...);
  }

  template <std::integral T>
  void write(T value) {
    append_little_endian(out, value);
  }
  void write(const std::string& text) {
    write(static_cast<std::uint32_t>(text.size()));
    append(out, as_bytes(text));
  }
  void write(const Bytes32& part) {
    write(static_cast<std::uint32_t>(part.bytes.size()));
    append(out, part.bytes);
  }
  void write(const Bytes64& part) {
    write(static_cast<std::uint64_t>(part.bytes.size()));
    append(out, part.bytes);
  }
  void write(const Rest& part) { append(out, part.bytes); }
  // Arrays and maps are encoded as their size in bytes, followed by the pairs.
  template <class Pairs>
    requires requires(const Pairs& pairs) { pairs.begin()->second; }
  void write(const Pairs& pairs) {
    const std::size_t at = out.size();
    write(std::uint32_t{0});
    for (const auto& [first, second] : pairs) {
      if constexpr (std::integral<std::remove_cvref_t<decltype(first)>> &&
                    std::integral<std::remove_cvref_t<decltype(second)>>) {
        std::uint8_t raw[sizeof(first) + sizeof(second)];
        put_little_endian(raw, first);
        put_little_endian(raw + sizeof(first), second);
        append(out, raw);
      } else {
        write(first);
        write(second);
      }
    }
    put_little_endian(out.data() + at, static_cast<std::uint32_t>(out.size() - at - 4));
  }
};

struct Decoder {
  ByteReader& in;

  template <class... Fields>
  void operator()(Fields&... fields) {
    (read(in, fields), ...);
  }

  template <std::integral T>
  static void read(ByteReader& in, T& value) {
    value = in.number<T>();
  }
  static void read(ByteReader& in, std::string& text) { text = as_text(in.counted<std::uint32_t>()); }
  static void read(ByteReader& in, Bytes32& part) { part.bytes = in.counted<std::uint32_t>(); }
  static void read(ByteReader& in, Bytes64& part) { part.bytes = in.counted<std::uint64_t>(); }
  static void read(ByteReader& in, Rest& part) { part.bytes = in.take(in.remaining()); }
  template <class Key, class Value>
  static void read(ByteReader& in, std::map<Key, Value>& pairs) {
    read_pairs<Key, Value>(
        in, [&](Key key, Value value) { pairs.insert_or_assign(std::move(key), std::move(value)); });
  }
  template <class First, class Second>
  static void read(ByteReader& in, std::vector<std::pair<First, Second>>& pairs) {
    read_pairs<First, Second>(in, [&](First first, Second second) { pairs.emplace_back(first, second); });
  }
  template <class First, class Second, class Insert>
  static void read_pairs(ByteReader& in, Insert insert) {
    ByteReader inside(in.counted<std::uint32_t>());
    while (inside.remaining() > 0 && !inside.failed()) {
      First first{};
      Second second{};
      read(inside, first);
      read(inside, second);
      if (!inside.failed()) insert(std::move(first), std::move(second));
    }
    if (inside.failed()) (void)in.take(in.remaining() + 1);  // a truncated pair fails the record
  }
};

}  // namespace

template <class Record>
void encode_content(Bytes& out, const Record& record) {
  Record::fields(record, Encoder{out});
}

template <class Record>
void encode(Bytes& out, const Record& record) {
  out.push_back(static_cast<std::uint8_t>(Record::kOpcode));
  const std::size_t at = out.size();
  append_little_endian(out, std::uint64_t{0});
  encode_content(out, record);
  put_little_endian(out.data() + at, static_cast<std::uint64_t>(out.size() - at - 8));
}

template <class Record>
Result<Record> decode(ByteSpan content) {
  ByteReader in(content);
  Record record;
  Record::fields(record, Decoder{in});
  if (in.failed()) {
    return fail(ErrorCode::Unreadable, fmt::format("truncated MCAP record of kind 0x{:02x} with {} bytes",
                                                   static_cast<unsigned>(Record::kOpcode), content.size()));
  }
  return record;
}

#define WAYMARK_MCAP_RECORD(Record)                        \
  template void encode_content(Bytes& out, const Record&); \
  template void encode(Bytes& out, const Record&);         \
  template Result<Record> decode<Record>(ByteSpan content);
WAYMARK_MCAP_RECORD(Header)
WAYMARK_MCAP_RECORD(Footer)
WAYMARK_MCAP_RECORD(Schema)
WAYMARK_MCAP_RECORD(Channel)
WAYMARK_MCAP_RECORD(Message)
WAYMARK_MCAP_RECORD(Chunk)
WAYMARK_MCAP_RECORD(MessageIndex)
WAYMARK_MCAP_RECORD(ChunkIndex)
WAYMARK_MCAP_RECORD(Attachment)
WAYMARK_MCAP_RECORD(AttachmentIndex)
WAYMARK_MCAP_RECORD(Statistics)
WAYMARK_MCAP_RECORD(Metadata)
WAYMARK_MCAP_RECORD(MetadataIndex)
WAYMARK_MCAP_RECORD(SummaryOffset)
WAYMARK_MCAP_RECORD(DataEnd)
#undef WAYMARK_MCAP_RECORD

}  // namespace waymark::mcap
