#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Base class of the ROS formats. Converts their messages, in CDR or ROS 1 serialisation, to samples by type.
class RosLog : public MessageLog {
 public:
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override;
  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& choice) override;

 protected:
  /// The metadata blocks of a file, by name.
  virtual Result<std::map<std::string, std::map<std::string, std::string>>> metadata() { return {}; }
  /// Notes a message that cannot be decoded; it is skipped.
  void note(LogProblem::Kind kind, const std::string& key, const Error& error) {
    visited_.add(kind, key, [&] { return error; });
  }

  LogProblems visited_;  ///< of the last visit

 private:
  Status visit_cdr(const LogSelection& selection, const Visitor& visit);
  /// Adds cameras and frames from all messages of these topics; damage becomes a problem of the setup.
  Status add_facts(const std::set<std::string>& topics, RecordingSetup& setup);
  /// Adds cameras and frames from the first message of each topic.
  void add_first_facts(RecordingSetup& setup);
};

}  // namespace waymark
