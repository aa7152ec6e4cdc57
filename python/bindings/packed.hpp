#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/parts.hpp"
#include "python/bindings/tag_ids.hpp"
#include "python/bindings/values.hpp"
#include "waymark/base/time.hpp"

namespace waymark::python {

namespace internal {

template <class T>
inline constexpr bool kIsOptional = false;
template <class T>
inline constexpr bool kIsOptional<std::optional<T>> = true;
template <class T>
inline constexpr bool kIsMap = false;
template <class K, class V>
inline constexpr bool kIsMap<std::map<K, V>> = true;
template <class T>
inline constexpr bool kIsVector = false;
template <class T>
inline constexpr bool kIsVector<std::vector<T>> = true;
template <class T>
inline constexpr bool kIsArray = false;
template <class T, std::size_t N>
inline constexpr bool kIsArray<std::array<T, N>> = true;
template <class T>
concept IsMatrix = std::derived_from<T, Eigen::MatrixBase<T>>;

[[noreturn]] inline void refuse_state() {
  throw py::type_error("the state is not a pickle of this class and version");
}

/// The state as a tuple, which must have `size` entries unless `size` is 0.
[[nodiscard]] inline py::tuple entries(const py::handle& state, std::size_t size = 0) {
  if (!PyTuple_Check(state.ptr())) refuse_state();
  auto tuple = py::reinterpret_borrow<py::tuple>(state);
  if (size != 0 && tuple.size() != size) refuse_state();
  return tuple;
}

}  // namespace internal

/// An exact representation of a value for pickle: tuples of struct fields and container elements, numbers,
/// strings, arrays, and objects of bound classes.
template <class T>
[[nodiscard]] py::object packed(const T& value) {
  if constexpr (HasParts<T>) {
    py::list all;
    parts(value, [&](const auto&... part) { (all.append(packed(part)), ...); });
    return py::tuple(all);
  } else if constexpr (internal::kIsOptional<T>) {
    return value ? py::object(py::make_tuple(packed(*value))) : py::object(py::tuple());
  } else if constexpr (internal::kIsMap<T>) {
    py::list all;
    for (const auto& [key, there] : value) all.append(py::make_tuple(packed(key), packed(there)));
    return py::tuple(all);
  } else if constexpr (internal::kIsVector<T> || internal::kIsArray<T>) {
    py::list all;
    for (const auto& element : value) all.append(packed(element));
    return py::tuple(all);
  } else if constexpr (internal::IsMatrix<T>) {
    return to_array(value);
  } else if constexpr (std::is_enum_v<T>) {
    return py::int_(static_cast<std::int64_t>(value));
  } else if constexpr (std::is_same_v<T, TagId>) {
    return py::str(to_string(value));
  } else if constexpr (std::is_same_v<T, SensorTime>) {
    return py::int_(value.time_since_epoch().count());
  } else {
    return py::cast(value);
  }
}

/// Restores `value` from the result of packed(). Raises TypeError for anything else.
template <class T>
void unpack(const py::handle& state, T& value);

namespace internal {

template <class T>
[[nodiscard]] T unpacked(const py::handle& state) {
  T value = blank<T>();
  unpack(state, value);
  return value;
}

template <class T>
void unpack_parts(const py::handle& state, T& value) {
  parts(value, [&](auto&... part) {
    const py::tuple all = entries(state, sizeof...(part));
    std::size_t index = 0;
    (unpack(py::object(all[index++]), part), ...);
  });
}

template <class K, class V>
void unpack_map(const py::handle& state, std::map<K, V>& value) {
  value.clear();
  for (const py::handle& each : entries(state)) {
    const py::tuple pair = entries(each, 2);
    value.insert_or_assign(unpacked<K>(pair[0]), unpacked<V>(pair[1]));
  }
}

template <class T>
void unpack_matrix(const py::handle& state, T& value) {
  const std::vector<py::ssize_t> shape =
      T::ColsAtCompileTime == 1 ? std::vector<py::ssize_t>{T::RowsAtCompileTime}
                                : std::vector<py::ssize_t>{T::RowsAtCompileTime, T::ColsAtCompileTime};
  const Doubles numbers = doubles(state, "state", shape, Numbers::Any);
  for (int row = 0; row < T::RowsAtCompileTime; ++row)
    for (int column = 0; column < T::ColsAtCompileTime; ++column)
      value(row, column) = numbers.data()[row * T::ColsAtCompileTime + column];
}

}  // namespace internal

template <class T>
void unpack(const py::handle& state, T& value) {
  if constexpr (HasParts<T>) {
    internal::unpack_parts(state, value);
  } else if constexpr (internal::kIsOptional<T>) {
    value.reset();
    for (const py::handle& there : internal::entries(state))
      value = internal::unpacked<typename T::value_type>(there);
  } else if constexpr (internal::kIsMap<T>) {
    internal::unpack_map(state, value);
  } else if constexpr (internal::kIsVector<T>) {
    value.clear();
    for (const py::handle& each : internal::entries(state))
      value.push_back(internal::unpacked<typename T::value_type>(each));
  } else if constexpr (internal::kIsArray<T>) {
    const py::tuple all = internal::entries(state, value.size());
    for (std::size_t i = 0; i < value.size(); ++i) unpack(py::object(all[i]), value.at(i));
  } else if constexpr (internal::IsMatrix<T>) {
    internal::unpack_matrix(state, value);
  } else if constexpr (std::is_enum_v<T>) {
    const auto number = py::cast<std::int64_t>(state);
    if (number < 0 || number > static_cast<std::int64_t>(last_of(T{}))) internal::refuse_state();
    value = static_cast<T>(number);
  } else if constexpr (std::is_same_v<T, TagId>) {
    value = tag_of(state);
  } else if constexpr (std::is_same_v<T, SensorTime>) {
    value = SensorTime(Duration(py::cast<std::int64_t>(state)));
  } else {
    value = py::cast<T>(state);
  }
}

/// Adds pickle, copy and == to a class without a keyword constructor, using its parts.
template <class T>
void def_packed(py::class_<T>& cls) {
  cls.def(py::pickle([](const T& value) { return py::tuple(packed(value)); },
                     [](const py::tuple& state) {
                       try {
                         return internal::unpacked<T>(state);
                       } catch (const py::cast_error&) {
                         internal::refuse_state();
                       }
                     }));
  finish_state(cls);
}

}  // namespace waymark::python
