#include "waymark/recording/ros_log.hpp"

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/ros2_messages.hpp"

namespace waymark {

Status RosLog::visit_cdr(const LogSelection& selection, const Visitor& visit) {
  CdrChannels channels(
      [this](LogProblem::Kind kind, const std::string& key, const Error& error) { note(kind, key, error); });
  return this->visit(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    const std::optional<CdrChannels::Message> cdr = channels.convert(channel, message);
    if (!cdr || !cdr->channel->known_layout) return {};
    return visit(cdr->channel->channel, {message.log_time, message.publish_time, cdr->data});
  });
}

Status RosLog::visit_samples(const LogSelection& selection, const SampleVisitor& visit) {
  // An error of the visitor ends the pass; one of a message is noted.
  bool stopped = false;
  SampleDecoder decoder([&](const Sample& sample) {
    Status status = visit(sample);
    stopped = !status;
    return status;
  });
  Status status = visit_cdr(selection, [&](const LogChannel& channel, const LogMessage& message) -> Status {
    Status done = decoder.add(channel.topic, channel.type, message.log_time, message.data);
    if (done || stopped) return done;
    Error error = done.error();
    error.place.key = channel.topic;
    note(LogProblem::Kind::Damage, "message.undecodable:" + channel.topic, error);
    return {};
  });
  return status ? decoder.finish() : status;
}

Result<RecordingSetup> RosLog::setup() {
  RecordingSetup setup;
  auto blocks = metadata();
  if (!blocks) return tl::unexpected(blocks.error());
  setup.metadata = std::move(*blocks);
  LogSelection selection;
  for (const LogChannel& channel : channels()) {
    const bool tells = channel.type == ros2::CameraInfo::kType || channel.topic.ends_with("tf_static");
    if (tells) selection.topics.insert(channel.topic);
  }
  if (!selection.topics.empty()) {
    Status status = visit_cdr(selection, [&](const LogChannel& channel, const LogMessage& message) {
      return add_to_setup(setup, channel.type, message.data);
    });
    if (!status) return tl::unexpected(status.error());
  }
  for (const LogProblem& problem : problems()) setup.problems.push_back(problem.error);
  return setup;
}

}  // namespace waymark
