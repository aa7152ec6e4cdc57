#include "waymark/sdf/sdf_text.hpp"

#include <fmt/format.h>

#include "waymark/plot/text.hpp"

namespace waymark::sdf_text {

std::string pose(const SE3& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Vector3d rpy = pose.rotation().rpy();
  return fmt::format("<pose>{:.6f} {:.6f} {:.6f} {:.9f} {:.9f} {:.9f}</pose>", t.x(), t.y(), t.z(), rpy.x(),
                     rpy.y(), rpy.z());
}

std::string box(const Eigen::Vector3d& size_m) {
  return fmt::format("<geometry><box><size>{:.6f} {:.6f} {:.6f}</size></box></geometry>", size_m.x(),
                     size_m.y(), size_m.z());
}

std::string grey(double reflectance) {
  return fmt::format(
      "<material><ambient>{0:.3f} {0:.3f} {0:.3f} 1</ambient><diffuse>{0:.3f} {0:.3f} {0:.3f} 1</diffuse>"
      "<specular>0 0 0 1</specular></material>",
      reflectance);
}

std::string solid(std::string_view name, const SE3& link_T_solid, std::string_view geometry,
                  double reflectance) {
  const std::string where = pose(link_T_solid);
  return fmt::format(
      "        <collision name='{0}'>{1}{2}</collision>\n"
      "        <visual name='{0}'>{1}{2}{3}</visual>\n",
      plot::escaped(name), where, geometry, grey(reflectance));
}

std::string fixed_model(std::string_view name, const SE3& world_T_model, std::string_view content) {
  return fmt::format(
      "    <model name='{}'>\n      <static>true</static>{}\n      <link name='link'>\n{}      </link>\n"
      "    </model>\n",
      plot::escaped(name), pose(world_T_model), content);
}

}  // namespace waymark::sdf_text
