#include "waymark/recording/rosbag2_log.hpp"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/ros2_messages.hpp"
#include "waymark/recording/ros_log.hpp"
#include "waymark/recording/sqlite_database.hpp"
#include "waymark/recording/unpack.hpp"

namespace waymark {
namespace {

/// Times in the file are signed; before 1970 there were no robots.
std::uint64_t log_time(std::int64_t timestamp) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, timestamp));
}
std::int64_t signed_time(std::uint64_t time) {
  return static_cast<std::int64_t>(std::min<std::uint64_t>(time, std::numeric_limits<std::int64_t>::max()));
}

class Rosbag2Log final : public RosLog {
 public:
  Rosbag2Log(SqliteDatabase database, std::string name, bool packed_messages, const LogOptions& options)
      : database_(std::move(database)),
        name_(std::move(name)),
        packed_messages_(packed_messages),
        options_(options) {}

  /// Reads everything but the messages. Fails when it is not a bag.
  Status load() {
    const std::set<std::string> topics = database_.columns("topics");
    const std::set<std::string> messages = database_.columns("messages");
    const bool bag = topics.contains("name") && topics.contains("type") && messages.contains("timestamp") &&
                     messages.contains("topic_id") && messages.contains("data");
    if (!bag)
      return fail(ErrorCode::Unsupported,
                  "a SQLite file, but no bag of rosbag2: the tables topics and messages are missing",
                  {.source = name_});
    if (Status status = load_schema_version(); !status) return status;
    if (Status status = load_topics(topics); !status) return status;
    load_definitions();
    return load_counts();
  }

  LogFormat format() const override { return LogFormat::Rosbag2; }
  std::string description() const override {
    return fmt::format("rosbag2, SQLite{}{}",
                       schema_version_ > 0 ? fmt::format(", schema {}", schema_version_) : "",
                       distro_.empty() ? "" : fmt::format(", ROS 2 {}", distro_));
  }
  const std::vector<LogChannel>& channels() const override { return channels_; }
  LogSummary summary() const override {
    LogSummary summary{.start = start_, .end = end_, .messages = count_, .files = {name_}};
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(name_, error);
    summary.size_bytes = error ? 0 : size;
    return summary;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    Result<SqliteDatabase::Query> rows = database_.query(
        "SELECT topic_id, timestamp, data FROM messages WHERE timestamp >= ?1 AND timestamp <= ?2 ORDER BY "
        "timestamp, id");
    if (!rows) return tl::unexpected(rows.error());
    if (selection.to == 0) return {};
    const std::int64_t from =
        selection.from == 0 ? std::numeric_limits<std::int64_t>::min() : signed_time(selection.from);
    rows->bind(1, from).bind(2, selection.to > INT64_MAX ? INT64_MAX : signed_time(selection.to - 1));
    while (true) {
      const Result<bool> row = rows->next();
      if (!row) {
        visited_.damage("rosbag2.damage", [&] {
          Error error = row.error();
          error.hint = "The messages before the damage are read; `sqlite3 FILE .recover` may save more.";
          return error;
        });
        return {};
      }
      if (!*row) return {};
      const auto channel = channel_of_.find(rows->integer(0));
      if (channel == channel_of_.end()) {
        visited_.damage("rosbag2.no_topic", [&] {
          return Error{ErrorCode::Unreadable,
                       fmt::format("a message of topic {}, which is not listed", rows->integer(0)),
                       {.source = name_},
                       {}};
        });
        continue;
      }
      const LogChannel& known = channels_[channel->second];
      if (!selection.takes(known.topic)) continue;
      const std::uint64_t time = log_time(rows->integer(1));
      const std::optional<ByteSpan> data = unpacked(rows->bytes(2), known);
      if (!data) continue;
      if (Status status = visit(known, {time, time, *data}); !status) return status;
    }
  }

  std::vector<LogProblem> problems() const override { return joined(opened_, visited_); }

 private:
  Status load_schema_version() {
    if (!database_.columns("schema").contains("schema_version")) return {};  // Galactic and older have none
    Result<SqliteDatabase::Query> row = database_.query("SELECT schema_version, ros_distro FROM schema");
    if (!row || !row->next().value_or(false)) return {};
    schema_version_ = row->integer(0);
    distro_ = row->text(1);
    return {};
  }

  /// Columns came one after another over the years: what is not there is left out.
  Status load_topics(const std::set<std::string>& columns) {
    const auto column = [&](const char* name) { return columns.contains(name) ? name : "''"; };
    Result<SqliteDatabase::Query> rows = database_.query(fmt::format(
        "SELECT id, name, type, {}, {}, {} FROM topics ORDER BY id", column("serialization_format"),
        column("offered_qos_profiles"), column("type_description_hash")));
    if (!rows) return tl::unexpected(rows.error());
    while (true) {
      const Result<bool> row = rows->next();
      if (!row) return tl::unexpected(row.error());
      if (!*row) return {};
      LogChannel channel{
          .topic = rows->text(1), .type = rows->text(2), .encoding = rows->text(3), .messages = 0};
      if (channel.encoding.empty()) channel.encoding = "cdr";
      if (const std::string qos = rows->text(4); !qos.empty()) channel.metadata["offered_qos_profiles"] = qos;
      if (const std::string hash = rows->text(5); !hash.empty()) channel.metadata["topic_type_hash"] = hash;
      channel.schema = ros2::schema_text(channel.type);
      if (!channel.schema.empty()) channel.schema_encoding = "ros2msg";
      channel_of_[rows->integer(0)] = channels_.size();
      channels_.push_back(std::move(channel));
    }
  }

  /// From Iron on the file carries them; before, ours of the same name serve.
  void load_definitions() {
    const std::set<std::string> columns = database_.columns("message_definitions");
    if (columns.contains("topic_type") && columns.contains("encoded_message_definition")) {
      Result<SqliteDatabase::Query> rows =
          database_.query("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions");
      while (rows && rows->next().value_or(false)) {
        const std::string text = rows->text(2);
        for (LogChannel& channel : channels_) {
          if (channel.type != rows->text(0) || text.empty()) continue;
          channel.schema = text;
          channel.schema_encoding = rows->text(1);
        }
      }
    }
    for (const LogChannel& channel : channels_) {
      if (!channel.schema.empty()) continue;
      opened_.trap("rosbag2.no_definition:" + channel.type, [&] {
        return Error{
            ErrorCode::Unsupported,
            fmt::format("neither the bag nor we have the definition of {}: passed on without", channel.type),
            {.source = name_, .key = channel.topic},
            {}};
      });
    }
  }

  Status load_counts() {
    Result<SqliteDatabase::Query> rows = database_.query(
        "SELECT topic_id, count(*), min(timestamp), max(timestamp) FROM messages GROUP BY topic_id");
    while (rows) {
      const Result<bool> row = rows->next();
      if (!row) {
        opened_.damages("rosbag2.damage", {row.error()});
        load_times();
        break;
      }
      if (!*row) break;
      const auto messages = static_cast<std::uint64_t>(rows->integer(1));
      if (const auto channel = channel_of_.find(rows->integer(0)); channel != channel_of_.end())
        channels_[channel->second].messages = messages;
      count_ += messages;
      start_ = std::min(start_.value_or(log_time(rows->integer(2))), log_time(rows->integer(2)));
      end_ = std::max(end_.value_or(0), log_time(rows->integer(3)));
    }
    return {};
  }

  /// Of a damaged file: the index of the times may be whole where the messages are not; else any time.
  void load_times() {
    const auto one = [&](const char* sql, std::uint64_t otherwise) {
      const Result<SqliteDatabase::Query> query = database_.query(sql);
      if (!query) return otherwise;
      SqliteDatabase::Query row = *query;
      return row.next().value_or(false) ? log_time(row.integer(0)) : otherwise;
    };
    start_ = one("SELECT min(timestamp) FROM messages", 0);
    end_ = one("SELECT max(timestamp) FROM messages", INT64_MAX);
  }

  std::optional<ByteSpan> unpacked(ByteSpan data, const LogChannel& channel) {
    if (!packed_messages_) return data;
    UnpackedBytes result = unpack_bytes(Packing::Zstd, data, options_.max_record_bytes);
    if (result.damage) {
      visited_.damage("rosbag2.packing", [&] {
        Error error = *result.damage;
        error.place = {.source = name_, .key = channel.topic};
        return error;
      });
      return std::nullopt;
    }
    unpacked_ = std::move(result.bytes);
    return unpacked_;
  }

  SqliteDatabase database_;
  std::string name_;
  bool packed_messages_;
  LogOptions options_;
  std::vector<LogChannel> channels_;
  std::map<std::int64_t, std::size_t> channel_of_;
  std::int64_t schema_version_ = 0;
  std::string distro_;
  std::uint64_t count_ = 0;
  std::optional<std::uint64_t> start_;
  std::optional<std::uint64_t> end_;
  Bytes unpacked_;
  LogProblems opened_;
};

}  // namespace

namespace {

Result<std::unique_ptr<MessageLog>> open_database(Result<SqliteDatabase> database, const std::string& name,
                                                  bool packed_messages, const LogOptions& options) {
  if (!database) return tl::unexpected(database.error());
  auto log = std::make_unique<Rosbag2Log>(std::move(*database), name, packed_messages, options);
  if (Status status = log->load(); !status) return tl::unexpected(status.error());
  return log;
}

}  // namespace

Result<std::unique_ptr<MessageLog>> open_rosbag2_bytes(const std::shared_ptr<const TemporaryFile>& file,
                                                       const std::string& name, const LogOptions& options) {
  return open_database(SqliteDatabase::open(file, name, options.max_record_bytes), name, false, options);
}

Result<std::unique_ptr<MessageLog>> open_rosbag2_file(const std::filesystem::path& path,
                                                      const std::string& name, bool packed_messages,
                                                      const LogOptions& options) {
  return open_database(SqliteDatabase::open(path, name, options.max_record_bytes), name, packed_messages,
                       options);
}

}  // namespace waymark
