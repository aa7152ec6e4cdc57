#include "waymark/recording/several_logs.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/ros_log.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kOverlapSecond = 1'000'000'000;
constexpr std::uint64_t kMaxWindows = 10'000;  // per overlap, whatever duration the files claim

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
    // Between two consecutive times the set of parts with messages is constant.
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

  Result<std::map<std::string, std::map<std::string, std::string>>> metadata() override {
    std::map<std::string, std::map<std::string, std::string>> all;
    for (const auto& part : parts_) {
      auto blocks = part->metadata();
      if (!blocks) return tl::unexpected(blocks.error());
      all.merge(*blocks);
    }
    return all;
  }

  std::vector<LogProblem> problems() const override {
    std::vector<LogProblem> all = opened_.list();
    for (const auto& [where, problem] : of_parts_) all.push_back(problem);
    visited_.append_to(all);
    return all;
  }

 private:
  /// Collects the problems of a part, because each visit of a part clears those of the previous one.
  void collect(std::size_t part) {
    for (const LogProblem& problem : parts_[part]->problems()) {
      const auto [known, is_new] = of_parts_.try_emplace({part, problem.key}, problem);
      if (!is_new) known->second.count = std::max(known->second.count, problem.count);
    }
  }

  /// Index of the channel; the same topic and type in several files form one channel.
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
    const std::uint64_t window = std::max(kOverlapSecond, (span.to - span.from) / kMaxWindows);
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

namespace {

/// Merged recordings of any format. Samples are held in memory, ordered by their stamps; messages are visited
/// file by file.
class MergedLog final : public MessageLog {
 public:
  explicit MergedLog(std::vector<std::unique_ptr<MessageLog>> parts) : parts_(std::move(parts)) {
    for (const auto& part : parts_)
      channels_.insert(channels_.end(), part->channels().begin(), part->channels().end());
  }

  LogFormat format() const override { return LogFormat::Merged; }
  std::string description() const override {
    std::vector<std::string> words;
    words.reserve(parts_.size());
    for (const auto& part : parts_) words.push_back(part->description());
    return fmt::format("{}", fmt::join(words, " and "));
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
      all.complete = all.complete && one.complete;
      all.files.insert(all.files.end(), one.files.begin(), one.files.end());
    }
    return all;
  }

  Status visit(const LogSelection& selection, const Visitor& visit) override {
    problems_.clear();
    for (const auto& part : parts_) {
      Status status = part->visit(selection, visit);
      collect(*part);
      if (!status) return status;
    }
    return {};
  }

  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    problems_.clear();
    std::vector<Sample> samples;
    LogSelection of_parts = selection;
    of_parts.odometry_in_transforms = selection.odometry_in_transforms && !has_odometry_messages(*this);
    for (const auto& part : parts_) {
      Status status = part->visit_samples(of_parts, [&](const Sample& sample) {
        samples.push_back(sample);
        return Status{};
      });
      collect(*part);
      if (!status) return status;
    }
    std::ranges::stable_sort(samples, {}, stamp_of);
    for (const Sample& sample : samples)
      if (Status status = visit(sample); !status) return status;
    return {};
  }

  using MessageLog::setup;
  /// The setup from the first part that has a camera, with the odometry and the IMU of any part.
  Result<RecordingSetup> setup(const CameraChoice& choice) override {
    RecordingSetup all;
    std::vector<RecordedMotion> motions;
    for (const auto& part : parts_) {
      Result<RecordingSetup> one = part->setup(choice);
      if (!one) return one;
      add_motions(one->facts.motions, motions);
      all.problems.insert(all.problems.end(), one->problems.begin(), one->problems.end());
      all.metadata.merge(one->metadata);
      if (!has_camera_facts(one->facts)) continue;
      if (all.camera || all.base_T_cam) continue;
      one->metadata = std::move(all.metadata);
      one->problems = std::move(all.problems);
      all = std::move(*one);
    }
    if (has_odometry_messages(*this))
      std::erase_if(motions, [](const RecordedMotion& motion) { return !motion.parent.empty(); });
    all.facts.motions = std::move(motions);
    // Tables and LCM logs have no frames and topics to choose from.
    if (has_camera_facts(all.facts) || !all.facts.motions.empty()) choose(all, choice);
    return all;
  }

  std::vector<LogAttachment> attachments() const override {
    std::vector<LogAttachment> all;
    for (const auto& part : parts_) std::ranges::copy(part->attachments(), std::back_inserter(all));
    return all;
  }
  Status visit_attachments(const std::function<Status(const Attachment&)>& visit) override {
    for (const auto& part : parts_)
      if (Status status = part->visit_attachments(visit); !status) return status;
    return {};
  }
  std::vector<LogProblem> problems() const override {
    if (!problems_.empty()) return problems_;
    std::vector<LogProblem> all;
    for (const auto& part : parts_) std::ranges::copy(part->problems(), std::back_inserter(all));
    return all;
  }

 private:
  static bool has_camera_facts(const CameraFacts& facts) {
    return !facts.infos.empty() || !facts.views.empty() || !facts.frames.empty();
  }
  /// Adds the topics and transforms that no earlier part has.
  static void add_motions(const std::vector<RecordedMotion>& from, std::vector<RecordedMotion>& all) {
    for (const RecordedMotion& motion : from) {
      const bool known = std::ranges::any_of(all, [&](const RecordedMotion& other) {
        const bool topics = motion.parent.empty() && other.parent.empty();
        return motion.topic == other.topic && (topics || motion.link() == other.link());
      });
      if (!known) all.push_back(motion);
    }
  }
  void collect(const MessageLog& part) { std::ranges::copy(part.problems(), std::back_inserter(problems_)); }

  std::vector<std::unique_ptr<MessageLog>> parts_;
  std::vector<LogChannel> channels_;
  std::vector<LogProblem> problems_;  ///< problems of the last visit
};

/// The topic of the odometry; empty if there is none.
std::optional<std::string> odometry_topic(const MessageLog& log) {
  const auto channel = std::ranges::find_if(log.channels(), [](const LogChannel& c) {
    return c.type.ends_with("/Odometry") && c.messages.value_or(1) > 0;
  });
  return channel == log.channels().end() ? std::nullopt : std::optional(channel->topic);
}

bool overlap(const LogSummary& a, const LogSummary& b) {
  return a.start && a.end && b.start && b.end && *a.start < *b.end && *b.start < *a.end;
}

/// The transforms that are the odometry of a file, if any.
std::optional<std::string> odometry_transforms(MessageLog& log) {
  const Result<RecordingSetup> setup = log.setup();
  return setup && setup->chosen.odometry_frames ? std::optional(setup->chosen.odometry) : std::nullopt;
}

/// Two files with odometry at the same time contain two drives, or the same drive twice.
Status check_one_drive(const std::vector<std::string>& paths,
                       const std::vector<std::unique_ptr<MessageLog>>& parts) {
  const bool messages =
      std::ranges::any_of(parts, [](const auto& part) { return has_odometry_messages(*part); });
  const auto source = [&](std::size_t i) {
    return messages ? odometry_topic(*parts[i]) : odometry_transforms(*parts[i]);
  };
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!overlap(parts[i]->summary(), parts[j]->summary())) continue;
      const auto odometry = source(i);
      if (!odometry) break;
      if (source(j) != odometry) continue;
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("overlaps in '{}' with {}: two drives, or one drive twice", *odometry, paths[j]),
          {.source = paths[i]},
          "Files that are read together must belong to one drive. Map the first lap, then add the "
          "second with "
          "`waymark map SECOND extend=MAP`.");
    }
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<MessageLog>> open_logs(const std::vector<std::string>& paths,
                                              const LogOptions& options) {
  if (paths.empty()) return fail(ErrorCode::InvalidArgument, "no recording given");
  std::vector<std::unique_ptr<MessageLog>> parts;
  for (const std::string& path : paths) {
    Result<std::unique_ptr<MessageLog>> log = open_log(std::filesystem::path(path), options);
    if (!log || paths.size() == 1) return log;
    parts.push_back(std::move(*log));
  }
  if (Status status = check_one_drive(paths, parts); !status) return tl::unexpected(status.error());
  const LogFormat first = parts.front()->format();
  const bool alike = std::ranges::all_of(parts, [&](const auto& part) { return part->format() == first; });
  if (alike && !gives_samples(first)) return join_logs(std::move(parts), {});
  return std::make_unique<MergedLog>(std::move(parts));
}

}  // namespace waymark
