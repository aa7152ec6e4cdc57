#pragma once

#include <memory>
#include <vector>

#include "waymark/recording/log_problems.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Files of a folder that no metadata.yaml lists need not be parts of one recording. Takes those out that
/// hold nothing but what another one holds (copies, also cut or recovered ones), and says so in `problems`.
/// Fails where two have the same topics at the same time and are no copies: two drives.
[[nodiscard]] Status take_copies_out(std::vector<std::unique_ptr<MessageLog>>& parts, LogProblems& problems);

}  // namespace waymark
