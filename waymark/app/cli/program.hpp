#pragma once

#include <cstdio>
#include <string>
#include <vector>

#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {

/// Parses the words after the program's name, runs the verb, and returns the exit code. Incorrect usage is
/// reported on `err` with the most similar valid word. Does not throw.
[[nodiscard]] int run_program(const Verb& program, std::vector<std::string> words, std::FILE* out = stdout,
                              std::FILE* err = stderr);

/// Version, compiler, features and libraries of this build, as lines of text. Printed by `waymark --version
/// --verbose`.
[[nodiscard]] const char* build_details();

}  // namespace waymark::cli
