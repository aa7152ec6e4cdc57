#include "waymark/cameras/gstreamer/gstreamer_camera.hpp"

#ifdef WAYMARK_HAVE_GSTREAMER

#include <algorithm>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <gst/app/gstappsink.h>
#include <gst/gst.h>

#include "waymark/modules/load_module.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace internal {

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

/// The GStreamer functions used here, looked up on first use.
struct Gstreamer {
// NOLINTNEXTLINE(bugprone-macro-parentheses): a declaration
#define WAYMARK_GSTREAMER_MEMBER(name) decltype(&::name) name = nullptr;
  WAYMARK_GSTREAMER(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GSTREAMER_APP(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GOBJECT(WAYMARK_GSTREAMER_MEMBER)
  WAYMARK_GLIB(WAYMARK_GSTREAMER_MEMBER)
#undef WAYMARK_GSTREAMER_MEMBER
};

}  // namespace internal

namespace {

using internal::Gstreamer;

constexpr const char* kPackages = "gstreamer1.0-plugins-base gstreamer1.0-plugins-good";

tl::unexpected<Error> missing(const std::string& what) {
  return fail(ErrorCode::Unsupported, "gstreamer: cameras require GStreamer: " + what, {},
              std::string("Install it: sudo apt install ") + kPackages);
}

Result<Gstreamer> load() {
  SharedLibrary core("libgstreamer-1.0.so.0");
  SharedLibrary app("libgstapp-1.0.so.0");
  SharedLibrary gobject("libgobject-2.0.so.0");
  SharedLibrary glib("libglib-2.0.so.0");
  Gstreamer gst;
#define WAYMARK_GSTREAMER_CORE(name) core.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_SINK(name) app.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_OBJECT(name) gobject.look_up(#name, gst.name);
#define WAYMARK_GSTREAMER_GLIB(name) glib.look_up(#name, gst.name);
  WAYMARK_GSTREAMER(WAYMARK_GSTREAMER_CORE)
  WAYMARK_GSTREAMER_APP(WAYMARK_GSTREAMER_SINK)
  WAYMARK_GOBJECT(WAYMARK_GSTREAMER_OBJECT)
  WAYMARK_GLIB(WAYMARK_GSTREAMER_GLIB)
#undef WAYMARK_GSTREAMER_CORE
#undef WAYMARK_GSTREAMER_SINK
#undef WAYMARK_GSTREAMER_OBJECT
#undef WAYMARK_GSTREAMER_GLIB
  for (const SharedLibrary* library : {&core, &app, &gobject, &glib})
    if (!library->missing().empty()) return missing(library->missing());
  GError* error = nullptr;
  if (gst.gst_init_check(nullptr, nullptr, &error) == 0) {
    const std::string message = error != nullptr ? error->message : "initialization failed";
    if (error != nullptr) gst.g_error_free(error);
    return missing(message);
  }
  return gst;
}

/// The libraries, which the first call loads and initializes and which stay loaded. Fails (Unsupported) if
/// they are missing; the hint names the packages. Thread-safe.
Result<const Gstreamer*> gstreamer() {
  static const Result<Gstreamer> loaded = load();
  if (!loaded) return tl::unexpected(loaded.error());
  return &*loaded;
}

// videoconvert converts any format to grey; grey images and luma planes are merely copied.
constexpr const char* kTail =
    " ! videoconvert ! video/x-raw,format=GRAY8 ! appsink name=waymark max-buffers=1 drop=true";
constexpr Duration kStart = std::chrono::seconds(10);
constexpr Duration kPoll = std::chrono::milliseconds(100);  // interval between checks for an error

/// GStreamer pads rows to a multiple of four bytes.
constexpr int stride_of(int width) { return (width + 3) / 4 * 4; }

}  // namespace

struct GstreamerCamera::Impl {
  Impl(const Gstreamer& with, std::string text, std::string camera)
      : gst(with), pipeline_text(std::move(text)), name(std::move(camera)) {}
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (waiting != nullptr) gst.gst_mini_object_unref(GST_MINI_OBJECT_CAST(waiting));
    if (pipeline != nullptr) gst.gst_element_set_state(pipeline, GST_STATE_NULL);
    for (void* object : {static_cast<void*>(sink), static_cast<void*>(bus), static_cast<void*>(pipeline)})
      if (object != nullptr) gst.gst_object_unref(object);
  }

  [[nodiscard]] Status launch();
  [[nodiscard]] Status start();
  /// The pending error of the pipeline, with GStreamer's message.
  [[nodiscard]] std::optional<Error> failed() const;
  bool pull(Duration timeout);
  [[nodiscard]] Result<CameraFrame> convert();
  [[nodiscard]] Duration stamp_of(const GstBuffer& buffer) const;

  const Gstreamer& gst;
  std::string pipeline_text;
  std::string name;
  GstElement* pipeline = nullptr;
  GstAppSink* sink = nullptr;
  GstBus* bus = nullptr;
  GstSample* waiting = nullptr;
  CameraCounts tally{};
  bool at_end = false;
  Duration last{};
  std::string about{};
};

Status GstreamerCamera::Impl::launch() {
  GError* error = nullptr;
  pipeline = gst.gst_parse_launch((pipeline_text + kTail).c_str(), &error);
  if (error != nullptr) {
    const std::string message = error->message;
    gst.g_error_free(error);
    return fail(ErrorCode::InvalidArgument, "invalid pipeline: " + message,
                {.key = "gstreamer:" + pipeline_text}, "Test it with gst-launch-1.0 and a sink at its end.");
  }
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-cstyle-cast): the casts of the library are macros
  sink =
      reinterpret_cast<GstAppSink*>(gst.gst_bin_get_by_name(reinterpret_cast<GstBin*>(pipeline), "waymark"));
  bus = gst.gst_element_get_bus(pipeline);
  return {};
}

/// A live source starts immediately (no preroll), and its images are not delayed; a file is played in real
/// time.
Status GstreamerCamera::Impl::start() {
  const GstStateChangeReturn began = gst.gst_element_set_state(pipeline, GST_STATE_PLAYING);
  const bool live = began == GST_STATE_CHANGE_NO_PREROLL;
  GstState state = GST_STATE_NULL;
  const auto reached =
      began == GST_STATE_CHANGE_FAILURE
          ? began
          : gst.gst_element_get_state(pipeline, &state, nullptr, static_cast<GstClockTime>(kStart.count()));
  if (reached == GST_STATE_CHANGE_FAILURE || reached == GST_STATE_CHANGE_ASYNC) {
    auto why = failed();
    return tl::unexpected(why ? *why
                              : Error{ErrorCode::Unreadable,
                                      "the pipeline does not start",
                                      {.source = "gstreamer:" + pipeline_text},
                                      "Test it with gst-launch-1.0."});
  }
  if (live || reached == GST_STATE_CHANGE_NO_PREROLL) gst.g_object_set(sink, "sync", FALSE, nullptr);
  return {};
}

std::optional<Error> GstreamerCamera::Impl::failed() const {
  GstMessage* message = gst.gst_bus_pop_filtered(bus, GST_MESSAGE_ERROR);
  if (message == nullptr) return std::nullopt;
  GError* error = nullptr;
  gchar* detail = nullptr;
  gst.gst_message_parse_error(message, &error, &detail);
  // The last line contains the reason; the lines before it are locations in the library's source code.
  const std::string lines = detail != nullptr ? detail : "";
  const std::string last_line = lines.substr(lines.rfind('\n') + 1);
  Error failure{ErrorCode::Unreadable,
                error != nullptr ? fmt::format("{} {}", error->message, last_line) : "the pipeline failed",
                {.source = "gstreamer:" + pipeline_text},
                "Test it with gst-launch-1.0."};
  if (error != nullptr) gst.g_error_free(error);
  gst.g_free(detail);
  gst.gst_mini_object_unref(GST_MINI_OBJECT_CAST(message));
  return failure;
}

bool GstreamerCamera::Impl::pull(Duration timeout) {
  if (waiting == nullptr)
    waiting = gst.gst_app_sink_try_pull_sample(
        sink, static_cast<GstClockTime>(std::max(timeout, Duration(0)).count()));
  return waiting != nullptr;
}

/// The stamp on the steady clock; on some systems the pipeline's clock has a different origin.
Duration GstreamerCamera::Impl::stamp_of(const GstBuffer& buffer) const {
  const Duration now = steady_now();
  GstClock* clock = gst.gst_element_get_clock(pipeline);
  if (clock == nullptr || !GST_CLOCK_TIME_IS_VALID(buffer.pts)) return now;
  const auto clock_now = static_cast<std::int64_t>(gst.gst_clock_get_time(clock));
  gst.gst_object_unref(clock);
  const auto base = static_cast<std::int64_t>(gst.gst_element_get_base_time(pipeline));
  const Duration age(clock_now - base - static_cast<std::int64_t>(buffer.pts));
  return now - std::max(age, Duration(0));
}

Result<CameraFrame> GstreamerCamera::Impl::convert() {
  GstSample* sample = std::exchange(waiting, nullptr);
  GstBuffer* buffer = gst.gst_sample_get_buffer(sample);
  const GstCaps* caps = gst.gst_sample_get_caps(sample);
  int width = 0;
  int height = 0;
  GstMapInfo map{};
  Result<CameraFrame> frame = fail(ErrorCode::Unreadable, "an image without a size");
  if (caps != nullptr && buffer != nullptr) {
    const GstStructure* structure = gst.gst_caps_get_structure(caps, 0);
    (void)gst.gst_structure_get_int(structure, "width", &width);
    (void)gst.gst_structure_get_int(structure, "height", &height);
  }
  if (width > 0 && height > 0 && gst.gst_buffer_map(buffer, &map, GST_MAP_READ) != 0) {
    if (map.size >= static_cast<std::size_t>(stride_of(width)) * static_cast<std::size_t>(height)) {
      last = std::max(stamp_of(*buffer), last + Duration(1));
      CameraFrame made{.stamp = SensorTime(last), .camera = name, .image = Image(width, height)};
      for (int y = 0; y < height; ++y)
        std::memcpy(made.image.row(y), map.data + static_cast<std::ptrdiff_t>(y) * stride_of(width),
                    static_cast<std::size_t>(width));
      frame = std::move(made);
    }
    gst.gst_buffer_unmap(buffer, &map);
  }
  gst.gst_mini_object_unref(GST_MINI_OBJECT_CAST(sample));
  if (frame) about = fmt::format("{}, {} x {} px", pipeline_text, width, height);
  ++(frame ? tally.delivered : tally.damaged);
  return frame;
}

GstreamerCamera::GstreamerCamera(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GstreamerCamera::~GstreamerCamera() = default;

Result<std::unique_ptr<GstreamerCamera>> GstreamerCamera::open(const std::string& pipeline,
                                                               const std::string& name) {
  const auto gst = gstreamer();
  if (!gst) return tl::unexpected(gst.error());
  auto impl = std::make_unique<Impl>(**gst, pipeline, name);
  impl->about = pipeline;
  Status status = impl->launch();
  if (status) status = impl->start();
  if (!status) return tl::unexpected(status.error());
  return std::unique_ptr<GstreamerCamera>(new GstreamerCamera(std::move(impl)));
}

Result<std::optional<RobotEvent>> GstreamerCamera::next(Duration timeout) {
  const Duration deadline = steady_now() + timeout;
  while (true) {
    const Duration left = deadline - steady_now();
    if (impl_->pull(std::min(left, kPoll))) {
      auto frame = impl_->convert();
      if (frame) return std::optional<RobotEvent>(Sample(std::move(*frame)));
    }
    if (const auto why = impl_->failed()) return tl::unexpected(*why);
    if (impl_->gst.gst_app_sink_is_eos(impl_->sink) != 0 && !std::exchange(impl_->at_end, true))
      return std::optional<RobotEvent>(RobotText{"the pipeline has ended"});
    if (left <= Duration(0)) return std::optional<RobotEvent>();
  }
}

bool GstreamerCamera::more() const { return impl_->pull(Duration(0)); }

std::optional<SensorTime> GstreamerCamera::now() const {
  return impl_->last == Duration(0) ? std::nullopt : std::optional(SensorTime(steady_now()));
}

CameraCounts GstreamerCamera::counts() const { return impl_->tally; }
bool GstreamerCamera::ended() const { return impl_->at_end; }
std::string GstreamerCamera::description() const { return impl_->about; }

}  // namespace waymark

#else

namespace waymark {

struct GstreamerCamera::Impl {};
GstreamerCamera::GstreamerCamera(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
GstreamerCamera::~GstreamerCamera() = default;

Result<std::unique_ptr<GstreamerCamera>> GstreamerCamera::open(const std::string& pipeline,
                                                               const std::string& /*name*/) {
  return fail(ErrorCode::Unsupported, "this program was built without GStreamer",
              {.source = "gstreamer:" + pipeline},
              "Install libgstreamer1.0-dev and libgstreamer-plugins-base1.0-dev and rebuild.");
}
Result<std::optional<RobotEvent>> GstreamerCamera::next(Duration /*most*/) {
  return std::optional<RobotEvent>();
}
bool GstreamerCamera::more() const { return false; }
std::optional<SensorTime> GstreamerCamera::now() const { return std::nullopt; }
CameraCounts GstreamerCamera::counts() const { return {}; }
bool GstreamerCamera::ended() const { return true; }
std::string GstreamerCamera::description() const { return {}; }

}  // namespace waymark

#endif
