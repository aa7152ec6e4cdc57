#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/recording/mcap_reader.hpp"

namespace waymark::cli {
namespace {

struct InfoArgs {
  std::string file;
  bool json = false;
};

struct TopicInfo {
  std::string topic;
  std::string type;
  std::string encoding;
  std::uint64_t messages = 0;
  double rate_hz = 0;  ///< over the duration of the whole file
};

struct FileInfo {
  std::string file;
  std::uint64_t size_bytes = 0;
  mcap::Index index{};
  double duration_s = 0;
  std::vector<TopicInfo> topics{};  ///< by name
  std::vector<mcap::Metadata> metadata{};
};

std::vector<TopicInfo> topics_of(const mcap::Index& index, double duration_s) {
  std::vector<TopicInfo> topics;
  for (const auto& [id, channel] : index.channels) {
    const auto schema = index.schemas.find(channel.schema_id);
    const auto count = index.statistics.channel_message_counts.find(id);
    TopicInfo info{.topic = channel.topic,
                   .type = schema == index.schemas.end() ? "" : schema->second.name,
                   .encoding = channel.message_encoding,
                   .messages = count == index.statistics.channel_message_counts.end() ? 0 : count->second};
    if (duration_s > 0 && info.messages > 1)
      info.rate_hz = static_cast<double>(info.messages - 1) / duration_s;
    topics.push_back(std::move(info));
  }
  std::ranges::stable_sort(topics, {}, &TopicInfo::topic);
  return topics;
}

Result<FileInfo> look(const std::string& path) {
  const auto source = open_file(path);
  if (!source) return tl::unexpected(source.error());
  const Result<std::uint64_t> size = (*source)->size();
  if (!size) return tl::unexpected(size.error());
  Result<mcap::Index> index = mcap::read_index(**source);
  if (!index) return tl::unexpected(index.error());
  FileInfo info{.file = path, .size_bytes = *size, .index = std::move(*index)};
  const mcap::Statistics& statistics = info.index.statistics;
  if (statistics.message_end_time > statistics.message_start_time)
    info.duration_s = static_cast<double>(statistics.message_end_time - statistics.message_start_time) * 1e-9;
  info.topics = topics_of(info.index, info.duration_s);
  for (const mcap::MetadataIndex& entry : info.index.metadata) {
    Result<mcap::Metadata> metadata = mcap::read_metadata(**source, entry);
    if (!metadata) return tl::unexpected(metadata.error());
    info.metadata.push_back(std::move(*metadata));
  }
  return info;
}

nlohmann::ordered_json to_json(const FileInfo& info) {
  const mcap::Index& index = info.index;
  nlohmann::ordered_json topics = nlohmann::ordered_json::array();
  for (const TopicInfo& t : info.topics) {
    topics.push_back({{"topic", t.topic},
                      {"type", t.type},
                      {"encoding", t.encoding},
                      {"messages", t.messages},
                      {"rate_hz", t.rate_hz}});
  }
  nlohmann::ordered_json metadata = nlohmann::ordered_json::object();
  for (const mcap::Metadata& block : info.metadata) metadata[block.name] = block.metadata;
  nlohmann::ordered_json attachments = nlohmann::ordered_json::array();
  for (const mcap::AttachmentIndex& a : index.attachments)
    attachments.push_back({{"name", a.name}, {"media_type", a.media_type}, {"size_bytes", a.data_size}});
  std::vector<std::string> problems;
  problems.reserve(index.problems.size());
  for (const Error& problem : index.problems) problems.push_back(to_string(problem));
  return {{"file", info.file},
          {"size_bytes", info.size_bytes},
          {"library", index.header.library},
          {"profile", index.header.profile},
          {"complete", index.from_summary},
          {"start_ns", index.statistics.message_start_time},
          {"duration_s", info.duration_s},
          {"messages", index.statistics.message_count},
          {"chunks", index.chunks.size()},
          {"topics", topics},
          {"metadata", metadata},
          {"attachments", attachments},
          {"problems", problems}};
}

/// A date where the clock is one of the calendar, else seconds since the robot was switched on.
std::string start_text(std::uint64_t start_ns) {
  constexpr std::uint64_t kYear2000 = 946'684'800;
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const std::uint64_t seconds = start_ns / kSecond;
  if (seconds < kYear2000)
    return fmt::format("{:.3f} s on the robot's clock", static_cast<double>(start_ns) * 1e-9);
  const std::chrono::sys_seconds when{std::chrono::seconds(static_cast<std::int64_t>(seconds))};
  return fmt::format("{:%Y-%m-%d %H:%M:%S} UTC", fmt::gmtime(std::chrono::system_clock::to_time_t(when)));
}

std::string to_text(const FileInfo& info) {
  const mcap::Index& index = info.index;
  std::string text = fmt::format(
      "{}: {:.1f} KiB, {} messages in {} chunks\n"
      "written by  {}{}\nstart       {}\nduration    {:.3f} s\n",
      info.file, static_cast<double>(info.size_bytes) / 1024, index.statistics.message_count,
      index.chunks.size(), index.header.library.empty() ? "unknown" : index.header.library,
      index.header.profile.empty() ? "" : ", profile " + index.header.profile,
      start_text(index.statistics.message_start_time), info.duration_s);
  std::size_t topic_width = 5;
  std::size_t type_width = 4;
  for (const TopicInfo& t : info.topics) {
    topic_width = std::max(topic_width, t.topic.size());
    type_width = std::max(type_width, t.type.size());
  }
  text += fmt::format("\n{:<{}}  {:<{}}  {:>9}  {:>8}\n", "topic", topic_width, "type", type_width,
                      "messages", "Hz");
  for (const TopicInfo& t : info.topics) {
    text += fmt::format("{:<{}}  {:<{}}  {:>9}  {:>8}\n", t.topic, topic_width, t.type, type_width,
                        t.messages, t.rate_hz > 0 ? fmt::format("{:.1f}", t.rate_hz) : "");
  }
  for (const mcap::Metadata& block : info.metadata) {
    text += fmt::format("\nmetadata {}\n", block.name);
    for (const auto& [key, value] : block.metadata) text += fmt::format("  {}: {}\n", key, value);
  }
  if (!index.attachments.empty()) text += "\nattachments\n";
  for (const mcap::AttachmentIndex& a : index.attachments)
    text += fmt::format("  {} ({}, {} bytes)\n", a.name, a.media_type, a.data_size);
  return text;
}

ExitCode info(const InfoArgs& args, Console& console) {
  const Result<FileInfo> found = look(args.file);
  if (!found) {
    console.say(found.error());
    return ExitCode::SomeFailed;
  }
  console.print(args.json ? json_line(to_json(*found)) : to_text(*found));
  if (!found->index.from_summary)
    console.say(
        "the file has no usable summary: it was cut, damaged or is still being written. What stands in "
        "it was counted.");
  for (const Error& problem : found->index.problems) console.say(problem);
  return ExitCode::Ok;
}

Run prepare_info(CLI::App& app) {
  const auto args = std::make_shared<InfoArgs>();
  app.add_option("FILE", args->file, "Recording (.mcap), by Waymark or anybody else")
      ->required()
      ->type_name("");
  app.add_flag("--json", args->json, "One JSON object instead of tables");
  return [args](Console& console) { return info(*args, console); };
}

}  // namespace

Verb info_verb() {
  return {
      .name = "info",
      .sentence = "Say what a recording holds",
      .help =
          R"(Who wrote it, when, how long; its topics with type, number of messages and rate; metadata; attachments.
A file that was cut, or is still being written, has no summary: it is read front to back, and that is said.

Exit code: 0 read, 1 not a recording or not readable, 2 wrong usage.

Examples:
  waymark info lap.mcap
  waymark info --json lap.mcap
)",
      .prepare = prepare_info,
      .verbs = {}};
}

}  // namespace waymark::cli
