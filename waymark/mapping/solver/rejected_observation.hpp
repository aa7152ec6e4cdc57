#pragma once

#include "waymark/base/time.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// An observation of a mapped tag that contradicts all others.
struct RejectedObservation {
  SensorTime stamp{};
  TagId tag{};
  double chi2 = 0;  ///< 8 numbers; infinite: the tag cannot be seen from there
};

}  // namespace waymark
