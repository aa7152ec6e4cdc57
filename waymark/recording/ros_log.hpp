#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Base class for the ROS formats. Converts their messages, in CDR or ROS 1 serialisation, to samples
/// according to their type.
class RosLog : public MessageLog {
 public:
  Status visit_samples(const LogSelection& selection, const SampleVisitor& visit) override;
  using MessageLog::setup;
  Result<RecordingSetup> setup(const CameraChoice& choice) override;

 protected:
  /// Notes a message that cannot be decoded and is skipped.
  void note(LogProblem::Kind kind, const std::string& key, const Error& error) {
    visited_.add(kind, key, [&] { return error; });
  }

  LogProblems visited_;  ///< problems of the last visit

 private:
  using AddFact = Status (*)(CameraFacts& facts, std::string_view topic, std::string_view type, ByteSpan cdr);

  Status visit_cdr(const LogSelection& selection, const Visitor& visit);
  using Enough = std::function<bool(std::uint64_t since_first_ns)>;
  /// Adds facts from all messages on these topics; damage becomes a problem of the setup.
  Status add_facts(const std::set<std::string>& topics, AddFact add, RecordingSetup& setup);
  /// The same until there are enough. A message that cannot be decoded is noted and skipped.
  Status add_moving_facts(const std::set<std::string>& topics, AddFact add, const Enough& enough,
                          RecordingSetup& setup);
  void add_problems(RecordingSetup& setup) const;
  /// Adds cameras and frames from the first message on each topic.
  void add_first_facts(RecordingSetup& setup);
};

}  // namespace waymark
