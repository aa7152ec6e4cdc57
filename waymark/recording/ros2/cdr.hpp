#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/recording/byte_io.hpp"

/// Plain CDR version 1, little-endian, the encoding of ROS 2 messages (OMG "DDS Interoperability Wire
/// Protocol", section 10; OMG "CORBA", section 15.3). Every number is aligned to its own size, counted from
/// the end of the four encapsulation bytes.
///
/// A message struct lists its fields in the order of its .msg file:
///     template <class Self, class Visit> static void fields(Self& self, Visit&& visit) { visit(self.x,
///     self.y); }
namespace waymark::cdr {

inline constexpr std::uint8_t kLittleEndian[4] = {0x00, 0x01, 0x00, 0x00};

template <class T>
concept Number = std::integral<T> || std::floating_point<T>;

template <class T>
concept Struct = requires(T& value) { T::fields(value, [](auto&...) {}); };

class Encoder {
 public:
  explicit Encoder(Bytes& out) : out_(out) {
    append(out_, kLittleEndian);
    origin_ = out_.size();
  }

  template <Number T>
  void write(T value) {
    while ((out_.size() - origin_) % sizeof(T) != 0) out_.push_back(0);
    append_little_endian(out_, value);
  }
  void write(bool value) { write(static_cast<std::uint8_t>(value)); }
  void write(const std::string& text) {
    write(static_cast<std::uint32_t>(text.size() + 1));
    append(out_, as_bytes(text));
    out_.push_back(0);
  }
  void write(const Bytes& bytes) {
    write(static_cast<std::uint32_t>(bytes.size()));
    append(out_, bytes);
  }
  template <class T>
  void write(const std::vector<T>& values) {
    write(static_cast<std::uint32_t>(values.size()));
    for (const T& value : values) write(value);
  }
  template <class T, std::size_t kCount>
  void write(const std::array<T, kCount>& values) {
    for (const T& value : values) write(value);
  }
  template <Struct T>
  void write(const T& value) {
    T::fields(value, [this](const auto&... fields) { (this->write(fields), ...); });
  }

 private:
  Bytes& out_;
  std::size_t origin_ = 0;
};

class Decoder {
 public:
  explicit Decoder(ByteSpan body) : in_(body) {}
  [[nodiscard]] bool failed() const { return in_.failed(); }

  template <Number T>
  void read(T& value) {
    (void)in_.take((sizeof(T) - in_.position() % sizeof(T)) % sizeof(T));
    value = in_.number<T>();
  }
  void read(bool& value) {
    std::uint8_t byte = 0;
    read(byte);
    value = byte != 0;
  }
  void read(std::string& text) {
    std::uint32_t size = 0;
    read(size);
    const ByteSpan bytes = in_.take(size);
    text = as_text(bytes.empty() || bytes.back() != 0 ? bytes : bytes.first(bytes.size() - 1));
  }
  void read(Bytes& bytes) {
    std::uint32_t size = 0;
    read(size);
    const ByteSpan part = in_.take(size);
    bytes.assign(part.begin(), part.end());
  }
  template <class T>
  void read(std::vector<T>& values) {
    std::uint32_t count = 0;
    read(count);
    values.clear();
    // An element takes at least one byte, so an excessive count ends with the data instead of exhausting
    // memory.
    for (std::uint32_t i = 0; i < count && !failed() && in_.remaining() > 0; ++i) read(values.emplace_back());
    if (values.size() != count) (void)in_.take(in_.remaining() + 1);
  }
  template <class T, std::size_t kCount>
  void read(std::array<T, kCount>& values) {
    for (T& value : values) read(value);
  }
  template <Struct T>
  void read(T& value) {
    T::fields(value, [this](auto&... fields) { (this->read(fields), ...); });
  }

 private:
  ByteReader in_;
};

template <Struct Message>
[[nodiscard]] Bytes encode(const Message& message) {
  Bytes out;
  Encoder(out).write(message);
  return out;
}

/// Fails on truncated data and on anything but plain little-endian CDR.
template <Struct Message>
[[nodiscard]] Result<Message> decode(ByteSpan bytes) {
  if (bytes.size() < sizeof(kLittleEndian) ||
      !std::ranges::equal(bytes.first(2), ByteSpan(kLittleEndian).first(2))) {
    return fail(ErrorCode::Unsupported, "not plain little-endian CDR (encapsulation 00 01)");
  }
  Decoder decoder(bytes.subspan(sizeof(kLittleEndian)));
  Message message;
  decoder.read(message);
  if (decoder.failed()) return fail(ErrorCode::Unreadable, "CDR message too short for its type");
  return message;
}

}  // namespace waymark::cdr
