#pragma once

#include <string>

#include <nlohmann/json_fwd.hpp>

#include "waymark/samples/calibration.hpp"

/// What `waymark calibrate robot` says of what it found.
namespace waymark::cli {

/// A line a number: its value with doubt, or what to drive to tell it.
[[nodiscard]] std::string values_text(const Calibration& calibration);
/// {"values": {"yaw_gain": {"value": …, "sigma": …, "verdict": "known", "advice": ""}}}.
[[nodiscard]] nlohmann::ordered_json values_json(const Calibration& calibration);
/// A calibration that knows no number is none.
[[nodiscard]] bool tells_nothing(const Calibration& calibration);

}  // namespace waymark::cli
