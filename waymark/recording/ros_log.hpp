#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// What the formats of ROS share: their messages, in CDR or as ROS 1 wrote them, become samples by their
/// type.
class RosLog : public MessageLog {
 public:
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override;
  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& choice) override;

 protected:
  /// The blocks of metadata a file carries, by name.
  virtual Result<std::map<std::string, std::map<std::string, std::string>>> metadata() { return {}; }
  /// Of a message that does not decode: noted, and passed over.
  void note(LogProblem::Kind kind, const std::string& key, const Error& error) {
    visited_.add(kind, key, [&] { return error; });
  }

  LogProblems visited_;  ///< by the last visit

 private:
  Status visit_cdr(const LogSelection& selection, const Visitor& visit);
  /// What all messages of these topics tell of cameras and frames; damage becomes a problem of the setup.
  Status add_facts(const std::set<std::string>& topics, RecordingSetup& setup);
  /// The same of the first message of each.
  void add_first_facts(RecordingSetup& setup);
};

}  // namespace waymark
