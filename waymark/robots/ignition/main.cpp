// The only symbol exported by the module libwaymark-gazebo.so.
#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/robots/ignition/ignition_link.hpp"

extern "C" __attribute__((visibility("default"))) void waymark_open_gazebo(
    std::unique_ptr<waymark::GazeboLink>& link, waymark::Error& error) {
  auto opened = waymark::open_ignition_link();
  if (opened)
    link = std::move(*opened);
  else
    error = opened.error();
}
