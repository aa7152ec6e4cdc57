#pragma once

#include "waymark/base/error.hpp"

namespace waymark::internal {

/// What a search ends with when its progress callback asks it to.
inline tl::unexpected<Error> stopped_on_request() {
  return fail(ErrorCode::LimitExceeded, "stopped before the map was finished");
}

}  // namespace waymark::internal
