#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// Limit for tables and lists, which may be long.
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 30U;

/// Reads a file or a pipe of at most `max_bytes`. Fails, and reports the kind of file, if it begins like a
/// recording, an image or a compressed file, or contains zero bytes. A signal that arrives while waiting for
/// a pipe's writer ends the call with an error.
[[nodiscard]] Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes);
/// Reads a file or a pipe with any content.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Writes a temporary file and renames it, so that readers never see incomplete text, even after a crash.
[[nodiscard]] Status write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace waymark
