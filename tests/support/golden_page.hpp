#pragma once

#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark::testing {

/// Compares a text with its entry on the golden page tests/pages/PAGE.txt. Tests assert codes, places, fields
/// and values; the words of errors, warnings and reports are on the pages, where a change is read as prose.
/// The entry is named after the test, with a number from the second call on. Numbers and the path of the
/// temporary folder are masked, so that only words count.
///
/// `tools/update_pages.py` writes all pages again.
void expect_on_page(std::string_view page, std::string_view text);
/// The error as the program prints it: message, place and hint.
void expect_on_page(std::string_view page, const Error& error);

/// The text with each number as "#" ("0.25 m" is "# m"; "tag36h11" stays) temporary paths as "FOLDER",
/// the folder of the project as "PROJECT".
[[nodiscard]] std::string masked(std::string_view text);

}  // namespace waymark::testing
