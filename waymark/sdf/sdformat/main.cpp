// The only symbol exported by the module libwaymark-sdf.so.
#include "waymark/sdf/read_sdf.hpp"
#include "waymark/sdf/sdformat/parse_sdf.hpp"

extern "C" __attribute__((visibility("default"))) void waymark_read_sdf(
    const std::filesystem::path& file, const std::vector<std::filesystem::path>& folders,
    waymark::SdfScene& scene, waymark::Error& error) {
  auto read = waymark::parse_sdf(file, folders);
  if (read)
    scene = std::move(*read);
  else
    error = read.error();
}
