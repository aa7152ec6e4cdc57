#include "python/bindings/arrays.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "python/bindings/errors.hpp"

namespace waymark::python {
namespace {

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text;
  for (const py::ssize_t length : shape)
    text += (text.empty() ? "" : ", ") + (length < 0 ? std::string("n") : std::to_string(length));
  return "(" + text + (shape.size() == 1 ? ",)" : ")");
}

std::vector<py::ssize_t> shape_of(const py::array& array) {
  return {array.shape(), array.shape() + array.ndim()};
}

bool fits(const std::vector<py::ssize_t>& shape, const std::vector<py::ssize_t>& wanted) {
  if (shape.size() != wanted.size()) return false;
  for (std::size_t i = 0; i < shape.size(); ++i)
    if (wanted[i] >= 0 && shape[i] != wanted[i]) return false;
  return true;
}

std::string type_text(const py::handle& value) {
  return py::str(py::type::handle_of(value).attr("__name__"));
}

/// Converts any array of real numbers; refuses values that NumPy cannot convert to one.
py::array real_array(const py::handle& value, const char* name) {
  const py::array array = py::array::ensure(value);
  if (!array) {
    PyErr_Clear();
    refuse(name, fmt::format("{} is not an array of numbers", with_article(type_text(value))),
           "Pass a NumPy array of float64.");
  }
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u')
    refuse(name, fmt::format("values of dtype {} are not real numbers", std::string(py::str(array.dtype()))),
           "Pass a NumPy array of float64.");
  return array;
}

}  // namespace

Doubles doubles(const py::handle& value, const char* name, const std::vector<py::ssize_t>& shape,
                Numbers numbers) {
  const py::array array = real_array(value, name);
  if (!fits(shape_of(array), shape))
    refuse(name, fmt::format("the shape is {}, expected {}", shape_text(shape_of(array)), shape_text(shape)));
  const Doubles converted(array);
  for (py::ssize_t i = 0; numbers == Numbers::Finite && i < converted.size(); ++i)
    if (!std::isfinite(converted.data()[i])) refuse(name, "a value is not finite");
  return converted;
}

double finite(double number, const char* name) {
  if (!std::isfinite(number)) refuse(name, fmt::format("{} is not a finite number", number));
  return number;
}

ImageView image_view(const py::handle& value, const char* name) {
  if (!py::isinstance<py::array>(value))
    refuse(name, fmt::format("{} is not an image", with_article(type_text(value))),
           "Pass a NumPy array (height, width) of uint8.");
  const auto array = py::reinterpret_borrow<py::array>(value);
  if (!array.dtype().is(py::dtype::of<std::uint8_t>()) &&
      !(array.dtype().kind() == 'u' && array.itemsize() == 1))
    refuse(name, fmt::format("the pixels have dtype {}, expected uint8", std::string(py::str(array.dtype()))),
           "Scale to 0 … 255 and convert with .astype(numpy.uint8).");
  if (array.ndim() != 2)
    refuse(name, fmt::format("the shape is {}, expected (height, width)", shape_text(shape_of(array))),
           "waymark.image.read() returns grey images; image.mean(axis=2).astype(numpy.uint8) converts an "
           "array.");
  const py::ssize_t height = array.shape(0);
  const py::ssize_t width = array.shape(1);
  constexpr py::ssize_t kMaxSize = std::numeric_limits<int>::max();
  if (height > kMaxSize || width > kMaxSize) refuse(name, "the image is too wide or too high");
  if (height == 0 || width == 0) return {};
  const bool rows_in_order = height == 1 || (array.strides(0) >= width && array.strides(0) <= kMaxSize);
  if ((width > 1 && array.strides(1) != 1) || !rows_in_order)
    refuse(name, "the pixels of a row are not contiguous, or rows overlap or have a negative stride",
           "Copy the image with numpy.ascontiguousarray().");
  const auto stride = static_cast<int>(height == 1 ? width : array.strides(0));
  return {static_cast<const std::uint8_t*>(array.data()), static_cast<int>(width), static_cast<int>(height),
          stride};
}

py::array_t<std::uint8_t> to_array(Image image) {
  auto owned = std::make_unique<Image>(std::move(image));
  const Image* pixels = owned.get();
  const py::capsule owner(owned.release(), [](void* kept) { delete static_cast<Image*>(kept); });
  return py::array_t<std::uint8_t>({pixels->height(), pixels->width()}, pixels->view().data, owner);
}

}  // namespace waymark::python
