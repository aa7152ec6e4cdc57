#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Whether the first bytes of a file are text whose first line names columns.
[[nodiscard]] bool looks_like_csv(ByteSpan head);

/// A table with named columns. Opening reads it once: there is no index.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_csv_log(std::unique_ptr<ByteSource> source,
                                                               const LogOptions& options);

}  // namespace waymark
