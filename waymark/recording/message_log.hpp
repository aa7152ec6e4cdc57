#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/recording/byte_file.hpp"
#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/compression.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/robot_samples.hpp"

/// One door to every recording we can read, whoever wrote it (docs/formats/importing.md). What is read is
/// told by the first bytes of a file, never by its name.
namespace waymark {

enum class LogFormat : std::uint8_t { Mcap, Rosbag2, Ros1Bag, Lcm, Csv, Merged };

/// "mcap", "rosbag2", "ros1bag", "lcm", "csv", "merged", as in JSON summaries.
[[nodiscard]] std::string_view to_string(LogFormat format);

/// Whether recordings of this format give samples of the robot rather than messages with types of ROS.
[[nodiscard]] bool gives_samples(LogFormat format);

/// One stream of messages of one type.
struct LogChannel {
  std::string topic{};
  std::string type{};      ///< as ROS 2 writes it: "nav_msgs/msg/Odometry"; "mbot_lcm_msgs/pose2D_t" in LCM
  std::string encoding{};  ///< of the messages: "cdr", "ros1", "lcm", "csv"; other words as an MCAP file says
  std::string schema_encoding{};  ///< of the schema: "ros2msg", "ros1msg"; empty when there is none
  std::string schema{};           ///< the definition the file carries, or ours of the same name; may be empty
  std::map<std::string, std::string> metadata{};  ///< "offered_qos_profiles", "md5sum", …
  std::optional<std::uint64_t> messages{};        ///< how many, when the file says so or opening had to count
};

/// One message; the bytes are gone after the callback returns.
struct LogMessage {
  std::uint64_t log_time = 0;      ///< [ns] when it was recorded
  std::uint64_t publish_time = 0;  ///< [ns] when it was published; log_time where the format does not know
  ByteSpan data{};                 ///< in the encoding of its channel, as it lies in the file
};

/// Something about a file that a user must know: it is damaged, or it says things that mislead.
struct LogProblem {
  enum class Kind : std::uint8_t {
    Damage,  ///< bytes that are missing or wrong; what could be read is read
    Trap,    ///< sound bytes that do not mean what they seem to; `error` says how they were taken
  };
  Kind kind = Kind::Damage;
  std::string key{};        ///< a stable word: "lcm.resync", "mbot.millimetres"
  Error error{};            ///< in words, with the place of the first one
  std::uint64_t count = 1;  ///< how often
};

/// With its place, and how often.
[[nodiscard]] std::string to_string(const LogProblem& problem);

/// The stamp of a sample as a log time.
[[nodiscard]] inline std::uint64_t log_time_of(const Sample& sample) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, stamp_of(sample).time_since_epoch().count()));
}

/// Which messages: all topics when empty; log times in [from, to) nanoseconds.
struct LogSelection {
  std::set<std::string> topics{};
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();

  [[nodiscard]] bool takes(const std::string& topic) const {
    return topics.empty() || topics.contains(topic);
  }
  [[nodiscard]] bool takes(std::uint64_t log_time) const { return log_time >= from && log_time < to; }
};

/// When, as far as known without reading all messages (LCM and CSV have no index: opening reads them).
struct LogSummary {
  std::optional<std::uint64_t> start{};     ///< [ns] first log time
  std::optional<std::uint64_t> end{};       ///< [ns] last log time
  std::optional<std::uint64_t> messages{};  ///< in all
  std::uint64_t size_bytes = 0;             ///< of the files
  std::vector<std::string> files{};         ///< more than one: a split recording
  std::string library{};                    ///< who wrote it, as far as it says
  std::string profile{};                    ///< of an MCAP file: "ros2"
  std::optional<std::uint64_t> chunks{};    ///< of an MCAP file
  bool complete = true;                     ///< false: it does not end as a finished recording does
};

/// A file inside a recording.
struct LogAttachment {
  std::string name{};
  std::string media_type{};
  std::uint64_t size_bytes = 0;
};

struct LogOptions {
  /// Refuse a record, chunk or message larger than this.
  std::uint64_t max_record_bytes = std::uint64_t{1} << 30;
  UnpackLimits unpack{};
  /// How long before its stamp an MBot's picture was taken: its tags are stamped when they are published.
  Duration mbot_camera_latency = std::chrono::milliseconds(65);
};

/// A recording of any format, open for reading.
class MessageLog {
 public:
  using Visitor = std::function<Status(const LogChannel& channel, const LogMessage& message)>;
  using SampleVisitor = std::function<Status(const Sample& sample)>;

  virtual ~MessageLog() = default;
  MessageLog(const MessageLog&) = delete;
  MessageLog& operator=(const MessageLog&) = delete;

  [[nodiscard]] virtual LogFormat format() const = 0;
  /// For people: "ROS 1 bag 2.0, bz2 around the file".
  [[nodiscard]] virtual std::string description() const = 0;
  [[nodiscard]] virtual const std::vector<LogChannel>& channels() const = 0;
  [[nodiscard]] virtual LogSummary summary() const = 0;

  /// Calls visit for the selected messages in order of log time. Memory does not grow with the recording.
  /// Damage is passed over and noted among the problems; fails when the visitor does.
  virtual Status visit(const LogSelection& selection, const Visitor& visit) = 0;
  /// All messages in the order in which they were written, where the file keeps that: a clock that jumped
  /// back shows only there. Elsewhere as visit().
  virtual Status visit_as_written(const Visitor& visit) { return this->visit({}, visit); }
  /// The same as samples, with the conventions of the house (docs/conventions.md); messages that are not
  /// samples are passed over.
  virtual Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) = 0;
  /// The camera, its place on the robot, and the metadata, as far as the recording knows them; `choice` names
  /// frames and topics where it holds several.
  virtual Result<RecordingSetup> setup(const CameraChoice& choice) = 0;
  Result<RecordingSetup> setup() { return setup(CameraChoice{}); }
  /// The topics that are to be read with a setup: of pictures, of all else, or all. Empty where there are
  /// none.
  [[nodiscard]] LogSelection topics_used(const RecordingSetup& setup,
                                         std::optional<bool> pictures = {}) const;
  /// The files inside the recording, by name.
  [[nodiscard]] virtual std::vector<LogAttachment> attachments() const { return {}; }

  /// Files that travel inside the recording (calibration, map): name, kind, time and bytes.
  struct Attachment {
    std::string name{};
    std::string media_type{};
    std::uint64_t log_time = 0;  ///< [ns]
    ByteSpan data{};
  };
  /// One that is damaged is passed over and noted among the problems.
  virtual Status visit_attachments(const std::function<Status(const Attachment&)>& /*visit*/) { return {}; }

  /// What was noticed when it was opened and during the last visit.
  [[nodiscard]] virtual std::vector<LogProblem> problems() const = 0;

 protected:
  MessageLog() = default;
};

/// When a recording begins [ns]: the log time of its first message, but not of those that nobody stamped
/// (zero, as some programs write /camera_info and /tf_static) where the others come more than ten seconds
/// later.
[[nodiscard]] std::uint64_t recording_start_ns(MessageLog& log);

/// Opens a recording: an MCAP file, a rosbag2 .db3 file or bag folder (with its metadata.yaml, .db3 or .mcap,
/// split or not), a ROS 1 bag, an LCM event log, a CSV table with named columns; any of the files also packed
/// as a whole with bzip2, gzip or zstd. Fails when there is no such file or it is none of these.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_log(const std::filesystem::path& path,
                                                           const LogOptions& options = {});
/// Several of one drive as one, samples in the order of their stamps, which are held in memory where a file
/// is no recording of ROS.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_logs(const std::vector<std::string>& paths,
                                                            const LogOptions& options = {});
/// The same of bytes from anywhere.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_log(std::unique_ptr<ByteSource> source,
                                                           const LogOptions& options = {});

/// The format of recordings whose files begin with `head` and have `size` bytes. Nothing for a table, which
/// could be anything, for a packed file, and for any other file. 64 KiB of a head are enough.
[[nodiscard]] std::optional<LogFormat> format_of_head(ByteSpan head, std::uint64_t size);

/// Problems by their key, in the order they were first seen; what happens often is counted, not repeated.
class LogProblems {
 public:
  /// The words are made only for the first of a kind: `words()` gives the Error.
  template <class Words>
  void add(LogProblem::Kind kind, std::string_view key, Words&& words, std::uint64_t count = 1) {
    const auto known = std::ranges::find(list_, key, &LogProblem::key);
    if (known != list_.end()) {
      known->count += count;
    } else {
      list_.push_back({kind, std::string(key), std::forward<Words>(words)(), count});
    }
  }
  template <class Words>
  void damage(std::string_view key, Words&& words) {
    add(LogProblem::Kind::Damage, key, std::forward<Words>(words));
  }
  template <class Words>
  void trap(std::string_view key, Words&& words, std::uint64_t count = 1) {
    add(LogProblem::Kind::Trap, key, std::forward<Words>(words), count);
  }
  /// Each with its own words.
  void damages(std::string_view key, const std::vector<Error>& errors) {
    for (const Error& error : errors) list_.push_back({LogProblem::Kind::Damage, std::string(key), error, 1});
  }

  void clear() { list_.clear(); }
  [[nodiscard]] const std::vector<LogProblem>& list() const { return list_; }
  void append_to(std::vector<LogProblem>& out) const { out.insert(out.end(), list_.begin(), list_.end()); }

 private:
  std::vector<LogProblem> list_;
};

/// What was found when a log was opened, then what the last visit found.
[[nodiscard]] inline std::vector<LogProblem> joined(const LogProblems& opened, const LogProblems& visited) {
  std::vector<LogProblem> all = opened.list();
  visited.append_to(all);
  return all;
}

}  // namespace waymark
