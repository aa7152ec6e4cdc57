#pragma once

#include <functional>
#include <string>

namespace waymark {

/// Called before each iteration of a mapping search: stage, iteration, cost. Returning false ends the search
/// with an error.
using MapProgress = std::function<bool(const std::string& stage, int iteration, double cost)>;

}  // namespace waymark
