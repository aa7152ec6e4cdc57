#pragma once

#include <string>

#include "waymark/base/error.hpp"

namespace waymark {

/// A third-party library that is loaded on first use and never unloaded, so that programs that do not need it
/// can start without it.
class SharedLibrary {
 public:
  /// `name` is the file name passed to the loader, such as "liblcm.so.1".
  explicit SharedLibrary(std::string name);

  /// Sets `function` to the symbol, or to null if the symbol is missing.
  template <class Function>
  void look_up(const char* symbol, Function& function) {
    function = reinterpret_cast<Function>(find(symbol));
  }

  /// A message about a missing library or symbol; empty if all were found.
  [[nodiscard]] const std::string& missing() const { return missing_; }

 private:
  void* find(const char* symbol);

  std::string name_;
  void* handle_;
  std::string missing_{};
};

/// A separately packaged module of Waymark.
struct ModuleName {
  const char* file;     ///< libwaymark-dds.so
  const char* symbol;   ///< the function it exports
  const char* purpose;  ///< "ROS 2"
  const char* needs;    ///< package required at run time: "libfastrtps2.9 (Fast DDS)"
  const char* build;    ///< package required at build time: "libfastrtps-dev"
};

/// Loads a module from the program's folder or from ../lib/waymark and returns the function that it exports.
/// Fails if the module is missing, cannot be loaded, or has a different version.
[[nodiscard]] Result<void*> load_module(const ModuleName& module);

}  // namespace waymark
