#include "waymark/drivers/dds/open_bus.hpp"

#include <filesystem>

#include <dlfcn.h>

#include "waymark/drivers/dds/ros_environment.hpp"

namespace waymark {
namespace {

constexpr const char* kModule = "libwaymark-dds.so";

Result<OpenBusFunction> load_module() {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path folder = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const fs::path& place : {folder / kModule, folder / ".." / WAYMARK_LIBDIR / "waymark" / kModule}) {
    if (!fs::exists(place, ignored)) continue;
    void* module = dlopen(place.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (module == nullptr)
      return fail(ErrorCode::Unsupported, std::string("the module for ROS 2 cannot be loaded: ") + dlerror(),
                  {.source = place.string()}, "Install libfastrtps2.9 (Fast DDS), or build Waymark again.");
    void* symbol = dlsym(module, kOpenBusSymbol);
    if (symbol == nullptr)
      return fail(ErrorCode::Unsupported, "this module is of another version", {.source = place.string()},
                  "Install Waymark again.");
    return reinterpret_cast<OpenBusFunction>(symbol);
  }
  return fail(ErrorCode::NotFound, "this installation has no module for ROS 2", {.source = folder / kModule},
              "Install libfastrtps-dev and build Waymark again.");
}

}  // namespace

Result<std::unique_ptr<Bus>> open_bus(const BusOptions& options) {
  const Result<OpenBusFunction> open = load_module();
  if (!open) return tl::unexpected(open.error());
  std::unique_ptr<Bus> bus;
  Error error;
  (*open)(options, bus, error);
  if (!bus) return tl::unexpected(error);
  return bus;
}

Result<std::unique_ptr<Bus>> open_bus() {
  BusOptions options;
  if (Status status = apply_ros_environment(options, process_environment()); !status)
    return tl::unexpected(status.error());
  return open_bus(options);
}

}  // namespace waymark
