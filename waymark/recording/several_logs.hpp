#pragma once

#include <memory>
#include <vector>

#include "waymark/recording/message_log.hpp"

/// Several recordings as one; opened by open_logs() in message_log.hpp.
namespace waymark {

/// Joins consecutive recordings (at least one). Messages that overlap in time are sorted within windows of
/// one second.
[[nodiscard]] std::unique_ptr<MessageLog> join_logs(std::vector<std::unique_ptr<MessageLog>> parts,
                                                    LogProblems problems);

}  // namespace waymark
