#include "waymark/app/convert/play_log.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "waymark/app/common/json_line.hpp"
#include "waymark/app/convert/sample_words.hpp"
#include "waymark/base/suggest.hpp"

namespace waymark {
namespace {

/// Waits until what is `time` in the recording is due.
class PlaybackPace {
 public:
  PlaybackPace(double speed, const std::function<bool()>& cancelled) : speed_(speed), cancelled_(cancelled) {}

  /// False when the waiting was cancelled.
  bool wait_for(std::int64_t time_ns) {
    using std::chrono::steady_clock;
    if (!first_ns_) first_ns_ = time_ns;
    if (speed_ <= 0) return !cancelled_();
    const double since_s =
        static_cast<double>(std::max<std::int64_t>(0, time_ns - *first_ns_)) * 1e-9 / speed_;
    const auto due = begin_ + std::chrono::duration_cast<steady_clock::duration>(
                                  std::chrono::duration<double>(std::min(since_s, kLongest_s)));
    // In slices, so that it can be cancelled.
    while (!cancelled_() && steady_clock::now() < due)
      std::this_thread::sleep_for(std::min<steady_clock::duration>(due - steady_clock::now(), kSlice));
    return !cancelled_();
  }

 private:
  static constexpr double kLongest_s = 1e8;
  static constexpr std::chrono::milliseconds kSlice{50};

  double speed_;
  const std::function<bool()>& cancelled_;
  std::optional<std::int64_t> first_ns_{};
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// How a visit is ended from inside.
tl::unexpected<Error> enough() { return fail(ErrorCode::LimitExceeded, "stopped"); }

std::string message_line(const LogChannel& channel, const LogMessage& message, std::uint64_t start,
                         bool json) {
  if (json)
    return json_line({{"topic", channel.topic},
                      {"type", channel.type},
                      {"log_time_ns", message.log_time},
                      {"publish_time_ns", message.publish_time},
                      {"size_bytes", message.data.size()}});
  const double since_s = static_cast<double>(static_cast<std::int64_t>(message.log_time - start)) * 1e-9;
  return fmt::format("{:>10.3f}  {:<24}  {}, {} bytes\n", since_s, channel.topic, channel.type,
                     message.data.size());
}

}  // namespace

Status play_messages(MessageLog& log, const LogSelection& selection, double speed,
                     const MessageLog::Visitor& on_message, const std::function<bool()>& cancelled) {
  PlaybackPace pace(speed, cancelled);
  const std::uint64_t start = recording_start_ns(log);
  return log.visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (!pace.wait_for(static_cast<std::int64_t>(std::max(start, message.log_time)))) return enough();
    return on_message(channel, message);
  });
}

Result<LogSelection> select_part(MessageLog& log, const LogPart& part) {
  LogSelection selection;
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : part.topics) {
    if (std::ranges::find(known, topic) == known.end())
      return fail(ErrorCode::NotFound, fmt::format("the recording has no topic '{}'", topic),
                  {.key = "--topics"}, suggestion(topic, known));
    selection.topics.insert(topic);
  }
  if (!(part.from_s >= 0 && part.to_s > part.from_s))
    return fail(ErrorCode::InvalidArgument,
                fmt::format("from {} s to {} s is no time", part.from_s, part.to_s), {.key = "--from"},
                "Give seconds from the first message, for example --from 10 --to 20.");
  const std::uint64_t start = recording_start_ns(log);
  if (const LogSummary& all = log.summary(); all.complete && all.end) {
    const double long_s = static_cast<double>(static_cast<std::int64_t>(*all.end - start)) * 1e-9;
    if (part.from_s > std::max(0.0, long_s))
      return fail(ErrorCode::InvalidArgument,
                  fmt::format("the recording ends {:.3f} s after its first message", long_s),
                  {.key = "--from"}, "Give a smaller number of seconds.");
  }
  constexpr double kMost_s = 1e9;  // 30 years
  if (part.from_s > 0)
    selection.from = start + static_cast<std::uint64_t>(std::min(part.from_s, kMost_s) * 1e9);
  if (part.to_s < kMost_s) selection.to = start + static_cast<std::uint64_t>(part.to_s * 1e9);
  return selection;
}

Status play_log(MessageLog& log, const LogSelection& selection, const PlayOptions& options,
                const std::function<bool(const std::string&)>& on_line,
                const std::function<bool()>& cancelled) {
  if (options.messages) {
    const auto on_message = [&, start = recording_start_ns(log)](const LogChannel& channel,
                                                                 const LogMessage& message) -> Status {
      return on_line(message_line(channel, message, start, options.json)) ? Status() : enough();
    };
    return play_messages(log, selection, options.speed, on_message, cancelled);
  }
  PlaybackPace pace(options.speed, cancelled);
  std::optional<SensorTime> start;
  return log.visit_samples(selection, [&](const Sample& sample) -> Status {
    if (!start) start = stamp_of(sample);
    if (!pace.wait_for(stamp_of(sample).time_since_epoch().count())) return enough();
    return on_line(options.json ? json_line(to_json(sample)) : to_text(sample, *start)) ? Status() : enough();
  });
}

Status check_effects(const PlayWords& words, const GivenFlags& given) {
  if (!(words.options.speed >= 0 && words.options.speed <= 1e6))
    return fail(ErrorCode::InvalidArgument, fmt::format("{} is no speed", words.options.speed),
                {.key = "--speed"}, "1 is as it was, 0 as fast as possible.");
  FlagRefusals refused(given);
  refused.flags(words.ros2, {"--messages", "--json"}, "nothing is printed with --ros2", "Leave it out.");
  refused.flags(!words.ros2, {"--commands"}, "nothing is published without --ros2",
                "Add --ros2, or leave it out.");
  return refused.status();
}

}  // namespace waymark
