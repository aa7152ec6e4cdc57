#pragma once

#include <memory>
#include <vector>

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Recordings of any formats as one: samples in the order of their stamps, held in memory. Messages as such
/// are visited file by file. There is at least one part.
[[nodiscard]] std::unique_ptr<MessageLog> merge_logs(std::vector<std::unique_ptr<MessageLog>> parts);

}  // namespace waymark
