// Any bytes as a file packed with bzip2, gzip or zstd (bombs among them).
#include "log_fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  waymark::open_and_ask({data, size});
  return 0;
}
