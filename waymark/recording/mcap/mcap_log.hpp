#pragma once

#include "waymark/recording/message_log.hpp"

namespace waymark {

/// Opens an MCAP file from any writer.
[[nodiscard]] Result<std::unique_ptr<MessageLog>> open_mcap_log(std::unique_ptr<ByteSource> source,
                                                                const LogOptions& options);

}  // namespace waymark
