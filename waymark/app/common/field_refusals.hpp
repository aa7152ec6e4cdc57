#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "waymark/base/error.hpp"

namespace waymark {

/// Whether the user set the field with this name (such as "camera_size").
using GivenFields = std::function<bool(const char* field)>;

/// Refuses fields that have no effect in this job. status() returns the error for the first such field that
/// the user set.
class FieldRefusals {
 public:
  explicit FieldRefusals(GivenFields given) : given_(std::move(given)) {}

  /// Refuses the fields `names` if `when` is true; `why` is the error message.
  void fields(bool when, std::initializer_list<const char*> names, const std::string& why,
              const std::string& hint) {
    for (const char* name : names)
      if (when && status_ && given_(name))
        status_ = fail(ErrorCode::InvalidArgument, why, {.key = name}, hint);
  }
  [[nodiscard]] const Status& status() const { return status_; }

 protected:
  Status status_{};

 private:
  GivenFields given_;
};

}  // namespace waymark
