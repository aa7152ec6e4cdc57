#pragma once

#include <functional>
#include <string>

#include "waymark/base/error.hpp"

namespace waymark {

/// A line of standard input, without its end. Fails at the end of the input, and when it is cancelled.
[[nodiscard]] Result<std::string> typed_line(const std::function<bool()>& cancelled);

}  // namespace waymark
