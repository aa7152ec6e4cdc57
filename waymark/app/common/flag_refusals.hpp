#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "waymark/base/error.hpp"

namespace waymark {

/// Whether a field was given by the user, by its name: "camera_size".
using GivenFlags = std::function<bool(const char* field)>;

/// Fields that have no effect on what is asked, refused one after the other: the first that was given is the
/// error.
class FlagRefusals {
 public:
  explicit FlagRefusals(GivenFlags given) : given_(std::move(given)) {}

  /// These fields, `when` they have none.
  void flags(bool when, std::initializer_list<const char*> names, const std::string& why,
             const std::string& hint) {
    for (const char* name : names)
      if (when && status_ && given_(name))
        status_ = fail(ErrorCode::InvalidArgument, why, {.key = name}, hint);
  }
  [[nodiscard]] const Status& status() const { return status_; }

 protected:
  Status status_{};

 private:
  GivenFlags given_;
};

}  // namespace waymark
