#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

/// Parses the words after the program's name, runs their verb, and returns the exit code. Wrong usage is
/// reported on `err` with the nearest valid word; throws nothing.
[[nodiscard]] int run_program(const Verb& program, std::vector<std::string> words, std::FILE* out = stdout,
                              std::FILE* err = stderr);

/// Version, compiler, features and libraries of this build, as lines of text: `waymark --version --verbose`.
[[nodiscard]] const char* build_details();

}  // namespace waymark::cli
