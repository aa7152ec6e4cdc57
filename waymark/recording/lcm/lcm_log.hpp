#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Whether the file begins with an LCM event.
[[nodiscard]] bool looks_like_lcm(ByteSpan head, std::uint64_t size);

/// Opens an LCM event log; MBot messages become samples. Reads the whole file once, because the format has no
/// index.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_lcm_log(std::unique_ptr<ByteSource> source,
                                                               const LogOptions& options);

}  // namespace waymark
