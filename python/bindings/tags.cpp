#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/detector.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
#include "python/bindings/rooms.hpp"
#include "waymark/tags/make_detector.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark::python {
namespace {

std::unique_ptr<PythonDetector> make(const py::kwargs& given) {
  py::dict rest = given.attr("copy")();
  const py::object refine = take(rest, "refine");
  const py::object refinement = take(rest, "refinement");
  const auto options = options_of<DetectorOptions>(rest);
  RefinementOptions refining;
  if (!refinement.is_none()) {
    if (!PyDict_Check(refinement.ptr())) refuse("refinement", "the refinement options are not a dictionary");
    update_options(refining, refinement);
  }
  auto made = std::make_unique<PythonDetector>();
  {
    const py::gil_scoped_release release;
    auto detector = make_detector(options);
    if (detector) {
      auto finder = make_tag_finder(std::move(*detector), refining);
      if (!finder) throw Raised(finder.error());
      made->finder = std::move(*finder);
    } else {
      throw Raised(detector.error());
    }
  }
  if (!refine.is_none() && PyObject_IsTrue(refine.ptr()) == 0) made->finder.refinement.reset();
  made->keywords = py::dict(given);
  return made;
}

std::vector<TagDetection> detect(const PythonDetector& self, const py::object& image,
                                 const CameraModel* camera) {
  const ImageView view = image_view(image);
  if (camera != nullptr && (view.width != camera->width_px() || view.height != camera->height_px()))
    refuse("camera",
           fmt::format("the camera has {} x {} pixels, but the image has {} x {}", camera->width_px(),
                       camera->height_px(), view.width, view.height),
           "Pass a calibration for this image size.");
  Result<FoundTags> found;
  {
    const py::gil_scoped_release release;
    found = find_tags(view, self.finder, camera != nullptr ? ImageLens::of(*camera) : ImageLens::unknown());
  }
  return value_of(std::move(found)).detections;
}

py::object rebuild(const PythonDetector& self) {
  return py::make_tuple(py::module_::import("waymark._same").attr("rebuild"),
                        py::make_tuple(py::type::of<PythonDetector>(), self.keywords));
}

}  // namespace

void bind_tags(py::module_& m) {
  m.doc() = "Detection of tags in grey images and refinement of their corners.";
  const std::string help =
      "A detector with options by keyword:\n\n" + options_help<DetectorOptions>() +
      "  refine: Refine the corners to a fraction of a pixel, with their covariance. [true]\n"
      "  refinement: A dictionary of refinement options:\n" +
      options_help<RefinementOptions>(4);
  py::class_<PythonDetector> cls(m, "Detector",
                                 "Detects tags in images. A detector can be shared between threads; the GIL "
                                 "is released during detection.");
  cls.def(py::init(&make), help.c_str());
  cls.def("detect", &detect, py::arg("image"), py::arg("camera") = static_cast<const CameraModel*>(nullptr),
          "Detects tags in a grey image (height, width) of uint8 without copying it; rows may be padded. "
          "With `camera`, edges are fitted with its lens distortion. Returns a list of TagDetection, sorted "
          "by id and position.");
  cls.def("__reduce__", &rebuild);
}

}  // namespace waymark::python
