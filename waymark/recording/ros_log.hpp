#pragma once

#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// What the formats of ROS share: their messages, in CDR or as ROS 1 wrote them, become samples by their
/// type.
class RosLog : public MessageLog {
 public:
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override;
  Result<RecordingSetup> setup() override;

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
};

}  // namespace waymark
