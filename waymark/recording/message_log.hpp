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
#include "waymark/recording/odometry_frames.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Reads recordings of any supported format through one interface (docs/formats/importing.md). The format is
/// recognised from the first bytes of a file, never from its name.
namespace waymark {

enum class LogFormat : std::uint8_t { Mcap, Rosbag2, Ros1Bag, Lcm, Csv, Merged };

/// "mcap", "rosbag2", "ros1bag", "lcm", "csv", "merged", as in JSON summaries.
[[nodiscard]] std::string_view to_string(LogFormat format);

/// Whether recordings in this format contain samples rather than messages with ROS types.
[[nodiscard]] bool gives_samples(LogFormat format);

/// One stream of messages of one type.
struct LogChannel {
  std::string topic{};
  std::string type{};      ///< in ROS 2 spelling: "nav_msgs/msg/Odometry"; in LCM: "mbot_lcm_msgs/pose2D_t"
  std::string encoding{};  ///< message encoding: "cdr", "ros1", "lcm", "csv"; otherwise as in the MCAP file
  std::string schema_encoding{};  ///< schema encoding: "ros2msg", "ros1msg"; empty if there is no schema
  std::string schema{};  ///< definition from the file, or the built-in one with that name; may be empty
  std::map<std::string, std::string> metadata{};  ///< "offered_qos_profiles", "md5sum", …
  std::optional<std::uint64_t> messages{};        ///< if stored in the file or counted on opening
};

/// One message; its bytes are valid until the callback returns.
struct LogMessage {
  std::uint64_t log_time = 0;      ///< [ns] time of recording
  std::uint64_t publish_time = 0;  ///< [ns] time of publication; log_time if the format has none
  ByteSpan data{};                 ///< in the encoding of the channel, unchanged
};

/// A problem with a file about which the user must be warned: damage, or data that are easily misread.
struct LogProblem {
  enum class Kind : std::uint8_t {
    Damage,  ///< missing or corrupt bytes; the rest is still read
    Trap,    ///< valid bytes that are easily misread; `error` explains how they were interpreted
  };
  Kind kind = Kind::Damage;
  std::string key{};        ///< stable identifier: "lcm.resync", "mbot.millimetres"
  Error error{};            ///< message, with the place of the first occurrence
  std::uint64_t count = 1;  ///< number of occurrences
};

/// The message, with its place and the number of occurrences.
[[nodiscard]] std::string to_string(const LogProblem& problem);

/// The stamp of a sample as a log time.
[[nodiscard]] inline std::uint64_t log_time_of(const Sample& sample) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, stamp_of(sample).time_since_epoch().count()));
}

/// Selects messages by topic (all topics if empty) and by log time in [from, to), in nanoseconds.
struct LogSelection {
  std::set<std::string> topics{};
  std::uint64_t from = 0;
  std::uint64_t to = std::numeric_limits<std::uint64_t>::max();
  /// Whether transforms from odom to the base are odometry samples in a recording without nav_msgs/Odometry.
  bool odometry_in_transforms = true;
  /// These transforms. `nullopt`: the first ones to base_link or base_footprint; an empty link: none.
  std::optional<OdometryFrames> odometry_frames{};

  [[nodiscard]] bool takes(const std::string& topic) const {
    return topics.empty() || topics.contains(topic);
  }
  [[nodiscard]] bool takes(std::uint64_t log_time) const { return log_time >= from && log_time < to; }
};

/// Extent of a recording, as far as it is available without reading all messages. (LCM and CSV have no index,
/// so all messages are read on opening.)
struct LogSummary {
  std::optional<std::uint64_t> start{};     ///< [ns] first log time
  std::optional<std::uint64_t> end{};       ///< [ns] last log time
  std::optional<std::uint64_t> messages{};  ///< number of all messages
  std::uint64_t size_bytes = 0;             ///< total size of the files
  std::vector<std::string> files{};         ///< more than one for a split recording
  std::string library{};                    ///< the program that wrote the recording, if given
  std::string profile{};                    ///< profile of an MCAP file: "ros2"
  std::optional<std::uint64_t> chunks{};    ///< number of chunks in an MCAP file
  bool complete = true;                     ///< false if the end of the file is missing
};

/// A file stored inside a recording.
struct LogAttachment {
  std::string name{};
  std::string media_type{};
  std::uint64_t size_bytes = 0;
};

struct LogOptions {
  /// Records, chunks and messages larger than this are rejected.
  std::uint64_t max_record_bytes = std::uint64_t{1} << 30;
  UnpackLimits unpack{};
  /// Time from the exposure of an MBot's image to the stamp of its tags, which is the publication time.
  Duration mbot_camera_latency = std::chrono::milliseconds(65);
};

/// An open recording of any format.
class MessageLog {
 public:
  using Visitor = std::function<Status(const LogChannel& channel, const LogMessage& message)>;
  using SampleVisitor = std::function<Status(const Sample& sample)>;

  virtual ~MessageLog() = default;
  MessageLog(const MessageLog&) = delete;
  MessageLog& operator=(const MessageLog&) = delete;

  [[nodiscard]] virtual LogFormat format() const = 0;
  /// Description for display: "ROS 1 bag 2.0, bz2 around the file".
  [[nodiscard]] virtual std::string description() const = 0;
  [[nodiscard]] virtual const std::vector<LogChannel>& channels() const = 0;
  [[nodiscard]] virtual LogSummary summary() const = 0;

  /// Calls visit for the selected messages in order of log time. Memory does not grow with the recording.
  /// Damaged parts are skipped and added to the problems. Fails if the visitor fails.
  virtual Status visit(const LogSelection& selection, const Visitor& visit) = 0;
  /// Visits all messages in the order in which they were written, if the file preserves it; only this order
  /// reveals a backward clock jump. Otherwise equivalent to visit().
  virtual Status visit_as_written(const Visitor& visit) { return this->visit({}, visit); }
  /// Visits the messages as samples in Waymark's conventions (docs/conventions.md); messages that are not
  /// samples are skipped. In a ROS recording without nav_msgs/Odometry, the transforms from odom to the base
  /// are odometry.
  virtual Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) = 0;
  /// The camera, its mounting on the robot, and the metadata, as far as the recording contains them. If there
  /// are several frames and topics, `choice` selects among them.
  virtual Result<RecordingSetup> setup(const CameraChoice& choice) = 0;
  Result<RecordingSetup> setup() { return setup(CameraChoice{}); }
  /// The metadata blocks in a ROS recording, by name. Part of the setup, but does not read messages.
  virtual Result<std::map<std::string, std::map<std::string, std::string>>> metadata() { return {}; }
  /// Topics to read with a setup: image topics, all other topics, or both. Empty if there are none.
  [[nodiscard]] LogSelection topics_used(const RecordingSetup& setup, std::optional<bool> images = {}) const;
  /// The files inside the recording, by name.
  [[nodiscard]] virtual std::vector<LogAttachment> attachments() const { return {}; }

  /// A file inside the recording (calibration, map), with its name, kind, time and bytes.
  struct Attachment {
    std::string name{};
    std::string media_type{};
    std::uint64_t log_time = 0;  ///< [ns]
    ByteSpan data{};
  };
  /// Visits the attachments; damaged ones are skipped and added to the problems.
  virtual Status visit_attachments(const std::function<Status(const Attachment&)>& /*visit*/) { return {}; }

  /// Problems found on opening the recording and during the last visit.
  [[nodiscard]] virtual std::vector<LogProblem> problems() const = 0;

 protected:
  MessageLog() = default;
};

/// Whether the log may contain nav_msgs/Odometry messages, or odometry in a format that contains samples.
[[nodiscard]] bool has_odometry_messages(const MessageLog& log);

/// Start of a recording [ns]: the log time of its first message. Messages with a stamp of zero, which some
/// programs write on /camera_info and /tf_static, are ignored if the others begin more than ten seconds
/// later.
[[nodiscard]] std::uint64_t recording_start_ns(MessageLog& log);

/// Opens a recording: an MCAP file, a rosbag2 .db3 file or bag folder, a ROS 1 bag, an LCM event log, or a
/// CSV table with named columns. A bag folder contains metadata.yaml and .db3 or .mcap files, split or not.
/// Each file may also be compressed as a whole with bzip2, gzip or zstd. Fails if the file does not exist or
/// has another format.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_log(const std::filesystem::path& path,
                                                           const LogOptions& options = {});
/// Opens several recordings of one drive as a single one, with samples in order of their stamps. If any of
/// them is not a ROS recording, the samples are held in memory.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_logs(const std::vector<std::string>& paths,
                                                            const LogOptions& options = {});
/// Opens a recording from a source of bytes.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_log(std::unique_ptr<ByteSource> source,
                                                           const LogOptions& options = {});

/// The recording format of a file of `size` bytes that begins with `head`. Empty for compressed files, for
/// tables (which cannot be recognised with certainty) and for any other file. A head of 64 KiB is enough.
[[nodiscard]] std::optional<LogFormat> format_of_head(ByteSpan head, std::uint64_t size);

/// Problems by key, in order of first occurrence; repetitions are counted.
class LogProblems {
 public:
  /// Calls `words()`, which returns the Error, only for the first problem with a key.
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
  /// Adds each error as a separate problem.
  void damages(std::string_view key, const std::vector<Error>& errors) {
    for (const Error& error : errors) list_.push_back({LogProblem::Kind::Damage, std::string(key), error, 1});
  }

  void clear() { list_.clear(); }
  [[nodiscard]] const std::vector<LogProblem>& list() const { return list_; }
  void append_to(std::vector<LogProblem>& out) const { out.insert(out.end(), list_.begin(), list_.end()); }

 private:
  std::vector<LogProblem> list_;
};

/// The problems found on opening, followed by those of the last visit.
[[nodiscard]] inline std::vector<LogProblem> joined(const LogProblems& opened, const LogProblems& visited) {
  std::vector<LogProblem> all = opened.list();
  visited.append_to(all);
  return all;
}

}  // namespace waymark
