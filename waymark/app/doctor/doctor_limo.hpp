#pragma once

#include <string>
#include <vector>

#include "waymark/app/doctor/doctor.hpp"
#include "waymark/robots/limo/limo_probe.hpp"

namespace waymark {

/// Whether LIMO's port is there and may be opened (group, other programs), and what LIMO says there of its
/// battery, its errors and its drive in a second and a half. Nothing is sent.
[[nodiscard]] std::vector<DoctorLine> check_limo(const std::string& port, const DoctorCancelled& cancelled);

/// The lines of what was heard.
[[nodiscard]] std::vector<DoctorLine> check_limo(const std::string& port, const LimoHeard& heard);

}  // namespace waymark
