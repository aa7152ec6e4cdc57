#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// Of tables and lists, which may be long.
inline constexpr std::size_t kMaxTextBytes = std::size_t{1} << 30U;

/// The bytes of a file or a pipe of at most so many bytes. Fails, and says what it is, on a file that begins
/// as a recording, a picture or a packed file does, or holds zero bytes. A signal ends the wait for a pipe
/// that nobody writes to, as an error.
[[nodiscard]] Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes);
/// The same of any content.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Writes the text beside the file and then puts it in its place, so that no reader and no crash finds half
/// of it.
[[nodiscard]] Status write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace waymark
