#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"

/// What the stamps of a recording say about it: how regular, what is missing, when a clock jumped.
namespace waymark {

/// The stamps of one stream, in the order of their arrival.
class StampStatistics {
 public:
  void add(std::uint64_t stamp_ns);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::uint64_t zero() const { return zero_; }            ///< stamps of 0: never set
  [[nodiscard]] std::uint64_t duplicate() const { return duplicate_; }  ///< equal to the one before
  [[nodiscard]] std::uint64_t backward() const { return backward_; }    ///< before the one before
  [[nodiscard]] std::uint64_t longest_ns() const { return longest_; }   ///< longest interval
  /// Median interval [ns], within 0.2 %; nothing with fewer than two stamps.
  [[nodiscard]] std::optional<double> median_ns() const;
  /// Whether the stream is periodic: four fifths of the intervals are within a half of the median.
  [[nodiscard]] bool periodic() const;
  /// Intervals of more than 1.5 medians of a periodic stream, and how many stamps are missing in them.
  [[nodiscard]] std::uint64_t gaps() const;
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  std::uint64_t count_ = 0;
  std::uint64_t zero_ = 0;
  std::uint64_t duplicate_ = 0;
  std::uint64_t backward_ = 0;
  std::uint64_t longest_ = 0;
  std::optional<std::uint64_t> last_{};
  std::map<int, std::uint64_t> intervals_{};  ///< how many, by 512 log2(interval): memory does not grow
};

/// One topic.
struct TopicReport {
  std::string topic{};
  std::string type{};
  std::string encoding{};
  std::uint64_t messages = 0;
  double rate_hz = 0;       ///< over the duration of the topic
  bool has_header = false;  ///< the stamps below are those in the messages, else the times of recording
  StampStatistics stamps{};
  /// Stamps that moved against the times of recording by more than half a second, and times of recording that
  /// went back by as much from one message of the file to the next.
  std::uint64_t clock_jumps = 0;
  double largest_jump_s = 0;
};

struct LogReport {
  std::vector<TopicReport> topics{};  ///< by name
  std::uint64_t messages = 0;
  std::uint64_t start_ns = 0;
  double duration_s = 0;
};

/// The stamp in the header of a message, for types that begin with one (ROS 2 as CDR, ROS 1).
[[nodiscard]] std::optional<std::uint64_t> header_stamp_ns(const LogChannel& channel, ByteSpan message);

/// Reads all messages once. `progress`, when given, is called with the log time [ns] of each message, and
/// ends the report early by false. Memory does not grow with the recording.
[[nodiscard]] Result<LogReport> report_on(MessageLog& log,
                                          const std::function<bool(std::uint64_t log_time)>& progress = {});

/// What kinds of samples the first ten seconds of a recording make: "tags", "pictures", "odometry", "wheels",
/// "imu", "commands", "truth", "tag_poses", "range_bearing", "scans", "gamepad"; with `whole`, all of it, so
/// that problems() knows all there is to say. Pictures are not decoded.
using LogContents = std::set<std::string>;
[[nodiscard]] Result<LogContents> contents_of(MessageLog& log, bool whole = false);

/// The same from the index alone, where the file has one: counts and rates, no stamps. O(index).
[[nodiscard]] LogReport quick_report_on(const MessageLog& log);

}  // namespace waymark
