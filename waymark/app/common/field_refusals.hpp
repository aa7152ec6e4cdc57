#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <utility>

#include "waymark/base/error.hpp"

namespace waymark {

/// Whether the user gave the field of this name ("camera_size").
using GivenFields = std::function<bool(const char* field)>;

/// Refuses fields that have no effect in this job. status() is the error of the first such field that the
/// user gave.
class FieldRefusals {
 public:
  explicit FieldRefusals(GivenFields given) : given_(std::move(given)) {}

  /// Refuses `names` if `when` holds; `why` is the message of the error.
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
