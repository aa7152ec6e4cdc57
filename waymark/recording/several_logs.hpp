#pragma once

#include <memory>
#include <vector>

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Recordings that follow each other as one; at least one. Where they overlap in time, messages are put in
/// order a second at a time.
[[nodiscard]] std::unique_ptr<MessageLog> join_logs(std::vector<std::unique_ptr<MessageLog>> parts,
                                                    LogProblems problems);

/// Recordings of any formats as one: samples in the order of their stamps, held in memory. Messages as such
/// are visited file by file. There is at least one part.
[[nodiscard]] std::unique_ptr<MessageLog> merge_logs(std::vector<std::unique_ptr<MessageLog>> parts);

}  // namespace waymark
