#pragma once

#include <string>
#include <string_view>

#include "waymark/base/error.hpp"

namespace waymark::testing {

/// Compares a text with its entry on the golden page tests/pages/PAGE.txt. Tests assert codes, places, fields
/// and values; the texts of errors, warnings and reports are on the pages, where a change is reviewed as
/// prose. The entry is named after the test, with a number from the second call on. Numbers and temporary
/// paths are masked, so that only words are compared.
///
/// `tools/update_pages.py` regenerates all pages.
void expect_on_page(std::string_view page, std::string_view text);
/// The error as the program prints it: message, place and hint.
void expect_on_page(std::string_view page, const Error& error);

/// The text with "#" for each number ("0.25 m" becomes "# m"; "tag36h11" is unchanged), "FOLDER" for
/// temporary paths and "PROJECT" for the folder of the project.
[[nodiscard]] std::string masked(std::string_view text);

}  // namespace waymark::testing
