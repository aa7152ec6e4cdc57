#pragma once

#include <string>

#include "waymark/app/convert/recording_info.hpp"

namespace waymark {

/// What `waymark info` prints: head, topics, stamps, metadata, attachments, what can be done next.
[[nodiscard]] std::string to_text(const RecordingInfo& info);

}  // namespace waymark
