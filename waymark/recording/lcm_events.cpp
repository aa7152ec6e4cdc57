#include "waymark/recording/lcm_events.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "waymark/recording/big_endian.hpp"

namespace waymark::lcm {
namespace {

constexpr std::uint64_t kWindow = 1 << 20;

struct Header {
  std::uint32_t sync = 0;
  std::int64_t number = 0;
  std::int64_t receive_us = 0;
  std::int32_t channel_size = 0;
  std::int32_t payload_size = 0;
};

Header parse(ByteSpan bytes) {
  BigEndianReader in(bytes);
  Header header;
  header.sync = in.number<std::uint32_t>();
  header.number = in.number<std::int64_t>();
  header.receive_us = in.number<std::int64_t>();
  header.channel_size = in.number<std::int32_t>();
  header.payload_size = in.number<std::int32_t>();
  return header;
}

std::uint64_t event_size(const Header& header) {
  return kHeaderSize + static_cast<std::uint64_t>(header.channel_size) +
         static_cast<std::uint64_t>(header.payload_size);
}

}  // namespace

bool plausible_event(ByteSpan bytes, std::uint64_t rest) {
  if (bytes.size() < kHeaderSize) return false;
  const Header header = parse(bytes.first(kHeaderSize));
  return header.sync == kSync && header.channel_size > 0 && header.channel_size <= kMaxChannelName &&
         header.payload_size >= 0 && event_size(header) <= rest;
}

EventReader::EventReader(const ByteSource& source, std::uint64_t size, std::uint64_t max_event_bytes)
    : source_(source), size_(size), max_event_bytes_(max_event_bytes) {}

ByteSpan EventReader::window(std::uint64_t offset, std::uint64_t size) {
  if (offset > size_ || size > size_ - offset) return {};
  const bool inside = offset >= window_start_ && offset + size <= window_start_ + window_.size();
  if (!inside) {
    window_.resize(static_cast<std::size_t>(std::min(std::max(size, kWindow), size_ - offset)));
    window_start_ = offset;
    if (!source_.read(offset, window_)) {
      window_.clear();
      return {};
    }
  }
  return ByteSpan(window_).subspan(static_cast<std::size_t>(offset - window_start_),
                                   static_cast<std::size_t>(size));
}

ByteSpan EventReader::header_at(std::uint64_t offset) {
  const bool inside = offset >= window_start_ && offset + kHeaderSize <= window_start_ + window_.size();
  if (inside) return window(offset, kHeaderSize);
  // A look ahead must not move the window: damage would have it read again and again.
  if (offset > size_ || size_ - offset < kHeaderSize || !source_.read(offset, header_)) return {};
  return header_;
}

bool EventReader::event_at(std::uint64_t offset) {
  const ByteSpan bytes = header_at(offset);
  if (!plausible_event(bytes, size_ - offset)) return false;
  return event_size(parse(bytes)) <= max_event_bytes_;
}

std::uint64_t EventReader::find_event(std::uint64_t offset) {
  for (; offset < size_; ++offset) {
    const ByteSpan sync = window(offset, 1);
    if (sync.empty()) return size_;
    if (sync[0] != (kSync >> 24) || !event_at(offset)) continue;
    // A sync word may stand in a payload by chance: another event, or the end, must follow.
    const std::uint64_t end = offset + event_size(parse(header_at(offset)));
    if (end == size_ || event_at(end)) return offset;
  }
  return size_;
}

void EventReader::note_damage(std::uint64_t from, std::uint64_t to, LogProblems& problems) const {
  const Place place{.source = source_.name(), .byte = static_cast<std::int64_t>(from)};
  if (to == size_) {
    problems.damage("lcm.cut", [&] {
      return Error{
          ErrorCode::Unreadable,
          fmt::format("the log ends in the middle of an event; its last {} bytes are none", to - from), place,
          "What precedes them is read."};
    });
  } else {
    problems.damage("lcm.resync", [&] {
      return Error{ErrorCode::Unreadable,
                   fmt::format("no event begins here; reading goes on {} bytes later", to - from),
                   place,
                   {}};
    });
  }
}

std::optional<Event> EventReader::next(LogProblems& problems) {
  if (offset_ >= size_) return std::nullopt;
  if (!event_at(offset_)) {
    const std::uint64_t found = find_event(offset_ + 1);
    note_damage(offset_, found, problems);
    offset_ = found;
    if (offset_ >= size_) return std::nullopt;
  }
  const Header header = parse(window(offset_, kHeaderSize));
  const ByteSpan bytes = window(offset_, event_size(header));
  if (bytes.empty()) return std::nullopt;  // the file shrank under our hands
  const auto channel_size = static_cast<std::size_t>(header.channel_size);
  const Event event{.offset = offset_,
                    .number = header.number,
                    .receive_us = header.receive_us,
                    .channel = as_text(bytes.subspan(kHeaderSize, channel_size)),
                    .payload = bytes.subspan(kHeaderSize + channel_size)};
  offset_ += event_size(header);
  return event;
}

}  // namespace waymark::lcm
