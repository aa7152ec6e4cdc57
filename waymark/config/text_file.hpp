#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark {

/// The bytes of a regular file of at most so many bytes.
[[nodiscard]] Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t max_bytes);

/// Writes the text beside the file and then puts it in its place, so that no reader and no crash finds half
/// of it.
[[nodiscard]] Status write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace waymark
