#include "waymark/recording/ros1_bag_records.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace waymark::ros1bag {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint32_t kMaxHeader = 1 << 20;

std::optional<Op> op_of(const Fields& fields) {
  const auto op = fields.number<std::uint8_t>("op");
  if (!op || *op < static_cast<std::uint8_t>(Op::Message) || *op > static_cast<std::uint8_t>(Op::Connection))
    return std::nullopt;
  return static_cast<Op>(*op);
}

tl::unexpected<Error> no_record(const ByteSource& source, std::uint64_t offset) {
  return fail(ErrorCode::Unreadable, "no record of a ROS bag here",
              {.source = source.name(), .byte = static_cast<std::int64_t>(offset)});
}

}  // namespace

std::optional<Fields> Fields::parse(ByteSpan header) {
  Fields out;
  ByteReader in(header);
  while (in.remaining() > 0) {
    const ByteSpan field = in.counted<std::uint32_t>();
    const std::string_view text = as_text(field);
    const std::size_t equals = text.find('=');
    if (in.failed() || equals == std::string_view::npos) return std::nullopt;
    out.fields_.emplace_back(text.substr(0, equals), field.subspan(equals + 1));
  }
  return out;
}

std::optional<ByteSpan> Fields::find(std::string_view name) const {
  const auto field = std::ranges::find(fields_, name, [](const auto& f) { return f.first; });
  return field == fields_.end() ? std::nullopt : std::optional(field->second);
}

std::string Fields::text(std::string_view name) const {
  return std::string(as_text(find(name).value_or(ByteSpan{})));
}

std::optional<std::uint64_t> Fields::time(std::string_view name) const {
  const auto bytes = find(name);
  return bytes && bytes->size() == 8 ? std::optional(time_ns(bytes->data())) : std::nullopt;
}

std::uint64_t time_ns(const std::uint8_t* bytes) {
  return from_little_endian<std::uint32_t>(bytes) * kSecond + from_little_endian<std::uint32_t>(bytes + 4);
}

std::optional<Record> next_record(ByteReader& bytes) {
  const ByteSpan header = bytes.counted<std::uint32_t>();
  const ByteSpan data = bytes.counted<std::uint32_t>();
  if (bytes.failed()) return std::nullopt;
  auto fields = Fields::parse(header);
  if (!fields) return std::nullopt;
  const std::optional<Op> op = op_of(*fields);
  if (!op) return std::nullopt;
  return Record{*op, std::move(*fields), data};
}

Result<RecordPlace> read_place(const ByteSource& source, std::uint64_t offset) {
  std::array<std::uint8_t, 4> length{};
  if (!source.read(offset, length)) return no_record(source, offset);
  const auto header_size = from_little_endian<std::uint32_t>(length.data());
  if (header_size > kMaxHeader) return no_record(source, offset);
  RecordPlace place{.header = Bytes(header_size), .offset = offset};
  place.data_offset = offset + 8 + header_size;
  if (!source.read(offset + 4, place.header) || !source.read(place.data_offset - 4, length))
    return no_record(source, offset);
  place.data_size = from_little_endian<std::uint32_t>(length.data());
  const auto fields = Fields::parse(place.header);
  if (!fields || !op_of(*fields)) return no_record(source, offset);
  return place;
}

std::optional<Connection> connection_of(const Fields& header, ByteSpan data) {
  const auto id = header.number<std::uint32_t>("conn");
  const auto fields = Fields::parse(data);
  if (!id || !fields) return std::nullopt;
  Connection connection{.id = *id,
                        .topic = header.text("topic"),
                        .type = fields->text("type"),
                        .md5sum = fields->text("md5sum"),
                        .definition = fields->text("message_definition"),
                        .caller = fields->text("callerid"),
                        .latching = fields->text("latching") == "1"};
  if (connection.topic.empty()) connection.topic = fields->text("topic");
  return connection;
}

}  // namespace waymark::ros1bag
