#include "waymark/recording/log_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "waymark/recording/ros2/messages.hpp"

namespace waymark {
namespace {

constexpr double kBucketsPerOctave = 512;
constexpr std::uint64_t kContents_ns = 10'000'000'000;  // all sensors of a robot publish within ten seconds
constexpr std::int64_t kClockJump_ns = 500'000'000;

double interval_of(int bucket) { return std::exp2((bucket + 0.5) / kBucketsPerOctave); }

/// The type of the first field in a message definition, skipping empty lines, comments and constants.
std::string_view first_type(std::string_view schema) {
  while (!schema.empty()) {
    std::string_view line = schema.substr(0, schema.find('\n'));
    schema.remove_prefix(std::min(schema.size(), line.size() + 1));
    line = line.substr(0, line.find('#'));
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos || line.find('=') != std::string_view::npos) continue;
    line.remove_prefix(begin);
    return line.substr(0, line.find_first_of(" \t\r"));
  }
  return {};
}

bool begins_with_header(const LogChannel& channel) {
  const std::string_view type = first_type(channel.schema);
  return type == "std_msgs/Header" || type == "Header" || type == "std_msgs/msg/Header";
}

using Key = std::pair<std::string_view, std::string_view>;
Key key_of(const LogChannel& channel) { return {channel.topic, channel.type}; }

/// Counters for one topic.
struct Counting {
  TopicReport report{};
  std::uint64_t first = 0, last = 0;          ///< log times
  std::uint64_t newest = 0;                   ///< log time of the previous message
  std::optional<std::int64_t> last_offset{};  ///< stamp minus log time

  void jumped(std::int64_t by_ns) {
    ++report.clock_jumps;
    const double jump_s = static_cast<double>(by_ns) * 1e-9;
    if (std::abs(jump_s) > std::abs(report.largest_jump_s)) report.largest_jump_s = jump_s;
  }
  void add(const LogChannel& channel, const LogMessage& message) {
    const auto since = static_cast<std::int64_t>(message.log_time - std::exchange(newest, message.log_time));
    const bool went_back = report.messages > 0 && since < -kClockJump_ns;
    if (went_back) jumped(since);
    first = report.messages == 0 ? message.log_time : std::min(first, message.log_time);
    last = std::max(last, message.log_time);
    ++report.messages;
    const auto stamp = report.has_header ? header_stamp_ns(channel, message.data) : std::nullopt;
    // A stamp of zero is valid if the robot's clock begins at zero; otherwise the stamp was never set.
    const bool beginning = message.log_time == 0 && stamp.value_or(0) == 0;
    if (!beginning) report.stamps.add(stamp.value_or(message.log_time));
    if (!stamp || *stamp == 0) return;
    const auto offset = static_cast<std::int64_t>(*stamp - message.log_time);
    if (!went_back && last_offset && std::abs(offset - *last_offset) > kClockJump_ns)
      jumped(offset - *last_offset);
    last_offset = offset;
  }
};

TopicReport described(const LogChannel& channel) {
  return {
      .topic = channel.topic,
      .type = channel.type,
      .encoding = channel.encoding,
      .has_header = (channel.encoding == "cdr" || channel.encoding == "ros1") && begins_with_header(channel)};
}

double rate(std::uint64_t messages, std::uint64_t first, std::uint64_t last) {
  return messages > 1 && last > first
             ? static_cast<double>(messages - 1) / (static_cast<double>(last - first) * 1e-9)
             : 0;
}

}  // namespace

void StampStatistics::add(std::uint64_t stamp_ns) {
  ++count_;
  if (stamp_ns == 0) ++zero_;
  if (stamp_ns > 0) earliest_ = earliest_ > 0 ? std::min(earliest_, stamp_ns) : stamp_ns;
  latest_ = std::max(latest_, stamp_ns);
  if (last_ && stamp_ns == *last_) ++duplicate_;
  if (last_ && stamp_ns < *last_) ++backward_;
  if (last_ && stamp_ns > *last_) {
    const std::uint64_t interval = stamp_ns - *last_;
    longest_ = std::max(longest_, interval);
    ++intervals_[static_cast<int>(std::floor(std::log2(static_cast<double>(interval)) * kBucketsPerOctave))];
  }
  last_ = stamp_ns;
}

std::optional<double> StampStatistics::median_ns() const {
  std::uint64_t all = 0;
  for (const auto& [bucket, n] : intervals_) all += n;
  std::uint64_t before = 0;
  for (const auto& [bucket, n] : intervals_) {
    before += n;
    if (2 * before >= all) return interval_of(bucket);
  }
  return std::nullopt;
}

bool StampStatistics::periodic() const {
  const auto median = median_ns();
  std::uint64_t all = 0;
  std::uint64_t near = 0;
  for (const auto& [bucket, n] : intervals_) {
    all += n;
    if (std::abs(interval_of(bucket) - *median) <= 0.5 * *median) near += n;
  }
  constexpr std::uint64_t kMinIntervals = 10;
  return all >= kMinIntervals && 5 * near >= 4 * all;
}

std::uint64_t StampStatistics::gaps() const {
  if (!periodic()) return 0;
  std::uint64_t gaps = 0;
  for (const auto& [bucket, n] : intervals_)
    if (interval_of(bucket) > 1.5 * *median_ns()) gaps += n;
  return gaps;
}

std::uint64_t StampStatistics::dropped() const {
  if (!periodic()) return 0;
  const double median = *median_ns();
  std::uint64_t dropped = 0;
  for (const auto& [bucket, n] : intervals_) {
    const double periods = interval_of(bucket) / median;
    if (periods > 1.5) dropped += n * static_cast<std::uint64_t>(std::llround(periods) - 1);
  }
  return dropped;
}

std::optional<std::uint64_t> header_stamp_ns(const LogChannel& channel, ByteSpan message) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const bool cdr = channel.encoding == "cdr";
  // In CDR, the stamp follows the encapsulation header; in ROS 1, it follows the sequence number.
  constexpr std::size_t kStampAt = 4;
  if (message.size() < kStampAt + 8 || (cdr && message[1] != 1)) return std::nullopt;
  const auto sec = from_little_endian<std::uint32_t>(message.data() + kStampAt);
  const auto nsec = from_little_endian<std::uint32_t>(message.data() + kStampAt + 4);
  return sec * kSecond + nsec;
}

/// Whether messages on this channel are static descriptions, which some programs stamp with 0.
bool is_description(const LogChannel& channel) {
  return channel.type == ros2::CameraInfo::kType || channel.topic.ends_with("tf_static");
}

Result<LogReport> report_on(MessageLog& log, const std::function<bool(std::uint64_t)>& progress) {
  std::map<Key, Counting> counting;
  for (const LogChannel& channel : log.channels()) counting[key_of(channel)].report = described(channel);
  bool stopped = false;
  const Status status =
      log.visit_as_written([&](const LogChannel& channel, const LogMessage& message) -> Status {
        counting.at(key_of(channel)).add(channel, message);
        stopped = progress && !progress(message.log_time);
        return stopped ? fail(ErrorCode::LimitExceeded, "stopped") : Status{};
      });
  if (!status && !stopped) return tl::unexpected(status.error());
  const bool has_timed_topics = std::ranges::any_of(log.channels(), [&](const LogChannel& channel) {
    return counting.at(key_of(channel)).report.messages > 0 && !is_description(channel);
  });
  LogReport report;
  std::uint64_t first = std::numeric_limits<std::uint64_t>::max();
  std::uint64_t last = 0;
  for (const LogChannel& channel : log.channels()) {
    Counting& counted = counting.at(key_of(channel));
    counted.report.rate_hz = rate(counted.report.messages, counted.first, counted.last);
    report.messages += counted.report.messages;
    if (counted.report.messages > 0 && !(has_timed_topics && is_description(channel))) {
      first = std::min(first, counted.first);
      last = std::max(last, counted.last);
    }
    report.topics.push_back(std::move(counted.report));
  }
  if (report.messages > 0) {
    report.start_ns = first;
    report.duration_s = static_cast<double>(last - first) * 1e-9;
  }
  std::ranges::stable_sort(report.topics, {}, &TopicReport::topic);
  return report;
}

namespace {

const char* kind_of(const Sample& sample) {
  constexpr std::array<const char*, 11> kNames = {"tags",          "odometry", "wheels", "imu",
                                                  "commands",      "truth",    "images", "tag_poses",
                                                  "range_bearing", "scans",    "gamepad"};
  static_assert(std::variant_size_v<Sample> == kNames.size());
  return kNames[sample.index()];
}

}  // namespace

Result<LogContents> contents_of(MessageLog& log, bool whole, ClockCheck* clocks,
                                const RecordingSetup* setup) {
  LogContents contents;
  LogSelection others;
  for (const LogChannel& channel : log.channels()) {
    const bool image = channel.type == ros2::Image::kType || channel.type == ros2::CompressedImage::kType;
    if (image) contents.insert("images");
    if (!image) others.topics.insert(channel.topic);
  }
  if (others.topics.empty()) return contents;
  // The start is unknown if the file is truncated.
  if (const auto start = log.summary().start; start && !whole) others.to = *start + kContents_ns;
  LogSelection used = others;
  if (setup != nullptr) {
    used = log.topics_used(*setup, false);
    used.to = others.to;
    others.odometry_frames = used.odometry_frames;
  }
  const auto add_clocks = [&](const Sample& sample) {
    if (clocks != nullptr) clocks->add(sample);
    return Status{};
  };
  // All topics are visited last, so that the problems are complete.
  const bool all_used = used.topics == others.topics;
  if (clocks != nullptr && !all_used && !used.topics.empty())
    if (Status status = log.visit_samples(used, add_clocks); !status) return tl::unexpected(status.error());
  const Status status = log.visit_samples(others, [&](const Sample& sample) {
    contents.insert(kind_of(sample));
    return all_used ? add_clocks(sample) : Status{};
  });
  if (!status) return tl::unexpected(status.error());
  return contents;
}

LogReport quick_report_on(const MessageLog& log) {
  const LogSummary summary = log.summary();
  LogReport report{.messages = summary.messages.value_or(0), .start_ns = summary.start.value_or(0)};
  const std::uint64_t end = summary.end.value_or(report.start_ns);
  report.duration_s = static_cast<double>(end - report.start_ns) * 1e-9;
  for (const LogChannel& channel : log.channels()) {
    TopicReport topic = described(channel);
    topic.messages = channel.messages.value_or(0);
    topic.rate_hz = rate(topic.messages, report.start_ns, end);
    report.topics.push_back(std::move(topic));
  }
  std::ranges::stable_sort(report.topics, {}, &TopicReport::topic);
  return report;
}

}  // namespace waymark
