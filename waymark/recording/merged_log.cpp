#include "waymark/recording/merged_log.hpp"

#include <algorithm>
#include <optional>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "waymark/recording/log_formats.hpp"
#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/split_log.hpp"

namespace waymark {
namespace {

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
    for (const auto& part : parts_) {
      Status status = part->visit_samples(selection, [&](const Sample& sample) {
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
  /// The camera of the first part that has one.
  Result<RecordingSetup> setup(const CameraChoice& choice) override {
    RecordingSetup all;
    for (const auto& part : parts_) {
      Result<RecordingSetup> one = part->setup(choice);
      if (!one) return one;
      all.problems.insert(all.problems.end(), one->problems.begin(), one->problems.end());
      all.metadata.merge(one->metadata);
      if (one->facts.infos.empty() && one->facts.views.empty() && one->facts.frames.empty()) continue;
      if (all.camera || all.base_T_cam) continue;
      one->metadata = std::move(all.metadata);
      one->problems = std::move(all.problems);
      all = std::move(*one);
    }
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
  void collect(const MessageLog& part) { std::ranges::copy(part.problems(), std::back_inserter(problems_)); }

  std::vector<std::unique_ptr<MessageLog>> parts_;
  std::vector<LogChannel> channels_;
  std::vector<LogProblem> problems_;  ///< of the last visit
};

/// The topic of its odometry; nothing where it has none.
std::optional<std::string> odometry_topic(const MessageLog& log) {
  const auto channel = std::ranges::find_if(log.channels(), [](const LogChannel& c) {
    return c.type.ends_with("/Odometry") && c.messages.value_or(1) > 0;
  });
  return channel == log.channels().end() ? std::nullopt : std::optional(channel->topic);
}

bool overlap(const LogSummary& a, const LogSummary& b) {
  return a.start && a.end && b.start && b.end && *a.start < *b.end && *b.start < *a.end;
}

/// A robot drives once at a time: odometry of two files at one time is of two drives, or of one drive twice.
Status check_one_drive(const std::vector<std::string>& paths,
                       const std::vector<std::unique_ptr<MessageLog>>& parts) {
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const auto topic = odometry_topic(*parts[i]);
    for (std::size_t j = 0; topic && j < i; ++j) {
      if (odometry_topic(*parts[j]) != topic || !overlap(parts[i]->summary(), parts[j]->summary())) continue;
      return fail(
          ErrorCode::InvalidArgument,
          fmt::format("it holds '{}' for the same time as {}: two drives, or one drive twice", *topic,
                      paths[j]),
          {.source = paths[i]},
          "Files that are read together must be of one drive. Map the first lap, then add the other with "
          "`waymark map SECOND --extend MAP`.");
    }
  }
  return {};
}

}  // namespace

std::unique_ptr<MessageLog> merge_logs(std::vector<std::unique_ptr<MessageLog>> parts) {
  return std::make_unique<MergedLog>(std::move(parts));
}

Result<std::unique_ptr<MessageLog>> open_logs(const std::vector<std::string>& paths,
                                              const LogOptions& options) {
  if (paths.empty()) return fail(ErrorCode::InvalidArgument, "no recording is named");
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
  return merge_logs(std::move(parts));
}

}  // namespace waymark
