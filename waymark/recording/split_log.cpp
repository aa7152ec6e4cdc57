#include "waymark/recording/split_log.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "waymark/recording/ros_log.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kSecond = 1'000'000'000;
constexpr std::uint64_t kMostWindows = 10'000;  // of one overlap, however long somebody says it is

class SplitLog final : public RosLog {
 public:
  SplitLog(std::vector<std::unique_ptr<MessageLog>> parts, LogProblems problems)
      : parts_(std::move(parts)), opened_(std::move(problems)) {
    channel_of_.resize(parts_.size());
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      for (const LogChannel& channel : parts_[i]->channels()) channel_of_[i].push_back(file(channel));
      collect(i);
    }
  }

  LogFormat format() const override { return parts_.front()->format(); }
  std::string description() const override {
    return fmt::format("{}, {} files in a folder", parts_.front()->description(), parts_.size());
  }
  const std::vector<LogChannel>& channels() const override { return channels_; }

  LogSummary summary() const override {
    LogSummary all{.messages = 0};
    for (const auto& part : parts_) {
      const LogSummary one = part->summary();
      if (one.start) all.start = std::min(all.start.value_or(*one.start), *one.start);
      if (one.end) all.end = std::max(all.end.value_or(*one.end), *one.end);
      *all.messages += one.messages.value_or(0);
      all.size_bytes += one.size_bytes;
      all.files.insert(all.files.end(), one.files.begin(), one.files.end());
    }
    return all;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    visited_.clear();
    // Between two neighbouring times the same parts have messages.
    std::vector<std::uint64_t> times;
    for (const auto& part : parts_) {
      const LogSummary one = part->summary();
      if (!one.start) continue;
      times.push_back(*one.start);
      times.push_back(*one.end == UINT64_MAX ? *one.end : *one.end + 1);
    }
    std::ranges::sort(times);
    times.erase(std::unique(times.begin(), times.end()), times.end());
    for (std::size_t i = 0; i + 1 < times.size(); ++i) {
      LogSelection span = selection;
      span.from = std::max(selection.from, times[i]);
      span.to = std::min(selection.to, times[i + 1]);
      if (span.from >= span.to) continue;
      if (Status status = visit_span(span, visit); !status) return status;
    }
    return {};
  }

  std::vector<LogAttachment> attachments() const override {
    std::vector<LogAttachment> all;
    for (const auto& part : parts_) {
      const std::vector<LogAttachment> some = part->attachments();
      all.insert(all.end(), some.begin(), some.end());
    }
    return all;
  }
  Status visit_attachments(const std::function<Status(const Attachment&)>& visit) override {
    for (const auto& part : parts_)
      if (Status status = part->visit_attachments(visit); !status) return status;
    return {};
  }

  std::vector<LogProblem> problems() const override {
    std::vector<LogProblem> all = opened_.list();
    for (const auto& [where, problem] : of_parts_) all.push_back(problem);
    visited_.append_to(all);
    return all;
  }

 protected:
  Result<std::map<std::string, std::map<std::string, std::string>>> metadata() override {
    std::map<std::string, std::map<std::string, std::string>> all;
    for (const auto& part : parts_) {
      Result<RecordingSetup> setup = part->setup();
      if (!setup) return tl::unexpected(setup.error());
      all.merge(setup->metadata);
    }
    return all;
  }

 private:
  /// Each visit of a part forgets what the one before noticed; we do not.
  void collect(std::size_t part) {
    for (const LogProblem& problem : parts_[part]->problems()) {
      const auto [known, is_new] = of_parts_.try_emplace({part, problem.key}, problem);
      if (!is_new) known->second.count = std::max(known->second.count, problem.count);
    }
  }

  /// The same topic and type in several files is one channel.
  std::size_t file(const LogChannel& channel) {
    const auto same = std::ranges::find_if(channels_, [&](const LogChannel& known) {
      return known.topic == channel.topic && known.type == channel.type && known.encoding == channel.encoding;
    });
    const auto number = static_cast<std::size_t>(same - channels_.begin());
    if (same == channels_.end()) {
      channels_.push_back(channel);
    } else if (same->messages && channel.messages) {
      *same->messages += *channel.messages;
    }
    return number;
  }

  const LogChannel& ours(std::size_t part, const LogChannel& channel) const {
    const auto number = static_cast<std::size_t>(&channel - parts_[part]->channels().data());
    return channels_[channel_of_[part][number]];
  }

  Status visit_span(const LogSelection& span, const Visitor& visit) {
    std::vector<std::size_t> here;
    for (std::size_t i = 0; i < parts_.size(); ++i) {
      const LogSummary one = parts_[i]->summary();
      if (one.start && *one.start < span.to && *one.end >= span.from) here.push_back(i);
    }
    if (here.size() == 1) {
      Status status = parts_[here[0]]->visit(span, [&](const LogChannel& channel, const LogMessage& message) {
        return visit(ours(here[0], channel), message);
      });
      collect(here[0]);
      return status;
    }
    const std::uint64_t window = std::max(kSecond, (span.to - span.from) / kMostWindows);
    for (LogSelection part = span; part.from < span.to; part.from = part.to) {
      part.to = span.to - part.from > window ? part.from + window : span.to;
      if (Status status = visit_merged(part, here, visit); !status) return status;
    }
    return {};
  }

  Status visit_merged(const LogSelection& window, const std::vector<std::size_t>& here,
                      const Visitor& visit) {
    struct Kept {
      const LogChannel* channel;
      std::uint64_t log_time;
      std::uint64_t publish_time;
      Bytes data;
    };
    std::vector<Kept> kept;
    for (const std::size_t i : here) {
      Status status = parts_[i]->visit(window, [&](const LogChannel& channel, const LogMessage& message) {
        kept.push_back({&ours(i, channel), message.log_time, message.publish_time,
                        Bytes(message.data.begin(), message.data.end())});
        return Status{};
      });
      collect(i);
      if (!status) return status;
    }
    std::ranges::stable_sort(kept, {}, &Kept::log_time);
    for (const Kept& message : kept) {
      if (Status status = visit(*message.channel, {message.log_time, message.publish_time, message.data});
          !status)
        return status;
    }
    return {};
  }

  std::vector<std::unique_ptr<MessageLog>> parts_;
  std::vector<std::vector<std::size_t>> channel_of_;
  std::vector<LogChannel> channels_;
  std::map<std::pair<std::size_t, std::string>, LogProblem> of_parts_;
  LogProblems opened_;
};

}  // namespace

std::unique_ptr<MessageLog> join_logs(std::vector<std::unique_ptr<MessageLog>> parts, LogProblems problems) {
  return std::make_unique<SplitLog>(std::move(parts), std::move(problems));
}

}  // namespace waymark
