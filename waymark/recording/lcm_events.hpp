#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/log_problems.hpp"

/// Event logs of LCM (Lightweight Communications and Marshalling, lcm/eventlog.c): events one after another,
/// big-endian, without header, index or checksum.
namespace waymark::lcm {

inline constexpr std::uint32_t kSync = 0xEDA1DA01;
inline constexpr std::size_t kHeaderSize = 28;
inline constexpr std::int32_t kMaxChannelName = 63;

struct Event {
  std::uint64_t offset = 0;  ///< in the file
  std::int64_t number = 0;   ///< counted over all channels
  std::int64_t receive_us = 0;
  std::string_view channel{};
  ByteSpan payload{};
};

/// Whether an event begins at these bytes, of which the file still has `rest`.
[[nodiscard]] bool plausible_event(ByteSpan header, std::uint64_t rest);

/// Reads events front to back; memory: one event and a window of a mebibyte.
class EventReader {
 public:
  EventReader(const ByteSource& source, std::uint64_t size, std::uint64_t max_event_bytes);

  /// The next event, nothing at the end; its bytes are gone with the next call. Over damage it goes byte by
  /// byte until an event begins again, and notes how much it passed over.
  std::optional<Event> next(LogProblems& problems);

 private:
  /// Bytes [offset, offset + size) of the file; empty when it has not as many.
  ByteSpan window(std::uint64_t offset, std::uint64_t size);
  ByteSpan header_at(std::uint64_t offset);
  [[nodiscard]] bool event_at(std::uint64_t offset);
  [[nodiscard]] std::uint64_t find_event(std::uint64_t offset);
  void note_damage(std::uint64_t from, std::uint64_t to, LogProblems& problems) const;

  const ByteSource& source_;
  std::uint64_t size_;
  std::uint64_t max_event_bytes_;
  std::uint64_t offset_ = 0;
  std::uint64_t window_start_ = 0;
  Bytes window_;
  std::array<std::uint8_t, kHeaderSize> header_{};
};

}  // namespace waymark::lcm
