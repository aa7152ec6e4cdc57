#pragma once

#ifdef WAYMARK_HAVE_GSTREAMER

#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include "waymark/base/error.hpp"

/// The functions of GStreamer that are used here, looked up when first needed.
namespace waymark::internal {

// clang-format off
#define WAYMARK_GSTREAMER(F)                                                                          \
  F(gst_init_check) F(gst_parse_launch) F(gst_bin_get_by_name) F(gst_element_set_state)               \
  F(gst_element_get_state) F(gst_element_get_base_time) F(gst_element_get_bus) F(gst_element_get_clock) \
  F(gst_clock_get_time) F(gst_bus_pop_filtered) F(gst_message_parse_error) F(gst_object_unref)        \
  F(gst_mini_object_unref) F(gst_sample_get_buffer) F(gst_sample_get_caps) F(gst_buffer_map)          \
  F(gst_buffer_unmap) F(gst_caps_get_structure) F(gst_structure_get_int)
#define WAYMARK_GSTREAMER_APP(F) F(gst_app_sink_try_pull_sample) F(gst_app_sink_is_eos)
#define WAYMARK_GOBJECT(F) F(g_object_set)
#define WAYMARK_GLIB(F) F(g_error_free) F(g_free)
// clang-format on

struct Gstreamer {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_GSTREAMER_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_GSTREAMER(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GSTREAMER_APP(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GOBJECT(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GLIB(WAYMARK_GSTREAMER_MEMBER)
#undef WAYMARK_GSTREAMER_MEMBER
};

/// The libraries, loaded and initialized by the first call and then kept. Unsupported where they are missing:
/// the error says which packages to install. May be called from any thread.
[[nodiscard]] Result<const Gstreamer*> gstreamer();

}  // namespace waymark::internal

#endif
