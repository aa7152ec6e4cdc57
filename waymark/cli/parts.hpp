#pragma once

// What nearly every verb is made of.
// IWYU pragma: begin_exports
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/job_flags.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
// IWYU pragma: end_exports
