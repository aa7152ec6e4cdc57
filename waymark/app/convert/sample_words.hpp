#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "waymark/samples/robot_samples.hpp"

/// Samples as a person or a program reads them, one a line.
namespace waymark {

/// "odometry", "tags", …: the kinds of `waymark info`.
[[nodiscard]] const char* kind_of(const Sample& sample);

/// "  12.340  odometry   x 1.200 m, y …"; seconds since `start`.
[[nodiscard]] std::string to_text(const Sample& sample, SensorTime start);

/// {"kind": …, "stamp_ns": …, …}; keys carry units. Pictures by their size, not their pixels; what is not a
/// number is null.
[[nodiscard]] nlohmann::ordered_json to_json(const Sample& sample);

}  // namespace waymark
