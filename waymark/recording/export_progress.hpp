#pragma once

#include <algorithm>

#include "waymark/recording/export_log.hpp"

namespace waymark {

/// How far a visit of a log has come, by the times it meets; tells the caller now and then.
class ExportProgress {
 public:
  ExportProgress(const MessageLog& log, const ExportOptions& options) : report_(options.progress) {
    const LogSummary summary = log.summary();
    begin_ = std::max(summary.start.value_or(0), options.selection.from);
    end_ = std::min(summary.end.value_or(0), options.selection.to);
  }

  Status at(std::uint64_t log_time) {
    constexpr std::uint64_t kEvery = 256;
    if (!report_ || ++count_ % kEvery != 0) return {};
    const double whole = end_ > begin_ ? static_cast<double>(end_ - begin_) : 1;
    const double done = log_time > begin_ ? static_cast<double>(log_time - begin_) / whole : 0;
    return report_(std::clamp(done, 0.0, 1.0));
  }

 private:
  std::function<Status(double)> report_;
  std::uint64_t begin_ = 0;
  std::uint64_t end_ = 0;
  std::uint64_t count_ = 0;
};

/// The stamp of a sample as a log time.
[[nodiscard]] inline std::uint64_t log_time_of(const Sample& sample) {
  return static_cast<std::uint64_t>(std::max<std::int64_t>(0, stamp_of(sample).time_since_epoch().count()));
}

}  // namespace waymark
