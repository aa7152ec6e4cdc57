#pragma once

#include <string>

#include <CLI/App.hpp>

/// What the files are called that verbs write: an ending must not promise another format.
namespace waymark::cli {

/// For CLI11's transform(): the name of a recording to be written. What we write is MCAP: a name without an
/// ending gets .mcap, and one must not promise anything else.
[[nodiscard]] CLI::Validator recording_name();

/// For CLI11's check(): the name of a YAML file to be written ends in .yaml or .yml, or it is a device.
[[nodiscard]] CLI::Validator yaml_name();

}  // namespace waymark::cli
