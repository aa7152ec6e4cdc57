#include "waymark/recording/ros_log.hpp"

#include <algorithm>

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/recording_setup.hpp"
#include "waymark/recording/ros2/messages.hpp"
#include "waymark/recording/ros2/sample_decoder.hpp"

namespace waymark {
namespace {

constexpr std::uint64_t kBeginning_ns = 10'000'000'000;

}  // namespace

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
  // An error from the visitor ends the pass; an error in a message is noted.
  bool stopped = false;
  SampleDecoder decoder([&](const Sample& sample) {
    Status status = visit(sample);
    stopped = !status;
    return status;
  });
  if (selection.odometry_in_transforms && !has_odometry_messages(*this))
    decoder.use_transforms(selection.odometry_frames);
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

Status RosLog::add_facts(const std::set<std::string>& topics, AddFact add, RecordingSetup& setup) {
  Status status;
  if (!topics.empty())
    status = visit_cdr({.topics = topics}, [&](const LogChannel& channel, const LogMessage& message) {
      return add(setup.facts, channel.topic, channel.type, message.data);
    });
  add_problems(setup);
  return status;
}

Status RosLog::add_moving_facts(const std::set<std::string>& topics, AddFact add, const Enough& enough,
                                RecordingSetup& setup) {
  if (topics.empty()) return {};
  bool stopped = false;
  std::optional<std::uint64_t> first;
  Status status = visit_cdr({.topics = topics}, [&](const LogChannel& channel, const LogMessage& message) {
    if (!first) first = message.log_time;
    stopped = enough(message.log_time - *first);
    // Returning an error is the only way to stop a visit.
    if (stopped) return Status(fail(ErrorCode::LimitExceeded, "the first messages are enough"));
    if (Status added = add(setup.facts, channel.topic, channel.type, message.data); !added) {
      Error error = added.error();
      error.place.key = channel.topic;
      note(LogProblem::Kind::Damage, "message.undecodable:" + channel.topic, error);
    }
    return Status{};
  });
  add_problems(setup);
  return stopped ? Status{} : status;
}

void RosLog::add_problems(RecordingSetup& setup) const {
  for (const LogProblem& problem : problems()) {
    const std::string words = to_string(problem.error);
    const bool known =
        std::ranges::any_of(setup.problems, [&](const Error& error) { return to_string(error) == words; });
    if (!known) setup.problems.push_back(problem.error);
  }
}

void RosLog::add_first_facts(RecordingSetup& setup) {
  for (const LogChannel& channel : channels()) {
    if (!first_message_has_facts(channel.type) || channel.messages == std::optional<std::uint64_t>(0))
      continue;
    // Returning an error is the only way to stop a visit.
    (void)visit_cdr({.topics = {channel.topic}},
                    [&](const LogChannel& cdr, const LogMessage& message) -> Status {
                      (void)add_fact(setup.facts, cdr.topic, cdr.type, message.data);
                      return fail(ErrorCode::LimitExceeded, "the first message is enough");
                    });
  }
}

Result<RecordingSetup> RosLog::setup(const CameraChoice& choice) {
  RecordingSetup setup;
  auto blocks = metadata();
  if (!blocks) return tl::unexpected(blocks.error());
  setup.metadata = std::move(*blocks);
  std::set<std::string> fixed;
  std::set<std::string> moving;
  for (const LogChannel& channel : channels()) {
    if (channel.type == ros2::CameraInfo::kType || channel.topic.ends_with("tf_static")) {
      fixed.insert(channel.topic);
    } else if (channel.type.ends_with("/TFMessage")) {
      moving.insert(channel.topic);
    }
  }
  add_first_facts(setup);
  if (Status status = add_facts(fixed, add_fact, setup); !status) return tl::unexpected(status.error());
  // All robots in a recording usually publish from its beginning. One that never moves may not be a robot.
  const auto odometry_is_known = [&](std::uint64_t since_first_ns) {
    return since_first_ns > kBeginning_ns && (choice.quick || all_moved(setup.facts, choice));
  };
  if (!has_odometry_messages(*this))
    if (Status status = add_moving_facts(moving, add_odometry_frames, odometry_is_known, setup); !status)
      return tl::unexpected(status.error());
  choose(setup, choice);
  // Most robots publish all fixed transforms on /tf_static; /tf, which is long, is read only if these are not
  // enough.
  if (setup.base_T_cam || moving.empty()) return setup;
  const auto is_enough = [&](std::uint64_t since_first_ns) {
    return choice.quick && since_first_ns > kBeginning_ns;
  };
  if (Status status = add_moving_facts(moving, add_fact, is_enough, setup); !status)
    return tl::unexpected(status.error());
  choose(setup, choice);
  return setup;
}

}  // namespace waymark
