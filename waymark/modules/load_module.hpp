#pragma once

#include <string>

#include "waymark/base/error.hpp"

namespace waymark {

/// A library of others that is loaded when it is first needed, and stays: what few people use should not be
/// loaded by every start.
class SharedLibrary {
 public:
  /// `name`: as the loader knows it, "liblcm.so.1".
  explicit SharedLibrary(std::string name);

  /// The function of this name; null where there is none.
  template <class Function>
  void look_up(const char* symbol, Function& function) {
    function = reinterpret_cast<Function>(find(symbol));
  }

  /// What is not there, in words; empty when all was found.
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  void* find(const char* symbol);

  std::string name_;
  void* handle_;
  std::string missing_{};
};

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
