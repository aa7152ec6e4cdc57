#include "waymark/robots/ros2/message_text.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros_definition.hpp"

namespace waymark {
namespace {

using ros::Primitive;

constexpr std::size_t kEncapsulation = 4;
constexpr std::size_t kMostText = std::size_t{1} << 20U;

/// Reads a message along its definition and writes it down.
class Walk {
 public:
  Walk(const ros::Definition& definition, ByteSpan body, std::size_t most_elements)
      : definition_(definition), in_(body), most_elements_(most_elements) {}

  void structure(std::size_t number, int indent) {
    for (const ros::Field& field : definition_.structs[number].fields) {
      if (in_.failed()) return;
      write(indent, field.name + ":");
      this->field(field, indent);
    }
  }
  [[nodiscard]] bool failed() const { return in_.failed(); }
  [[nodiscard]] std::string take_text() { return std::move(text_); }

 private:
  void field(const ros::Field& field, int indent) {
    if (field.repeat == ros::Repeat::One) return element(field, indent);
    const std::uint32_t count = field.repeat == ros::Repeat::Sequence ? number<std::uint32_t>() : field.count;
    if (count == 0) return write(0, " []\n");
    if (field.type != Primitive::Struct) return values(field, count);
    write(0, "\n");
    for (std::uint32_t i = 0; i < count && !in_.failed(); ++i) {
      write(indent, i < most_elements_ ? "-\n" : "");
      hidden_ += i < most_elements_ ? 0 : 1;
      structure(field.structure, indent + 1);
      hidden_ -= i < most_elements_ ? 0 : 1;
    }
    if (count > most_elements_) write(indent, fmt::format("# {} in all\n", count));
  }

  void values(const ros::Field& field, std::uint32_t count) {
    write(0, " [");
    for (std::uint32_t i = 0; i < count && !in_.failed(); ++i) {
      const std::string value = this->value(field.type);
      if (i < most_elements_) write(0, (i > 0 ? ", " : "") + value);
    }
    write(0, count > most_elements_ ? fmt::format(", …] # {} in all\n", count) : "]\n");
  }

  void element(const ros::Field& field, int indent) {
    if (field.type != Primitive::Struct) return write(0, " " + value(field.type) + "\n");
    write(0, "\n");
    structure(field.structure, indent + 1);
  }

  std::string value(Primitive type) {
    switch (type) {
      case Primitive::Bool:
        return number<std::uint8_t>() != 0 ? "true" : "false";
      case Primitive::Int8:
        return fmt::format("{}", number<std::int8_t>());
      case Primitive::UInt8:
        return fmt::format("{}", number<std::uint8_t>());
      case Primitive::Int16:
        return fmt::format("{}", number<std::int16_t>());
      case Primitive::UInt16:
        return fmt::format("{}", number<std::uint16_t>());
      case Primitive::Int32:
        return fmt::format("{}", number<std::int32_t>());
      case Primitive::UInt32:
        return fmt::format("{}", number<std::uint32_t>());
      case Primitive::Int64:
        return fmt::format("{}", number<std::int64_t>());
      case Primitive::UInt64:
        return fmt::format("{}", number<std::uint64_t>());
      case Primitive::Float32:
        return fmt::format("{}", number<float>());
      case Primitive::Float64:
        return fmt::format("{}", number<double>());
      default:
        return text();
    }
  }

  std::string text() {
    const ByteSpan bytes = in_.take(number<std::uint32_t>());
    std::string words = "'";
    for (const std::uint8_t byte : bytes) {
      if (byte == 0) break;
      words += byte >= 0x20 && byte != 0x7f ? std::string(1, static_cast<char>(byte)) : "?";
    }
    return words + "'";
  }

  template <class T>
  T number() {
    (void)in_.take((sizeof(T) - in_.position() % sizeof(T)) % sizeof(T));
    return in_.number<T>();
  }

  void write(int indent, std::string_view words) {
    if (hidden_ > 0 || text_.size() > kMostText) return;
    if (!words.empty()) text_ += std::string(2 * static_cast<std::size_t>(indent), ' ');
    text_ += words;
  }

  const ros::Definition& definition_;
  ByteReader in_;
  std::size_t most_elements_;
  int hidden_ = 0;
  std::string text_{};
};

}  // namespace

Result<std::string> message_text(std::string_view type, std::span<const std::uint8_t> cdr,
                                 std::size_t most_elements) {
  const std::string schema = ros2::schema_text(type);
  if (schema.empty())
    return fail(ErrorCode::Unsupported, fmt::format("messages of the type {} cannot be shown", type),
                {.key = std::string(type)}, "`waymark ros2 topic hz` counts them.");
  const auto definition = ros::parse_definition(type, schema);
  if (!definition) return tl::unexpected(definition.error());
  if (cdr.size() < kEncapsulation || cdr[0] != 0 || cdr[1] != 1)
    return fail(ErrorCode::Unsupported, "the message is not plain little-endian CDR (encapsulation 00 01)");
  Walk walk(*definition, cdr.subspan(kEncapsulation), most_elements);
  walk.structure(0, 0);
  if (walk.failed())
    return fail(ErrorCode::Unreadable,
                fmt::format("a message of {} bytes ends too early for its type {}", cdr.size(), type));
  return walk.take_text();
}

}  // namespace waymark
