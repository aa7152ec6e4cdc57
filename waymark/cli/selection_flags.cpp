#include "waymark/cli/selection_flags.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/base/suggest.hpp"

namespace waymark::cli {

SelectionFlags::SelectionFlags(CLI::App& app) {
  app.add_option("--topics", topics_, "Only these topics, with commas between them. Unless given: all")
      ->delimiter(',')
      ->type_name("TOPIC,…");
  app.add_option("--from", from_s_, "Begin this many seconds after the first message")
      ->capture_default_str()
      ->type_name("SECONDS");
  app.add_option("--to", to_s_, "End this many seconds after the first message. Unless given: with the file")
      ->type_name("SECONDS");
}

Result<LogSelection> SelectionFlags::make(MessageLog& log) const {
  LogSelection selection;
  std::vector<std::string> known;
  for (const LogChannel& channel : log.channels()) known.push_back(channel.topic);
  for (const std::string& topic : topics_) {
    if (std::ranges::find(known, topic) == known.end())
      return fail(ErrorCode::NotFound, fmt::format("the recording has no topic '{}'", topic),
                  {.key = "--topics"}, suggestion(topic, known));
    selection.topics.insert(topic);
  }
  if (!(from_s_ >= 0 && to_s_ > from_s_))
    return fail(ErrorCode::InvalidArgument, fmt::format("from {} s to {} s is no time", from_s_, to_s_),
                {.key = "--from"}, "Give seconds from the first message, for example --from 10 --to 20.");
  const std::uint64_t start = recording_start_ns(log);
  constexpr double kMost_s = 1e9;  // 30 years
  if (from_s_ > 0) selection.from = start + static_cast<std::uint64_t>(std::min(from_s_, kMost_s) * 1e9);
  if (to_s_ < kMost_s) selection.to = start + static_cast<std::uint64_t>(to_s_ * 1e9);
  return selection;
}

}  // namespace waymark::cli
