#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// The bytes of a regular file of at most so many bytes. Fails, and says what it is, on a file that begins as
/// a recording, a picture or a packed file does.
[[nodiscard]] Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes);
/// The same of any content.
[[nodiscard]] Result<std::string> read_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Writes the text beside the file and then puts it in its place, so that no reader and no crash finds half
/// of it.
[[nodiscard]] Status write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace waymark
