#pragma once

#include <memory>
#include <optional>

#include "waymark/recording/message_log.hpp"
#include "waymark/recording/unpack.hpp"

namespace waymark {

/// A recording out of a packed file: says so, and what was wrong with the packing.
[[nodiscard]] std::unique_ptr<MessageLog> with_packing(std::unique_ptr<MessageLog> log, Packing packing,
                                                       const std::optional<Error>& damage,
                                                       std::uint64_t packed_bytes);

}  // namespace waymark
