#pragma once

// Headers that nearly every verb includes.
// IWYU pragma: begin_exports
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "waymark/app/cli/console.hpp"
#include "waymark/app/cli/flags.hpp"
#include "waymark/app/cli/verb.hpp"
#include "waymark/app/common/report_fields.hpp"
// IWYU pragma: end_exports
