#include "waymark/robots/gazebo/gazebo_link.hpp"

#include "waymark/modules/load_module.hpp"

namespace waymark {

Result<std::unique_ptr<GazeboLink>> open_gazebo() {
  const auto symbol = load_module({.file = "libwaymark-gazebo.so",
                                   .symbol = kOpenGazeboSymbol,
                                   .purpose = "Gazebo",
                                   .needs = "libignition-transport11-11 and libignition-msgs8-8",
                                   .build = "libignition-transport-dev and libignition-msgs-dev"});
  if (!symbol) return tl::unexpected(symbol.error());
  const auto open = reinterpret_cast<OpenGazeboFunction>(*symbol);
  std::unique_ptr<GazeboLink> link;
  Error error;
  (*open)(link, error);
  if (!link) return tl::unexpected(error);
  return link;
}

}  // namespace waymark
