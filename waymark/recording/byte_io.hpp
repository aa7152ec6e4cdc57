#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace waymark {

using Bytes = std::vector<std::uint8_t>;
using ByteSpan = std::span<const std::uint8_t>;

/// Reads a number in little-endian byte order, on any machine.
template <class T>
  requires std::integral<T> || std::floating_point<T>
[[nodiscard]] T from_little_endian(const std::uint8_t* bytes) {
  T value{};
  if constexpr (std::endian::native == std::endian::little) {
    std::memcpy(&value, bytes, sizeof(T));
  } else {
    std::uint8_t raw[sizeof(T)];
    for (std::size_t i = 0; i < sizeof(T); ++i) raw[i] = bytes[sizeof(T) - 1 - i];
    std::memcpy(&value, raw, sizeof(T));
  }
  return value;
}

/// Writes sizeof(T) bytes.
template <class T>
  requires std::integral<T> || std::floating_point<T>
void put_little_endian(std::uint8_t* out, T value) {
  std::uint8_t raw[sizeof(T)];
  std::memcpy(raw, &value, sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i)
    out[i] = raw[std::endian::native == std::endian::little ? i : sizeof(T) - 1 - i];
}

template <class T>
  requires std::integral<T> || std::floating_point<T>
void append_little_endian(Bytes& out, T value) {
  std::uint8_t raw[sizeof(T)];
  put_little_endian(raw, value);
  out.insert(out.end(), raw, raw + sizeof(T));
}

/// Reads forward through bytes it does not own. A read past the end sets failed(); from then on, numbers are
/// zero and spans are empty. Nothing is ever read out of bounds, so one check of failed() at the end is
/// enough.
class ByteReader {
 public:
  explicit ByteReader(ByteSpan bytes) : bytes_(bytes) {}

  [[nodiscard]] bool failed() const { return failed_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }

  [[nodiscard]] ByteSpan take(std::uint64_t count) {
    if (failed_ || count > remaining()) {
      failed_ = true;
      return {};
    }
    const ByteSpan part = bytes_.subspan(position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return part;
  }

  template <class T>
  [[nodiscard]] T number() {
    const ByteSpan raw = take(sizeof(T));
    return raw.empty() ? T{} : from_little_endian<T>(raw.data());
  }

  /// Bytes preceded by their count, which has type Length.
  template <class Length>
  [[nodiscard]] ByteSpan counted() {
    return take(number<Length>());
  }

 private:
  ByteSpan bytes_;
  std::size_t position_ = 0;
  bool failed_ = false;
};

[[nodiscard]] inline std::string_view as_text(ByteSpan bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

[[nodiscard]] inline ByteSpan as_bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

inline void append(Bytes& out, ByteSpan part) { out.insert(out.end(), part.begin(), part.end()); }

/// A ByteReader for numbers in big-endian order.
class BigEndianReader {
 public:
  explicit BigEndianReader(ByteSpan bytes) : in_(bytes) {}
  [[nodiscard]] bool failed() const { return in_.failed(); }
  [[nodiscard]] std::size_t remaining() const { return in_.remaining(); }

  void fail() { (void)in_.take(std::uint64_t{in_.remaining()} + 1); }

  template <class T>
  [[nodiscard]] T number() {
    const ByteSpan raw = in_.take(sizeof(T));
    if (raw.empty()) return T{};
    std::array<std::uint8_t, sizeof(T)> turned{};
    std::reverse_copy(raw.begin(), raw.end(), turned.begin());
    return from_little_endian<T>(turned.data());
  }
  template <class T, std::size_t kCount>
  void numbers(std::array<T, kCount>& out) {
    for (T& value : out) value = number<T>();
  }
  /// Reads `count` numbers. A count that exceeds the remaining bytes fails before memory is allocated.
  template <class T>
  void numbers(std::vector<T>& out, std::uint64_t count) {
    if (failed() || count > remaining() / sizeof(T)) {
      fail();
      return;
    }
    out.resize(static_cast<std::size_t>(count));
    for (T& value : out) value = number<T>();
  }

 private:
  ByteReader in_;
};

/// Writes numbers in big-endian order.
class BigEndianWriter {
 public:
  template <class T>
  void number(T value) {
    static_assert(std::endian::native == std::endian::little || std::endian::native == std::endian::big);
    std::array<std::uint8_t, sizeof(T)> raw{};
    std::memcpy(raw.data(), &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::little) std::ranges::reverse(raw);
    bytes_.insert(bytes_.end(), raw.begin(), raw.end());
  }
  template <class Numbers>
  void numbers(const Numbers& values) {
    for (const auto value : values) number(value);
  }
  [[nodiscard]] Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_{};
};

}  // namespace waymark
