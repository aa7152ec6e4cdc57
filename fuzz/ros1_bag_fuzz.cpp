// Any bytes behind the magic of a ROS 1 bag.
#include "log_fuzz.hpp"
#include "waymark/recording/ros1/bag_log.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  waymark::Bytes bag;
  waymark::append(bag, waymark::as_bytes(waymark::ros1bag::kMagic));
  waymark::append(bag, {data, size});
  waymark::open_and_ask(bag);
  return 0;
}
