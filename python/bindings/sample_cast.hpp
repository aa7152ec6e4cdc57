#pragma once

#include <array>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/errors.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark::python {

namespace py = pybind11;

/// The value in an object whose Python type is exactly that of T; raises TypeError if it was never
/// initialised.
template <typename T>
[[nodiscard]] const T& value_inside(const py::handle& object) {
  const auto held = reinterpret_cast<py::detail::instance*>(object.ptr())->get_value_and_holder();
  if (held.value_ptr<T>() == nullptr) throw py::type_error("a sample whose __init__() was not called");
  return *held.value_ptr<T>();
}

/// The sample in an object whose type is exactly one of those in Sample, found by comparing types. The
/// variant caster of pybind11 would try one type after another, at 0.1 us each. Requires the GIL.
template <std::size_t... kIndex>
[[nodiscard]] std::optional<Sample> exact_sample(const py::handle& object, std::index_sequence<kIndex...>) {
  static const std::array<PyObject*, sizeof...(kIndex)> types{
      py::detail::get_type_handle(typeid(std::variant_alternative_t<kIndex, Sample>), false).ptr()...};
  const auto* const type = reinterpret_cast<PyObject*>(Py_TYPE(object.ptr()));
  std::optional<Sample> sample;
  const auto take = [&](auto index) {
    if (types[index] != type) return false;
    sample.emplace(std::in_place_index<index>,
                   value_inside<std::variant_alternative_t<index, Sample>>(object));
    return true;
  };
  static_cast<void>((take(std::integral_constant<std::size_t, kIndex>{}) || ...));
  return sample;
}

/// The sample in a Python object; raises TypeError if it is not a sample.
[[nodiscard]] inline Sample sample_of(const py::handle& object) {
  if (auto sample = exact_sample(object, std::make_index_sequence<std::variant_size_v<Sample>>{}))
    return std::move(*sample);
  py::detail::make_caster<Sample> caster;
  if (!caster.load(object, true))
    throw py::type_error(with_article(py::str(py::type::handle_of(object).attr("__name__"))) +
                         " is not a sample: pass objects of waymark.samples");
  return py::detail::cast_op<Sample&&>(std::move(caster));
}

}  // namespace waymark::python
