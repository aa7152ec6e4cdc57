#include "waymark/recording/folder_copies.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>

#include <fmt/format.h>

namespace waymark {
namespace {

struct Span {
  std::uint64_t from = 0;
  std::uint64_t to = 0;  ///< the last message is before it
};

/// When both have messages; nothing when they have no time in common.
std::optional<Span> common_span(const LogSummary& a, const LogSummary& b) {
  if (!a.start || !a.end || !b.start || !b.end) return std::nullopt;
  const std::uint64_t last = std::min(*a.end, *b.end);
  const Span span{std::max(*a.start, *b.start), last == UINT64_MAX ? last : last + 1};
  return span.from < span.to ? std::optional(span) : std::nullopt;
}

/// The topics that both have, with the same type.
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

/// Topic, time, and a hash of the bytes.
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

/// Of a shorter recording to a longer one.
Result<Relation> relation_of(MessageLog& shorter, MessageLog& longer) {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  const LogSummary mine = shorter.summary();
  const auto span = common_span(mine, longer.summary());
  const std::set<std::string> topics = common_topics(shorter, longer);
  if (!span || topics.empty()) return Relation::Apart;
  // A look at the first seconds tells; parts that follow each other overlap by moments.
  const bool much = 2 * (span->to - span->from) > *mine.end - *mine.start;
  if (!much) return Relation::Apart;
  const Span look{span->from, std::min(span->to, span->from + 10 * kSecond)};
  const auto a = messages_of(shorter, topics, look);
  const auto b = messages_of(longer, topics, look);
  if (!a || !b || a->empty() || b->empty()) return Relation::Apart;
  std::size_t known = 0;
  for (const auto& message : *a) known += b->contains(message) ? 1U : 0U;
  if (10 * known > 9 * a->size()) return Relation::Copy;
  // Several programs may write down what hardly changes (/tf_static): those are no drives.
  constexpr std::size_t kDrive = 20;
  return a->size() >= kDrive && b->size() >= kDrive ? Relation::SameTime : Relation::Apart;
}

std::string file_of(const MessageLog& log) {
  const LogSummary summary = log.summary();
  return summary.files.empty() ? std::string("a file of the folder") : summary.files.front();
}

}  // namespace

Status take_copies_out(std::vector<std::unique_ptr<MessageLog>>& parts, LogProblems& problems) {
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
        return fail(
            ErrorCode::Unsupported,
            fmt::format("the same topics at the same time as in {}: two recordings, and no parts of one",
                        file_of(*parts[k])),
            {.source = file_of(*parts[i])}, "Name the one that is meant, and not their folder.");
      copy = copy || *relation == Relation::Copy;
      if (*relation != Relation::Copy) continue;
      problems.damages("folder.copy", {Error{ErrorCode::InvalidArgument,
                                             "holds what " + file_of(*parts[k]) + " holds: left out",
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

}  // namespace waymark
