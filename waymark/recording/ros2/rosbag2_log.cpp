#include "waymark/recording/ros2/rosbag2_log.hpp"

#include <algorithm>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "waymark/recording/compression.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros2/sqlite_database.hpp"
#include "waymark/recording/ros_log.hpp"
#include "waymark/recording/several_logs.hpp"

namespace waymark {
namespace {

/// Timestamps in the file are signed; negative ones (before 1970) count as 0.
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

  /// Reads everything except the messages. Fails if the file is not a bag.
  Status load() {
    const std::set<std::string> topics = database_.columns("topics");
    const std::set<std::string> messages = database_.columns("messages");
    const bool bag = topics.contains("name") && topics.contains("type") && messages.contains("timestamp") &&
                     messages.contains("topic_id") && messages.contains("data");
    if (!bag)
      return fail(ErrorCode::Unsupported,
                  "this SQLite file is not a rosbag2 bag: the tables topics and messages are missing",
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
                       fmt::format("message of topic {}, which is not listed", rows->integer(0)),
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
    if (!database_.columns("schema").contains("schema_version"))
      return {};  // Galactic and older releases have no such table
    Result<SqliteDatabase::Query> row = database_.query("SELECT schema_version, ros_distro FROM schema");
    if (!row || !row->next().value_or(false)) return {};
    schema_version_ = row->integer(0);
    distro_ = row->text(1);
    return {};
  }

  /// Reads the topics. Columns were added over the years; missing ones are skipped.
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

  /// Reads message definitions. Bags from before Iron contain none; built-in definitions with the same names
  /// are used instead.
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
        return Error{ErrorCode::Unsupported,
                     fmt::format("no definition of {} in the bag or built in; copied without a definition",
                                 channel.type),
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

  /// Reads the time span. In a damaged file, the time index may be intact even if the messages are not;
  /// otherwise any time is allowed.
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

namespace {

struct Span {
  std::uint64_t from = 0;
  std::uint64_t to = 0;  ///< exclusive
};

/// The time span in which both have messages; empty if they do not overlap.
std::optional<Span> common_span(const LogSummary& a, const LogSummary& b) {
  if (!a.start || !a.end || !b.start || !b.end) return std::nullopt;
  const std::uint64_t last = std::min(*a.end, *b.end);
  const Span span{std::max(*a.start, *b.start), last == UINT64_MAX ? last : last + 1};
  return span.from < span.to ? std::optional(span) : std::nullopt;
}

/// Topics that both contain with the same type.
std::set<std::string> common_topics(const MessageLog& a, const MessageLog& b) {
  std::set<std::string> topics;
  for (const LogChannel& mine : a.channels()) {
    const bool both = std::ranges::any_of(b.channels(), [&](const LogChannel& other) {
      return other.topic == mine.topic && other.type == mine.type;
    });
    if (both) topics.insert(mine.topic);
  }
  return topics;
}

/// Topic, time and a hash of the bytes of each message.
using Messages = std::set<std::tuple<std::string, std::uint64_t, std::size_t>>;

Result<Messages> messages_of(MessageLog& log, const std::set<std::string>& topics, const Span& span) {
  Messages messages;
  const Status read = log.visit(
      {topics, span.from, span.to}, [&](const LogChannel& channel, const LogMessage& message) -> Status {
        const std::string_view bytes(reinterpret_cast<const char*>(message.data.data()), message.data.size());
        messages.emplace(channel.topic, message.log_time, std::hash<std::string_view>()(bytes));
        return {};
      });
  if (!read) return tl::unexpected(read.error());
  return messages;
}

enum class Relation : std::uint8_t { Apart, Copy, SameTime };

/// Relation of a shorter recording to a longer one.
Result<Relation> relation_of(MessageLog& shorter, MessageLog& longer) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const LogSummary mine = shorter.summary();
  const auto span = common_span(mine, longer.summary());
  const std::set<std::string> topics = common_topics(shorter, longer);
  if (!span || topics.empty()) return Relation::Apart;
  // Inspecting the first seconds is enough, because consecutive parts overlap only briefly.
  const bool much = 2 * (span->to - span->from) > *mine.end - *mine.start;
  if (!much) return Relation::Apart;
  const Span look{span->from, std::min(span->to, span->from + 10 * kSecond)};
  const auto a = messages_of(shorter, topics, look);
  const auto b = messages_of(longer, topics, look);
  if (!a || !b || a->empty() || b->empty()) return Relation::Apart;
  std::size_t known = 0;
  for (const auto& message : *a) known += b->contains(message) ? 1U : 0U;
  if (10 * known > 9 * a->size()) return Relation::Copy;
  // Several recorders may store slowly changing topics (/tf_static) at the same time; such topics do not
  // indicate separate drives.
  constexpr std::size_t kDrive = 20;
  return a->size() >= kDrive && b->size() >= kDrive ? Relation::SameTime : Relation::Apart;
}

std::string file_of(const MessageLog& log) {
  const LogSummary summary = log.summary();
  return summary.files.empty() ? std::string("a file of the folder") : summary.files.front();
}

/// Files in a folder that are not listed in a metadata.yaml need not belong to one recording. Removes copies
/// (including truncated or recovered ones), whose messages another file contains, and lists them in
/// `problems`. Fails if two files have the same topics at the same time and are not copies, because they are
/// two drives.
Status remove_copies(std::vector<std::unique_ptr<MessageLog>>& parts, LogProblems& problems) {
  std::vector<std::size_t> order(parts.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto length = [&](std::size_t i) { return parts[i]->summary().messages.value_or(0); };
  std::ranges::stable_sort(order, std::greater<>{}, length);
  std::vector<std::size_t> kept;
  for (const std::size_t i : order) {
    bool copy = false;
    for (const std::size_t k : kept) {
      const auto relation = relation_of(*parts[i], *parts[k]);
      if (!relation) return tl::unexpected(relation.error());
      if (*relation == Relation::SameTime)
        return fail(ErrorCode::Unsupported,
                    fmt::format("same topics at the same time as in {}: two recordings, not parts of one",
                                file_of(*parts[k])),
                    {.source = file_of(*parts[i])}, "Pass one of the files instead of their folder.");
      copy = copy || *relation == Relation::Copy;
      if (*relation != Relation::Copy) continue;
      problems.damages("folder.copy", {Error{ErrorCode::InvalidArgument,
                                             "duplicates " + file_of(*parts[k]) + "; skipped",
                                             {.source = file_of(*parts[i])},
                                             "Move the copy elsewhere."}});
      break;
    }
    if (!copy) kept.push_back(i);
  }
  std::ranges::sort(kept);
  std::vector<std::unique_ptr<MessageLog>> remaining;
  remaining.reserve(kept.size());
  for (const std::size_t i : kept) remaining.push_back(std::move(parts[i]));
  parts = std::move(remaining);
  return {};
}

namespace fs = std::filesystem;

/// The part of a metadata.yaml that lists the files of a bag.
struct BagMetadata {
  std::vector<std::string> files{};
  bool packed_messages = false;
};

std::string unquoted(std::string text) {
  const auto blank = [](char c) { return c == ' ' || c == '\r' || c == '\t'; };
  while (!text.empty() && blank(text.front())) text.erase(0, 1);
  while (!text.empty() && blank(text.back())) text.pop_back();
  const bool quoted =
      text.size() >= 2 && (text.front() == '"' || text.front() == '\'') && text.back() == text.front();
  return quoted ? text.substr(1, text.size() - 2) : text;
}

BagMetadata parse_metadata(std::istream& yaml) {
  BagMetadata metadata;
  bool listing = false;
  for (std::string line; std::getline(yaml, line);) {
    const std::size_t begin = std::min(line.find_first_not_of(" \t"), line.size());
    const std::string words = line.substr(begin);
    const bool item = words.starts_with("- ");
    if (listing && item) metadata.files.push_back(unquoted(words.substr(2)));
    if (!item) listing = words.starts_with("relative_file_paths:");
    if (words.starts_with("compression_mode:"))
      metadata.packed_messages =
          unquoted(words.substr(17)) == "MESSAGE" || unquoted(words.substr(17)) == "message";
  }
  return metadata;
}

bool is_bag_file(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.ends_with(".db3") || name.ends_with(".mcap") || name.ends_with(".db3.zstd") ||
         name.ends_with(".mcap.zstd");
}

/// A listed file is expected next to the metadata, regardless of the recorded path.
std::optional<fs::path> find_file(const fs::path& folder, const std::string& listed) {
  const fs::path name = fs::path(listed).filename();
  std::error_code ignored;
  for (const std::string& packing : {std::string(), std::string(".zstd")}) {
    const fs::path candidate = folder / (name.string() + packing);
    if (fs::is_regular_file(candidate, ignored)) return candidate;
  }
  return std::nullopt;
}

Result<std::unique_ptr<MessageLog>> open_part(const fs::path& path, bool packed_messages,
                                              const LogOptions& options) {
  if (packed_messages && path.extension() == ".db3")
    return open_rosbag2_file(path, path.string(), true, options);
  return open_log(path, options);
}

/// Bag files in a folder, sorted by name.
std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_bag_file(entry.path())) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

/// The existing files that the metadata lists, in that order. Missing files count as damage.
std::vector<fs::path> listed_files(const fs::path& folder, const BagMetadata& metadata,
                                   LogProblems& problems) {
  std::vector<fs::path> files;
  for (const std::string& listed : metadata.files) {
    if (const auto file = find_file(folder, listed)) {
      files.push_back(*file);
    } else {
      problems.damages("rosbag2.missing_file", {Error{ErrorCode::NotFound,
                                                      "the file is listed in the bag but does not exist",
                                                      {.source = (folder / listed).string()},
                                                      {}}});
    }
  }
  return files;
}

struct BagFiles {
  std::vector<fs::path> files{};
  bool listed = false;  ///< the files are listed in metadata.yaml
};

/// The existing files in a bag folder, in order.
BagFiles files_of(const fs::path& folder, BagMetadata& metadata, LogProblems& problems) {
  std::ifstream yaml(folder / "metadata.yaml");
  const bool there = yaml.is_open();
  if (there) metadata = parse_metadata(yaml);
  if (std::vector<fs::path> listed = listed_files(folder, metadata, problems); !listed.empty())
    return {std::move(listed), true};
  BagFiles found{files_in(folder), false};
  if (found.files.empty()) return found;
  problems.damages("rosbag2.no_metadata",
                   {Error{ErrorCode::NotFound,
                          there ? "metadata.yaml of the bag lists none of the existing files"
                                : "the bag folder has no metadata.yaml: its recorder did not finish",
                          {.source = folder.string()},
                          "All its .db3 and .mcap files are read."}});
  return found;
}

}  // namespace

Result<std::unique_ptr<MessageLog>> open_bag_folder(const fs::path& folder, const LogOptions& options) {
  LogProblems problems;
  BagMetadata metadata;
  const auto [files, listed] = files_of(folder, metadata, problems);
  if (files.empty())
    return fail(ErrorCode::NotFound,
                "no bag in the folder: no metadata.yaml with existing files and no .db3 or .mcap file",
                {.source = folder.string()}, "Give a recording, or the folder of a rosbag2.");
  std::vector<std::unique_ptr<MessageLog>> parts;
  for (const fs::path& file : files) {
    Result<std::unique_ptr<MessageLog>> part = open_part(file, metadata.packed_messages, options);
    if (part) {
      parts.push_back(std::move(*part));
    } else {
      problems.damages("rosbag2.file", {part.error()});
    }
  }
  if (parts.empty()) return tl::unexpected(problems.list().back().error);
  if (!listed) {  // no metadata.yaml lists them as one recording
    if (Status status = remove_copies(parts, problems); !status) return tl::unexpected(status.error());
  }
  return join_logs(std::move(parts), std::move(problems));
}

}  // namespace waymark
