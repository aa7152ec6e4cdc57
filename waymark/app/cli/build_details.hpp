#pragma once

namespace waymark::cli {

/// What this program was built from and with, as lines of text: `waymark --version --verbose`.
[[nodiscard]] const char* build_details();

}  // namespace waymark::cli
