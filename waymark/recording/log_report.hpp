#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "waymark/recording/message_log.hpp"
#include "waymark/samples/clock_check.hpp"

/// Reports the timing of a recording from its stamps: regularity, missing messages, clock jumps.
namespace waymark {

/// Statistics of the stamps of one stream, in order of arrival.
class StampStatistics {
 public:
  void add(std::uint64_t stamp_ns);

  [[nodiscard]] std::uint64_t count() const { return count_; }
  [[nodiscard]] std::uint64_t zero() const { return zero_; }            ///< stamps of 0, which were never set
  [[nodiscard]] std::uint64_t duplicate() const { return duplicate_; }  ///< equal to the previous one
  [[nodiscard]] std::uint64_t backward() const { return backward_; }    ///< earlier than the previous one
  [[nodiscard]] std::uint64_t longest_ns() const { return longest_; }   ///< longest interval
  /// The earliest and the latest stamp other than 0; 0 if there is none.
  [[nodiscard]] std::uint64_t earliest_ns() const { return earliest_; }
  [[nodiscard]] std::uint64_t latest_ns() const { return latest_; }
  /// Median interval in nanoseconds, to within 0.2 %; empty with fewer than two stamps.
  [[nodiscard]] std::optional<double> median_ns() const;
  /// Whether the stream is periodic: four fifths of the intervals are within 50 % of the median.
  [[nodiscard]] bool periodic() const;
  /// gaps() is the number of intervals in a periodic stream that exceed 1.5 medians, and dropped() the number
  /// of stamps missing in them.
  [[nodiscard]] std::uint64_t gaps() const;
  [[nodiscard]] std::uint64_t dropped() const;

 private:
  std::uint64_t count_ = 0;
  std::uint64_t zero_ = 0;
  std::uint64_t duplicate_ = 0;
  std::uint64_t backward_ = 0;
  std::uint64_t longest_ = 0;
  std::uint64_t earliest_ = 0;
  std::uint64_t latest_ = 0;
  std::optional<std::uint64_t> last_{};
  std::map<int, std::uint64_t> intervals_{};  ///< counts by 512 log2(interval), so that memory is bounded
};

/// Timing of one topic.
struct TopicReport {
  std::string topic{};
  std::string type{};
  std::string encoding{};
  std::uint64_t messages = 0;
  double rate_hz = 0;       ///< over the duration of the topic
  bool has_header = false;  ///< stamps are from message headers, otherwise log times
  StampStatistics stamps{};
  /// Number of clock jumps. A jump is a shift of the stamps relative to the log times by more than half a
  /// second. A decrease of the log time by as much between consecutive messages is also a jump.
  std::uint64_t clock_jumps = 0;
  double largest_jump_s = 0;
};

struct LogReport {
  std::vector<TopicReport> topics{};  ///< ordered by name
  std::uint64_t messages = 0;
  std::uint64_t start_ns = 0;
  double duration_s = 0;
};

/// The stamp in a message's header, for types that begin with a header (ROS 2 as CDR, ROS 1).
[[nodiscard]] std::optional<std::uint64_t> header_stamp_ns(const LogChannel& channel, ByteSpan message);

/// Reads all messages once. `progress`, if given, is called with the log time [ns] of each message; returning
/// false ends the report early. Memory does not grow with the recording.
[[nodiscard]] Result<LogReport> report_on(MessageLog& log,
                                          const std::function<bool(std::uint64_t log_time)>& progress = {});

/// Kinds of samples in the first ten seconds of a recording: "tags", "images", "odometry", "wheels", "imu",
/// "commands", "truth", "tag_poses", "range_bearing", "scans", "gamepad". If `whole`, reads the whole
/// recording, so that problems() is complete. Images are not decoded. Adds the stamps of all other samples to
/// `clocks`, if given; with a setup, only on the topics that are used with it.
using LogContents = std::set<std::string>;
[[nodiscard]] Result<LogContents> contents_of(MessageLog& log, bool whole = false,
                                              ClockCheck* clocks = nullptr,
                                              const RecordingSetup* setup = nullptr);

/// Reports counts and rates from the index alone if the file has one, without reading stamps. O(index).
[[nodiscard]] LogReport quick_report_on(const MessageLog& log);

}  // namespace waymark
