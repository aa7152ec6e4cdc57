#pragma once

#include <string>

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

}  // namespace waymark
