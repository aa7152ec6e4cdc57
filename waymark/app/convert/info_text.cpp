#include "waymark/app/convert/info_text.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/base/counted.hpp"

namespace waymark {
namespace {

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

std::string head_text(const RecordingInfo& info) {
  const std::string chunks = info.summary.chunks ? fmt::format(" in {} chunks", *info.summary.chunks) : "";
  std::string text = fmt::format(
      "{}: {:.1f} KiB, {} messages{}\n"
      "format      {}\n",
      info.file, static_cast<double>(info.summary.size_bytes) / 1024, info.report.messages, chunks,
      info.description);
  if (!info.summary.library.empty()) text += fmt::format("written by  {}\n", info.summary.library);
  return text + fmt::format("start       {}\nduration    {:.3f} s\n", start_text(info.report.start_ns),
                            info.report.duration_s);
}

std::string topics_text(const RecordingInfo& info) {
  std::size_t topic_width = 5;
  std::size_t type_width = 4;
  for (const TopicReport& t : info.report.topics) {
    topic_width = std::max(topic_width, t.topic.size());
    type_width = std::max(type_width, t.type.size());
  }
  std::string text = fmt::format("\n{:<{}}  {:<{}}  {:>9}  {:>8}\n", "topic", topic_width, "type", type_width,
                                 "messages", "Hz");
  for (const TopicReport& t : info.report.topics) {
    text += fmt::format("{:<{}}  {:<{}}  {:>9}  {:>8}\n", t.topic, topic_width, t.type, type_width,
                        t.messages, t.rate_hz > 0 ? fmt::format("{:.1f}", t.rate_hz) : "");
  }
  return text;
}

/// What is wrong with the stamps of a topic; empty when nothing is.
std::string stamps_text(const TopicReport& topic) {
  std::vector<std::string> words;
  const StampStatistics& stamps = topic.stamps;
  if (stamps.gaps() > 0)
    words.push_back(fmt::format("about {} missing in {}, the longest {:.2f} s",
                                counted(stamps.dropped(), "message"), counted(stamps.gaps(), "gap"),
                                static_cast<double>(stamps.longest_ns()) * 1e-9));
  const auto count = [&](std::uint64_t n, const char* what) {
    if (n > 0) words.push_back(fmt::format("{} {}", n, what));
  };
  count(stamps.zero(), "stamps of zero");
  count(stamps.duplicate(), "stamps twice");
  count(stamps.backward(), "stamps before the one before");
  if (topic.clock_jumps > 0)
    words.push_back(fmt::format("the clock jumped {}, at most by {:.2f} s",
                                counted(topic.clock_jumps, "time"), topic.largest_jump_s));
  return words.empty() ? "" : fmt::format("  {}: {}\n", topic.topic, fmt::join(words, "; "));
}

}  // namespace

std::string to_text(const RecordingInfo& info) {
  std::string text = head_text(info) + topics_text(info);
  std::string stamps;
  if (!info.quick)
    for (const TopicReport& topic : info.report.topics) stamps += stamps_text(topic);
  if (!stamps.empty()) text += "\nstamps\n" + stamps;
  for (const auto& [name, values] : info.setup.metadata) {
    text += fmt::format("\nmetadata {}\n", name);
    for (const auto& [key, value] : values) text += fmt::format("  {}: {}\n", key, value);
  }
  if (!info.attachments.empty()) text += "\nattachments\n";
  for (const LogAttachment& a : info.attachments)
    text += fmt::format("  {} ({}, {} bytes)\n", a.name, a.media_type, a.size_bytes);
  const std::vector<NextStep> steps = next_steps(info);
  if (!steps.empty()) text += "\nnext\n";
  for (const NextStep& step : steps)
    text += fmt::format("  {}\n{}", step.sentence, step.command.empty() ? "" : "    " + step.command + "\n");
  return text;
}

}  // namespace waymark
