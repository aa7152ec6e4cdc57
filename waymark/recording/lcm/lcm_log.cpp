#include "waymark/recording/lcm/lcm_log.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/lcm/mbot_samples.hpp"
#include "waymark/recording/message_log.hpp"

/// LCM event logs (Lightweight Communications and Marshalling, lcm/eventlog.c): consecutive big-endian events
/// without a file header, index or checksum.
namespace waymark::lcm {
namespace {

constexpr std::uint32_t kSync = 0xEDA1DA01;
constexpr std::size_t kHeaderSize = 28;
constexpr std::int32_t kMaxChannelName = 63;

struct Event {
  std::uint64_t offset = 0;  ///< position in the file
  std::int64_t number = 0;   ///< counted over all channels
  std::int64_t receive_us = 0;
  std::string_view channel{};
  ByteSpan payload{};
};

/// Reads events sequentially. Holds one event and a window of 1 MiB in memory.
class EventReader {
 public:
  EventReader(const ByteSource& source, std::uint64_t size, std::uint64_t max_event_bytes);

  /// The next event, valid until the next call; empty at the end. After damage, searches byte by byte for the
  /// next event and notes the number of skipped bytes.
  std::optional<Event> next(LogProblems& problems);

 private:
  /// Bytes [offset, offset + size) of the file; empty if the file is shorter.
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

/// Whether an event can begin at these bytes, if `rest` bytes remain in the file.
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
  // Looking ahead must not move the window, because damaged data would then be read repeatedly.
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
    // A sync word may occur in a payload by chance, so another event or the end of the file must follow.
    const std::uint64_t end = offset + event_size(parse(header_at(offset)));
    if (end == size_ || event_at(end)) return offset;
  }
  return size_;
}

void EventReader::note_damage(std::uint64_t from, std::uint64_t to, LogProblems& problems) const {
  const Place place{.source = source_.name(), .byte = static_cast<std::int64_t>(from)};
  if (to == size_) {
    problems.damage("lcm.cut", [&] {
      return Error{ErrorCode::Unreadable,
                   fmt::format("the last {} bytes are not a complete event", to - from), place,
                   "Events before them are read."};
    });
  } else {
    problems.damage("lcm.resync", [&] {
      return Error{
          ErrorCode::Unreadable, fmt::format("no event begins here; {} bytes skipped", to - from), place, {}};
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
  if (bytes.empty()) return std::nullopt;  // the file was truncated while being read
  const auto channel_size = static_cast<std::size_t>(header.channel_size);
  const Event event{.offset = offset_,
                    .number = header.number,
                    .receive_us = header.receive_us,
                    .channel = as_text(bytes.subspan(kHeaderSize, channel_size)),
                    .payload = bytes.subspan(kHeaderSize + channel_size)};
  offset_ += event_size(header);
  return event;
}

}  // namespace
}  // namespace waymark::lcm

namespace waymark {
namespace {

constexpr std::int64_t kNanosecondsPerTick = 1000;

/// Receive time in nanoseconds; values outside the representable range count as 0.
std::uint64_t nanoseconds(std::int64_t microseconds) {
  constexpr std::int64_t kMaxMicroseconds = std::numeric_limits<std::int64_t>::max() / kNanosecondsPerTick;
  return microseconds < 0 || microseconds > kMaxMicroseconds
             ? 0
             : static_cast<std::uint64_t>(microseconds * kNanosecondsPerTick);
}

class LcmLog final : public MessageLog {
 public:
  LcmLog(std::unique_ptr<ByteSource> source, std::uint64_t size, const LogOptions& options)
      : source_(std::move(source)), size_(size), options_(options) {
    mbot::Survey survey;
    std::int64_t expected = 0;
    std::uint64_t last = 0;
    lcm::EventReader reader(*source_, size_, options_.max_record_bytes);
    while (const auto event = reader.next(opened_)) {
      const std::optional<std::size_t> channel = channel_of(*event);
      if (!channel) continue;
      ++*channels_[*channel].messages;
      survey.add(event->payload);
      note_gap(*event, expected);
      note_stamp(*event);
      expected = event->number == std::numeric_limits<std::int64_t>::max() ? 0 : event->number + 1;
      const std::uint64_t time = nanoseconds(event->receive_us);
      if (time < last) note_time(*event);
      last = time;
      start_ = count_ == 0 ? time : std::min(start_, time);
      end_ = std::max(end_, time);
      ++count_;
    }
    conventions_ = survey.conventions();
  }

  LogFormat format() const override { return LogFormat::Lcm; }
  std::string description() const override { return fmt::format("LCM event log, {} events", count_); }
  const std::vector<LogChannel>& channels() const override { return channels_; }
  LogSummary summary() const override {
    LogSummary summary{.messages = count_, .size_bytes = size_, .files = {source_->name()}};
    if (count_ > 0) {
      summary.start = start_;
      summary.end = end_;
    }
    return summary;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    return visit_events(selection, [&](const lcm::Event& event) {
      const std::uint64_t time = nanoseconds(event.receive_us);
      const std::optional<std::size_t> channel = channel_of(event);
      return channel ? visit(channels_[*channel], {time, time, event.payload}) : Status{};
    });
  }

  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    visited_.clear();
    mbot::Samples samples(conventions_, options_.mbot_camera_latency, visited_, visit);
    Status status = visit_events(selection, [&](const lcm::Event& event) {
      return samples.add(event.channel, event.receive_us, event.payload);
    });
    return status ? samples.finish() : status;
  }

  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& /*choice*/) override {
    RecordingSetup setup;
    setup.metadata["lcm"]["mbot_tag_latency_s"] = fmt::format("{}", to_seconds(options_.mbot_camera_latency));
    for (const LogProblem& problem : problems()) setup.problems.push_back(problem.error);
    return setup;
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  template <class Visit>
  Status visit_events(const LogSelection& selection, const Visit& visit) {
    LogProblems known;  // already noted on opening
    lcm::EventReader reader(*source_, size_, options_.max_record_bytes);
    while (const auto event = reader.next(known)) {
      if (!selection.takes(nanoseconds(event->receive_us))) continue;
      if (!selection.topics.empty() && !selection.topics.contains(std::string(event->channel))) continue;
      if (Status status = visit(*event); !status) return status;
    }
    return {};
  }

  /// Index of the channel for a name and type; empty if there are too many channels.
  std::optional<std::size_t> channel_of(const lcm::Event& event) {
    const std::uint64_t fingerprint = mbot::fingerprint_of(event.payload);
    const auto known = numbers_.find({std::string(event.channel), fingerprint});
    if (known != numbers_.end()) return known->second;
    constexpr std::size_t kMaxChannels = 4096;
    if (channels_.size() >= kMaxChannels) {
      opened_.damage("lcm.channels", [&] {
        return Error{
            ErrorCode::LimitExceeded, "too many channels; further channels are skipped", place(event), {}};
      });
      return std::nullopt;
    }
    const std::string_view type = mbot::type_name(fingerprint);
    channels_.push_back({.topic = std::string(event.channel),
                         .type = type.empty() ? fmt::format("lcm/{:016x}", fingerprint)
                                              : fmt::format("mbot_lcm_msgs/{}", type),
                         .encoding = "lcm",
                         .metadata = {{"lcm_fingerprint", fmt::format("{:016x}", fingerprint)}},
                         .messages = 0});
    return numbers_[{std::string(event.channel), fingerprint}] = channels_.size() - 1;
  }

  void note_gap(const lcm::Event& event, std::int64_t expected) {
    if (event.number <= expected || count_ == 0) return;
    const auto missing = static_cast<std::uint64_t>(event.number) - static_cast<std::uint64_t>(expected);
    opened_.add(
        LogProblem::Kind::Damage, "lcm.missing_events",
        [&] {
          return Error{ErrorCode::Unreadable,
                       fmt::format("missing events: number {} follows {}", event.number, expected - 1),
                       place(event),
                       {}};
        },
        missing);
  }
  void note_stamp(const lcm::Event& event) {
    if (mbot::utime_of(event.payload).value_or(1) > 0) return;
    opened_.trap(fmt::format("mbot.no_stamp:{}", event.channel), [&] {
      return Error{ErrorCode::Unsupported,
                   "its publisher sets utime to 0; the receive time is used",
                   {.key = std::string(event.channel)},
                   {}};
    });
  }
  void note_time(const lcm::Event& event) {
    opened_.trap("lcm.time_back", [&] {
      return Error{ErrorCode::Unreadable,
                   "the clock of the logger went backward; messages are kept in file order",
                   place(event),
                   {}};
    });
  }
  [[nodiscard]] Place place(const lcm::Event& event) const {
    return {.source = source_->name(), .byte = static_cast<std::int64_t>(event.offset)};
  }

  std::unique_ptr<ByteSource> source_;
  std::uint64_t size_;
  LogOptions options_;
  std::vector<LogChannel> channels_;
  std::map<std::pair<std::string, std::uint64_t>, std::size_t> numbers_;
  mbot::Conventions conventions_;
  std::uint64_t count_ = 0;
  std::uint64_t start_ = 0;
  std::uint64_t end_ = 0;
  LogProblems opened_;
  LogProblems visited_;
};

}  // namespace

bool looks_like_lcm(ByteSpan head, std::uint64_t size) {
  for (std::size_t i = 0; i + lcm::kHeaderSize <= head.size(); ++i) {
    if (head[i] == (lcm::kSync >> 24) && lcm::plausible_event(head.subspan(i), size - i)) return true;
  }
  return false;
}

Result<std::unique_ptr<MessageLog>> open_lcm_log(std::unique_ptr<ByteSource> source,
                                                 const LogOptions& options) {
  const Result<std::uint64_t> size = source->size();
  if (!size) return tl::unexpected(size.error());
  return std::make_unique<LcmLog>(std::move(source), *size, options);
}

}  // namespace waymark
