#pragma once

#include <string>

#include "waymark/base/error.hpp"

namespace waymark {

/// A module of Waymark that is packaged by itself.
struct ModuleName {
  const char* file;     ///< libwaymark-dds.so
  const char* symbol;   ///< the function it exports
  const char* purpose;  ///< "ROS 2"
  const char* needs;    ///< what is installed to run it: "libfastrtps2.9 (Fast DDS)"
  const char* build;    ///< what is installed to build it: "libfastrtps-dev"
};

/// The function that a module exports; loads it beside the program that runs, or from ../lib/waymark. Fails
/// where it is not there, cannot be loaded, or is of another version.
[[nodiscard]] Result<void*> load_module(const ModuleName& module);

}  // namespace waymark
