// The only symbol exported by the module libwaymark-dds.so.
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/fastdds/fastdds_bus.hpp"

extern "C" __attribute__((visibility("default"))) void waymark_open_bus(const waymark::BusOptions& options,
                                                                        std::unique_ptr<waymark::Bus>& bus,
                                                                        waymark::Error& error) {
  auto opened = waymark::open_fastdds_bus(options);
  if (opened)
    bus = std::move(*opened);
  else
    error = opened.error();
}
