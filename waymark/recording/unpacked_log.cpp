#include "waymark/recording/unpacked_log.hpp"

#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

class UnpackedLog final : public MessageLog {
 public:
  UnpackedLog(std::unique_ptr<MessageLog> log, Packing packing, std::optional<Error> damage,
              std::uint64_t packed_bytes)
      : log_(std::move(log)), packing_(packing), damage_(std::move(damage)), packed_bytes_(packed_bytes) {}

  LogFormat format() const override { return log_->format(); }
  std::string description() const override {
    return fmt::format("{}, {} around the file", log_->description(), to_string(packing_));
  }
  const std::vector<LogChannel>& channels() const override { return log_->channels(); }
  LogSummary summary() const override {
    LogSummary summary = log_->summary();
    summary.size_bytes = packed_bytes_;
    return summary;
  }
  Status visit(const LogSelection& selection, const Visitor& visit) override {
    return log_->visit(selection, visit);
  }
  Status visit_as_written(const Visitor& visit) override { return log_->visit_as_written(visit); }
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override {
    return log_->visit_samples(selection, visit);
  }
  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& choice) override {
    Result<RecordingSetup> setup = log_->setup(choice);
    if (setup && damage_) setup->problems.insert(setup->problems.begin(), *damage_);
    return setup;
  }
  std::vector<LogAttachment> attachments() const override { return log_->attachments(); }
  Status visit_attachments(const std::function<Status(const Attachment&)>& visit) override {
    return log_->visit_attachments(visit);
  }
  std::vector<LogProblem> problems() const override {
    std::vector<LogProblem> all = log_->problems();
    if (damage_) all.insert(all.begin(), {LogProblem::Kind::Damage, "file.packing", *damage_, 1});
    return all;
  }

 private:
  std::unique_ptr<MessageLog> log_;
  Packing packing_;
  std::optional<Error> damage_;
  std::uint64_t packed_bytes_;
};

}  // namespace

std::unique_ptr<MessageLog> with_packing(std::unique_ptr<MessageLog> log, Packing packing,
                                         const std::optional<Error>& damage, std::uint64_t packed_bytes) {
  return std::make_unique<UnpackedLog>(std::move(log), packing, damage, packed_bytes);
}

}  // namespace waymark
