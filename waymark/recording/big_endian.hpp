#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "waymark/recording/byte_io.hpp"

namespace waymark {

/// ByteReader for numbers whose most significant byte comes first.
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
  /// `count` numbers; a count that the bytes cannot hold fails before memory is taken.
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

/// The other direction.
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
