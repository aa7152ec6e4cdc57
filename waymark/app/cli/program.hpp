#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

/// Parses the words after the program's name, runs the verb they name, and gives the exit code. Wrong usage
/// is said on `err` with the nearest known word; nothing is thrown.
[[nodiscard]] int run_program(const Verb& program, std::vector<std::string> words, std::FILE* out = stdout,
                              std::FILE* err = stderr);

/// What this program was built from and with, as lines of text: `waymark --version --verbose`.
[[nodiscard]] const char* build_details();

}  // namespace waymark::cli
