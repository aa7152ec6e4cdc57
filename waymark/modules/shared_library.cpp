#include "waymark/modules/shared_library.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

namespace waymark {

SharedLibrary::SharedLibrary(std::string name)
    : name_(std::move(name)), handle_(::dlopen(name_.c_str(), RTLD_NOW | RTLD_LOCAL)) {
  if (handle_ == nullptr) missing_ = name_ + " cannot be loaded";
}

void* SharedLibrary::find(const char* symbol) {
  if (handle_ == nullptr) return nullptr;
  void* found = ::dlsym(handle_, symbol);
  if (found == nullptr) missing_ = fmt::format("{} has no {}", name_, symbol);
  return found;
}

}  // namespace waymark
