#pragma once

#ifdef WAYMARK_HAVE_LCM

#include <lcm/lcm.h>

#include "waymark/base/error.hpp"

namespace waymark::internal {

// clang-format off
#define WAYMARK_LCM(F)                                                                   \
  F(lcm_create) F(lcm_destroy) F(lcm_subscribe) F(lcm_subscription_set_queue_capacity)   \
  F(lcm_publish) F(lcm_handle_timeout)
// clang-format on

/// The functions of liblcm that are used here, looked up when first needed.
struct Liblcm {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_LCM_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_LCM(WAYMARK_LCM_MEMBER)
#undef WAYMARK_LCM_MEMBER
};

/// The library, loaded by the first call and then kept. Unsupported where it is missing: the error names the
/// package. May be called from any thread.
[[nodiscard]] Result<const Liblcm*> liblcm();

}  // namespace waymark::internal

#endif
