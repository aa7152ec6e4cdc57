#include "waymark/sdf/sdformat/parse_sdf.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <ignition/math/Pose3.hh>
#include <sdf/Box.hh>
#include <sdf/Console.hh>
#include <sdf/Cylinder.hh>
#include <sdf/Geometry.hh>
#include <sdf/Light.hh>
#include <sdf/Link.hh>
#include <sdf/Material.hh>
#include <sdf/Mesh.hh>
#include <sdf/Model.hh>
#include <sdf/ParserConfig.hh>
#include <sdf/Pbr.hh>
#include <sdf/Plane.hh>
#include <sdf/Root.hh>
#include <sdf/Sphere.hh>
#include <sdf/Visual.hh>
#include <sdf/World.hh>

#include "waymark/sdf/sdformat/read_mesh.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

SE3 se3(const ignition::math::Pose3d& pose) {
  const auto& q = pose.Rot();
  return {SO3::from_quaternion(Eigen::Quaterniond(q.W(), q.X(), q.Y(), q.Z()).normalized()),
          Eigen::Vector3d(pose.Pos().X(), pose.Pos().Y(), pose.Pos().Z())};
}

Eigen::Vector3d vec(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

class SceneReader {
 public:
  SceneReader(const std::vector<fs::path>& folders, SdfScene& scene) : folders_(folders), scene_(scene) {}

  void add(const sdf::Model& model, const SE3& world_T_parent, const std::string& parent, bool fixed,
           const char* frame) {
    const std::string name = parent + model.Name();
    const SE3 world_T_model = world_T_parent * resolved(model.SemanticPose(), frame, name);
    fixed = fixed || model.Static();
    scene_.models.push_back({name, world_T_model, fixed});
    for (uint64_t i = 0; i < model.LinkCount(); ++i) add(*model.LinkByIndex(i), world_T_model, name, fixed);
    for (uint64_t i = 0; i < model.ModelCount(); ++i)
      add(*model.ModelByIndex(i), world_T_model, name + "::", fixed, "__model__");
  }

  void add(const sdf::Light& light, const SE3& world_T_parent, const std::string& name) {
    const char* kinds[] = {"?", "point", "spot", "directional"};
    const SE3 pose = world_T_parent * se3(light.RawPose());
    scene_.lights.push_back({name, kinds[std::clamp(static_cast<int>(light.Type()), 0, 3)],
                             pose.translation(), light.Intensity()});
  }

 private:
  void warn(std::string words) { scene_.warnings.push_back(std::move(words)); }

  SE3 resolved(const sdf::SemanticPose& pose, const char* frame, const std::string& name) {
    ignition::math::Pose3d value;
    const sdf::Errors errors = pose.Resolve(value, frame);
    if (!errors.empty()) warn(fmt::format("{}: {}", name, errors.front().Message()));
    const bool finite = value.IsFinite();
    if (!finite) warn(name + ": non-finite pose");
    return errors.empty() && finite ? se3(value) : se3(pose.RawPose());
  }

  void add(const sdf::Link& link, const SE3& world_T_model, const std::string& model, bool fixed) {
    const std::string name = model + "::" + link.Name();
    for (uint64_t i = 0; i < link.VisualCount(); ++i) {
      const sdf::Visual& visual = *link.VisualByIndex(i);
      const std::string full = name + "::" + visual.Name();
      add(visual, world_T_model * resolved(visual.SemanticPose(), "__model__", full), full, fixed);
    }
    for (uint64_t i = 0; i < link.LightCount(); ++i)
      add(*link.LightByIndex(i), world_T_model, name + "::" + link.LightByIndex(i)->Name());
  }

  void add(const sdf::Visual& visual, const SE3& world_T_visual, const std::string& name, bool fixed) {
    SdfVisual seen{.name = name, .world_T_visual = world_T_visual, .fixed = fixed};
    if (visual.Geom() != nullptr) take(*visual.Geom(), seen);
    if (const sdf::Material* material = visual.Material()) take(*material, seen);
    const bool sound = seen.size_m.allFinite() && seen.visual_n_plane.norm() > 1e-6;
    if (sound)
      scene_.visuals.push_back(std::move(seen));
    else
      warn(name + ": skipped: non-finite size");
  }

  void take(const sdf::Geometry& shape, SdfVisual& seen) {
    if (const sdf::Box* box = shape.BoxShape()) {
      seen.shape = SdfShape::Box;
      seen.size_m = vec(box->Size());
    } else if (const sdf::Plane* plane = shape.PlaneShape()) {
      seen.shape = SdfShape::Plane;
      seen.size_m = {plane->Size().X(), plane->Size().Y(), 0};
      seen.visual_n_plane = vec(plane->Normal());
    } else if (const sdf::Cylinder* cylinder = shape.CylinderShape()) {
      seen.shape = SdfShape::Cylinder;
      seen.size_m = {2 * cylinder->Radius(), 2 * cylinder->Radius(), cylinder->Length()};
    } else if (const sdf::Sphere* sphere = shape.SphereShape()) {
      seen.shape = SdfShape::Sphere;
      seen.size_m = Eigen::Vector3d::Constant(2 * sphere->Radius());
    } else if (const sdf::Mesh* mesh = shape.MeshShape()) {
      take(*mesh, seen);
    }
  }

  void take(const sdf::Mesh& mesh, SdfVisual& seen) {
    seen.shape = SdfShape::Mesh;
    const fs::path file = found(mesh.Uri(), mesh.FilePath(), seen.name);
    if (file.empty()) return;
    auto surface = read_mesh(file, vec(mesh.Scale()));
    if (!surface) return warn(to_string(surface.error()));
    seen.size_m = surface->most_m - surface->least_m;
    seen.visual_t_centre = (surface->most_m + surface->least_m) / 2;
    seen.mesh = std::move(surface->triangles);
    seen.texture = surface->texture.string();
  }

  void take(const sdf::Material& material, SdfVisual& seen) {
    const auto& diffuse = material.Diffuse();
    seen.reflectance = std::clamp((diffuse.R() + diffuse.G() + diffuse.B()) / 3.0, 0.0, 1.0);
    const sdf::Pbr* pbr = material.PbrMaterial();
    for (const auto kind : {sdf::PbrWorkflowType::METAL, sdf::PbrWorkflowType::SPECULAR}) {
      const sdf::PbrWorkflow* workflow = pbr == nullptr ? nullptr : pbr->Workflow(kind);
      if (workflow == nullptr || workflow->AlbedoMap().empty()) continue;
      seen.texture = found(workflow->AlbedoMap(), material.FilePath(), seen.name).string();
      return;
    }
    if (!material.ScriptName().empty())
      warn(fmt::format("{}: material scripts are not supported ({})", seen.name, material.ScriptName()));
  }

  /// Searches next to the file that refers to it, then in the folders.
  fs::path found(const std::string& uri, const std::string& named_in, const std::string& visual) {
    std::vector<fs::path> folders = folders_;
    if (!named_in.empty()) folders.insert(folders.begin(), fs::path(named_in).parent_path());
    fs::path file = resolve_uri(uri, folders);
    if (file.empty()) warn(fmt::format("{}: no file found for {}", visual, uri));
    return file;
  }

  const std::vector<fs::path>& folders_;
  SdfScene& scene_;
};

/// Reports where XML is invalid, because SDFormat does not.
Status check_xml(const fs::path& file) {
  tinyxml2::XMLDocument document;
  if (document.LoadFile(file.c_str()) == tinyxml2::XML_SUCCESS) return {};
  return fail(ErrorCode::Unreadable, fmt::format("not valid XML ({})", document.ErrorName()),
              {.source = file.string(), .line = document.ErrorLineNum()}, "Specify an SDF world or model.");
}

tl::unexpected<Error> no_scene(const sdf::Errors& problems, const fs::path& file) {
  Place place{.source = file.string()};
  if (problems.empty()) return fail(ErrorCode::Unreadable, "contains no world and no model", place);
  const sdf::Error& first = problems.front();
  if (first.LineNumber()) place.line = *first.LineNumber();
  if (first.XmlPath()) place.key = *first.XmlPath();
  return fail(ErrorCode::Unreadable, first.Message(), place, "Specify an SDF world or model.");
}

}  // namespace

fs::path resolve_uri(const std::string& uri, const std::vector<fs::path>& folders) {
  std::string_view name = uri;
  for (const std::string_view scheme : {"model://", "file://", "package://"})
    if (name.starts_with(scheme)) name.remove_prefix(scheme.size());
  const fs::path wanted(name);
  std::error_code ignored;
  if (name.empty()) return {};
  if (wanted.is_absolute()) return fs::exists(wanted, ignored) ? wanted : fs::path();
  for (const fs::path& folder : folders)
    if (fs::path found = folder / wanted; fs::exists(found, ignored)) return found;
  return {};
}

Result<SdfScene> parse_sdf(const fs::path& file, const std::vector<fs::path>& folders) {
  if (Status xml = check_xml(file); !xml) return tl::unexpected(xml.error());
  sdf::Console::Instance()->SetQuiet(true);
  console_bridge::noOutputHandler();  // SDFormat tries to read invalid files as URDF and then prints errors
  sdf::ParserConfig config;
  config.SetWarningsPolicy(sdf::EnforcementPolicy::ERR);  // return warnings instead of printing them
  config.SetFindCallback([&](const std::string& uri) { return resolve_uri(uri, folders).string(); });
  sdf::Root root;
  SdfScene scene;
  const sdf::Errors problems = root.Load(file.string(), config);
  for (const sdf::Error& problem : problems) scene.warnings.push_back(problem.Message());
  SceneReader reader(folders, scene);
  if (root.WorldCount() == 0 && root.Model() == nullptr) return no_scene(problems, file);
  if (root.WorldCount() == 0) {
    scene.name = root.Model()->Name();
    reader.add(*root.Model(), SE3(), "", false, "");
    return scene;
  }
  const sdf::World& world = *root.WorldByIndex(0);
  scene.name = world.Name();
  for (uint64_t i = 0; i < world.ModelCount(); ++i)
    reader.add(*world.ModelByIndex(i), SE3(), "", false, "world");
  for (uint64_t i = 0; i < world.LightCount(); ++i)
    reader.add(*world.LightByIndex(i), SE3(), world.LightByIndex(i)->Name());
  return scene;
}

}  // namespace waymark
