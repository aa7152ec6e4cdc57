#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Whether an LCM event begins in these first bytes of a file.
[[nodiscard]] bool looks_like_lcm(ByteSpan head, std::uint64_t size);

/// An LCM event log; messages of the MBot become samples. Opening reads it once: there is no index.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_lcm_log(std::unique_ptr<ByteSource> source,
                                                               const LogOptions& options);

}  // namespace waymark
