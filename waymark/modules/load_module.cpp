#include "waymark/modules/load_module.hpp"

#include <filesystem>

#include <dlfcn.h>

#include <fmt/format.h>

namespace waymark {

SharedLibrary::SharedLibrary(std::string name)
    : name_(std::move(name)), handle_(::dlopen(name_.c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (handle_ == nullptr) missing_ = "cannot load " + name_;
}

void* SharedLibrary::find(const char* symbol) {
  if (handle_ == nullptr) return nullptr;
  void* found = ::dlsym(handle_, symbol);
  if (found == nullptr) missing_ = fmt::format("{} has no {}", name_, symbol);
  return found;
}

Result<void*> load_module(const ModuleName& module) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const fs::path& place :
       {folder / module.file, folder / ".." / WAYMARK_LIBDIR / "waymark" / module.file}) {
    if (!fs::exists(place, ignored)) continue;
    void* loaded = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (loaded == nullptr)
      return fail(ErrorCode::Unsupported,
                  fmt::format("cannot load the module for {}: {}", module.purpose, dlerror()),
                  {.source = place.string()}, fmt::format("Install {}, or rebuild Waymark.", module.needs));
    void* symbol = dlsym(loaded, module.symbol);
    if (symbol == nullptr)
      return fail(ErrorCode::Unsupported, "the module has a different version", {.source = place.string()},
                  "Reinstall Waymark.");
    return symbol;
  }
  return fail(ErrorCode::NotFound, fmt::format("this installation has no module for {}", module.purpose),
              {.source = (folder / module.file).string()},
              fmt::format("Install {} and rebuild Waymark.", module.build));
}

}  // namespace waymark
