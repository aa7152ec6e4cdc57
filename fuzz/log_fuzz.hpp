#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "waymark/recording/cdr_channels.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Opens any bytes as a recording and queries everything: nothing crashes, no message is larger than allowed,
/// none is outside the selection, and errors have a message.
inline void open_and_ask(ByteSpan bytes) {
  constexpr std::uint64_t kMaxRecordBytes = 1 << 20;
  const LogOptions options{.max_record_bytes = kMaxRecordBytes, .unpack = {.max_bytes = 4 * kMaxRecordBytes}};
  const auto log = open_log(memory_source(bytes, "fuzz"), options);
  if (!log) {
    if (log.error().message.empty()) std::abort();
    return;
  }
  CdrChannels cdr([](LogProblem::Kind, const std::string&, const Error&) {});
  const LogSelection selection{.from = 1};
  const Status visited = (*log)->visit(selection, [&](const LogChannel& channel, const LogMessage& message) {
    if (message.data.size() > kMaxRecordBytes || !selection.takes(message.log_time)) std::abort();
    (void)cdr.convert(channel, message);
    return Status{};
  });
  if (!visited && visited.error().message.empty()) std::abort();
  (void)(*log)->visit_samples({}, [](const Sample& sample) {
    (void)stamp_of(sample);
    return Status{};
  });
  (void)(*log)->setup();
  (void)(*log)->summary();
  for (const LogProblem& problem : (*log)->problems()) {
    if (problem.key.empty() || problem.error.message.empty() || problem.count == 0) std::abort();
  }
}

}  // namespace waymark
