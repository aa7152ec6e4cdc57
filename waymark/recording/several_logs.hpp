#pragma once

#include <memory>
#include <vector>

#include "waymark/recording/message_log.hpp"

/// Several recordings as one; open_logs() of message_log.hpp opens them.
namespace waymark {

/// Recordings that follow each other as one; at least one. Where they overlap in time, messages are put in
/// order a second at a time.
[[nodiscard]] std::unique_ptr<MessageLog> join_logs(std::vector<std::unique_ptr<MessageLog>> parts,
                                                    LogProblems problems);

}  // namespace waymark
