#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/samples/robot_samples.hpp"

/// `waymark play`: prints the samples in a recording as text or JSON, one per line.
namespace waymark {

/// "odometry", "tags", …, as in LogContents.
[[nodiscard]] const char* kind_of(const Sample& sample);

/// A line such as "  12.340  odometry   x 1.200 m, y …". The time is in seconds since `start`.
[[nodiscard]] std::string to_text(const Sample& sample, SensorTime start);

/// `kind`, `stamp_ns` and the values for that kind of sample. Only the size is included for images. In JSON,
/// non-finite numbers are null.
[[nodiscard]] ReportFields fields(const Sample& sample);

/// A message in the recording, without its data.
struct PlayedMessage {
  std::string topic{};
  std::string type{};
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  std::size_t size_bytes = 0;
};
[[nodiscard]] ReportFields fields(const PlayedMessage& message);

/// A part of a recording.
struct LogPart {
  std::vector<std::string> topics{};  ///< if empty, all topics
  double from_s = 0;                  ///< seconds after the first message
  double to_s = std::numeric_limits<double>::infinity();

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.topics,
          JobField("topics TOPIC,…", "Only these topics, comma-separated. Default: all").comma_separated());
    visit(self.from_s,
          JobField("from SECONDS", "Start this many seconds after the first message").usually("0"));
    visit(self.to_s,
          JobField("to SECONDS",
                   "Stop this many seconds after the first message. Default: at the end of the file")
              .without_default());
  }
};
/// Fails if a topic is unknown (the hint contains the most similar one), if the interval is invalid, or if
/// the recording ends before the interval.
[[nodiscard]] Result<LogSelection> select_part(MessageLog& log, const LogPart& part);

struct PlayOptions {
  double speed = 1;       ///< playback rate; 0 means without waiting
  bool messages = false;  ///< whether to print messages as recorded instead of samples
  bool json = false;      ///< whether to print one JSON object per line instead of text
};

/// User options for playing a recording.
struct PlayRequest {
  std::string file{};
  LogPart part{};
  PlayOptions options{};
  bool ros2 = false;      ///< whether to publish on ROS 2 instead of printing
  bool commands = false;  ///< if `ros2`, whether to publish velocity commands as well

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    LogPart::fields(self.part, visit);
    visit(self.file,
          JobField("file FILE", "Recording: MCAP, rosbag2, ROS 1 bag, LCM event log or CSV, also compressed")
              .input()
              .required());
    visit(self.options.speed,
          JobField("speed NUMBER",
                   "Playback rate: 1 is as recorded, 2 is twice as fast, 0 is without waiting"));
    visit(self.options.messages,
          JobField("messages", "Print all messages of the recording (topic, type, size) instead of samples"));
    visit(self.ros2,
          JobField("ros2", "Publish the messages on ROS 2 instead of printing them (uses ROS_DOMAIN_ID)"));
    visit(self.commands,
          JobField("commands",
                   "With `ros2`: also publish recorded velocity commands, which move a subscribed robot"));
    visit(self.options.json, JobField("json", "Print one JSON object per line instead of text"));
  }
};

/// Fails if the playback rate is invalid, or if an option has no effect.
[[nodiscard]] Status check_effects(const PlayRequest& request, const GivenFields& given);

/// Passes one line per selected sample or message to `on_line` when it is due. Fails with LimitExceeded if
/// `on_line` returns false or `cancelled` returns true. `cancelled` is also called while waiting.
[[nodiscard]] Status play_log(MessageLog& log, const LogSelection& selection, const PlayOptions& options,
                              const std::function<bool(const std::string&)>& on_line,
                              const std::function<bool()>& cancelled);

/// Like play_log(), but passes on the messages themselves. An error from `on_message` ends playback.
[[nodiscard]] Status play_messages(MessageLog& log, const LogSelection& selection, double speed,
                                   const MessageLog::Visitor& on_message,
                                   const std::function<bool()>& cancelled);

}  // namespace waymark
