#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "waymark/base/error.hpp"

namespace waymark {

/// {"code": …, "message": …} and, where known, "source", "line", "byte", "key", "hint".
[[nodiscard]] nlohmann::ordered_json to_json(const Error& error);

/// One line of JSON with its end of line; bytes that are not UTF-8 (file names) become U+FFFD.
[[nodiscard]] std::string json_line(const nlohmann::ordered_json& value);

}  // namespace waymark
