#include "waymark/recording/ros2/rosbag2_writer.hpp"

#include <map>
#include <memory>
#include <set>

#include <fmt/format.h>
#include <sqlite3.h>

namespace waymark {
namespace {

/// A YAML scalar in double quotes.
std::string in_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
    } else if (c == '"' || c == '\\') {
      out += fmt::format("\\{}", c);
    } else {
      out += c;
    }
  }
  return out + "\"";
}

std::string value_of(const LogChannel& channel, const char* key) {
  const auto found = channel.metadata.find(key);
  return found == channel.metadata.end() ? std::string() : found->second;
}

std::string topic_text(const BagFormat& format, const LogChannel& channel) {
  const std::vector<OfferedQos> offered = parse_offered_qos(value_of(channel, "offered_qos_profiles"));
  const bool jazzy = format.release == BagRelease::Jazzy;
  std::string text = fmt::format(
      "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n",
      channel.topic, channel.type);
  if (!jazzy || offered.empty()) {
    const std::string profiles = offered.empty() ? std::string() : to_yaml(offered, format.qos());
    text += fmt::format("        offered_qos_profiles: {}\n", jazzy ? "[]" : in_quotes(profiles));
  } else {
    text += "        offered_qos_profiles:\n" + to_yaml(offered, format.qos(), 10);
  }
  if (jazzy)
    text +=
        fmt::format("        type_description_hash: {}\n", in_quotes(value_of(channel, "topic_type_hash")));
  return text + fmt::format("      message_count: {}\n", channel.messages.value_or(0));
}

}  // namespace

std::string bag_metadata(const BagFormat& format, const BagContents& contents) {
  std::uint64_t messages = 0;
  for (const LogChannel& channel : contents.channels) messages += channel.messages.value_or(0);
  const std::uint64_t duration = contents.end_ns - contents.start_ns;
  std::string text = fmt::format(
      "rosbag2_bagfile_information:\n  version: {}\n  storage_identifier: {}\n  duration:\n    nanoseconds: "
      "{}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {}\n  message_count: {}\n",
      format.metadata_version(), format.storage_name(), duration, contents.start_ns, messages);
  text += contents.channels.empty() ? "  topics_with_message_count: []\n" : "  topics_with_message_count:\n";
  for (const LogChannel& channel : contents.channels) text += topic_text(format, channel);
  text += fmt::format(
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {0}\n  files:\n"
      "    - path: {0}\n      starting_time:\n        nanoseconds_since_epoch: {1}\n      duration:\n"
      "        nanoseconds: {2}\n      message_count: {3}\n",
      contents.file, contents.start_ns, duration, messages);
  if (format.release == BagRelease::Jazzy)
    text += fmt::format("  custom_data: ~\n  ros_distro: {}\n", format.distro());
  return text;
}

namespace {

constexpr const char* kTables =
    "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);"
    "CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT "
    "NULL);"
    "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
    " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL{});"
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
    " data BLOB NOT NULL);"
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    "INSERT INTO schema(schema_version, ros_distro) VALUES ({}, '{}');";
constexpr const char* kBagDefinitions =
    "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT "
    "NULL,"
    " encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);";

/// A statement whose parameters are bound in order.
class Statement {
 public:
  Statement(sqlite3* database, const std::string& sql) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(database, sql.c_str(), -1, &raw, nullptr) == SQLITE_OK)
      statement_ = {raw, sqlite3_finalize};
  }
  Statement& integer(std::int64_t value) {
    sqlite3_bind_int64(statement_.get(), ++bound_, value);
    return *this;
  }
  Statement& text(std::string_view value) {
    // An empty string needs a non-null pointer: a null pointer would store NULL.
    const char* data = value.empty() ? "" : value.data();
    sqlite3_bind_text64(statement_.get(), ++bound_, data, value.size(), nullptr, SQLITE_UTF8);
    return *this;
  }
  Statement& blob(ByteSpan value) {
    const void* data = value.empty() ? "" : static_cast<const void*>(value.data());
    sqlite3_bind_blob64(statement_.get(), ++bound_, data, value.size(), nullptr);
    return *this;
  }
  /// Runs the statement. Bound data must be valid until then.
  bool run() {
    const bool done = statement_ && sqlite3_step(statement_.get()) == SQLITE_DONE;
    sqlite3_reset(statement_.get());
    bound_ = 0;
    return done;
  }

 private:
  std::shared_ptr<sqlite3_stmt> statement_;
  int bound_ = 0;
};

class SqliteBag {
 public:
  SqliteBag(const std::filesystem::path& path, const BagFormat& format) : path_(path), format_(format) {
    sqlite3* raw = nullptr;
    const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
    opened_ = sqlite3_open_v2(path.c_str(), &raw, flags, nullptr) == SQLITE_OK;
    database_ = {raw, sqlite3_close};
  }

  Status create(const BagContents& contents) {
    const bool jazzy = format_.release == BagRelease::Jazzy;
    // The bag is renamed only when complete, so a journal would be useless and would double the writes.
    const std::string tables =
        "PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; BEGIN;" +
        fmt::format(fmt::runtime(kTables), jazzy ? ", type_description_hash TEXT NOT NULL" : "",
                    format_.sqlite_schema(), format_.distro()) +
        (jazzy ? kBagDefinitions : "");
    if (!opened_ || sqlite3_exec(database_.get(), tables.c_str(), nullptr, nullptr, nullptr) != SQLITE_OK)
      return failed();
    for (const LogChannel& channel : contents.channels)
      if (!add_topic(channel)) return failed();
    if (jazzy && !add_definitions(contents)) return failed();
    Statement metadata(database_.get(), "INSERT INTO metadata(metadata_version, metadata) VALUES (?, ?)");
    const std::string text = bag_metadata(format_, contents);
    return metadata.integer(format_.metadata_version()).text(text).run() ? Status{} : failed();
  }

  Status add(const std::string& topic, const LogMessage& message) {
    if (!insert_)
      insert_.emplace(database_.get(), "INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)");
    const auto time = static_cast<std::int64_t>(message.log_time);
    return insert_->integer(topics_.at(topic)).integer(time).blob(message.data).run() ? Status{} : failed();
  }

  Status finish() {
    insert_.reset();
    const int code = sqlite3_exec(database_.get(), "COMMIT", nullptr, nullptr, nullptr);
    return code == SQLITE_OK ? Status{} : failed();
  }

 private:
  bool add_topic(const LogChannel& channel) {
    const bool jazzy = format_.release == BagRelease::Jazzy;
    const auto value = [&](const char* key) {
      const auto found = channel.metadata.find(key);
      return found == channel.metadata.end() ? std::string() : found->second;
    };
    const std::vector<OfferedQos> offered = parse_offered_qos(value("offered_qos_profiles"));
    const std::string qos = offered.empty() ? std::string() : to_yaml(offered, format_.qos());
    const std::string hash = value("topic_type_hash");
    Statement row(database_.get(), jazzy ? "INSERT INTO topics VALUES (?, ?, ?, 'cdr', ?, ?)"
                                         : "INSERT INTO topics VALUES (?, ?, ?, 'cdr', ?)");
    const auto id = static_cast<std::int64_t>(topics_.size()) + 1;
    topics_[channel.topic] = id;
    row.integer(id).text(channel.topic).text(channel.type).text(qos);
    if (jazzy) row.text(hash);
    return row.run();
  }

  bool add_definitions(const BagContents& contents) {
    Statement row(database_.get(),
                  "INSERT INTO message_definitions(topic_type, encoding, encoded_message_definition, "
                  "type_description_hash) VALUES (?, ?, ?, ?)");
    std::set<std::string> written;
    for (const LogChannel& channel : contents.channels) {
      if (channel.schema.empty() || !written.insert(channel.type).second) continue;
      const auto hash = channel.metadata.find("topic_type_hash");
      row.text(channel.type).text(channel.schema_encoding).text(channel.schema);
      if (!row.text(hash == channel.metadata.end() ? std::string_view() : hash->second).run()) return false;
    }
    return true;
  }

  [[nodiscard]] Status failed() const {
    return fail(ErrorCode::Unwritable, fmt::format("SQLite: {}", sqlite3_errmsg(database_.get())),
                {.source = path_.string()}, "Check the free space of the disk.");
  }

  std::filesystem::path path_;
  BagFormat format_;
  bool opened_ = false;
  std::shared_ptr<sqlite3> database_;
  std::map<std::string, std::int64_t> topics_;  ///< id by name
  std::optional<Statement> insert_;             ///< closed before the database
};

}  // namespace

Status write_sqlite_bag(MessageLog& log, const std::filesystem::path& path, const BagFormat& format,
                        const BagContents& contents,
                        const std::function<Status(std::uint64_t log_time)>& progress) {
  SqliteBag bag(path, format);
  if (Status status = bag.create(contents); !status) return status;
  Status status = log.visit({}, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    if (Status went_on = progress(message.log_time); !went_on) return went_on;
    return bag.add(channel.topic, message);
  });
  return status ? bag.finish() : status;
}

}  // namespace waymark
