#include "python/bindings/options.hpp"

#include <cmath>

#include <fmt/format.h>

namespace waymark::python {
namespace {

std::string type_of(const py::handle& value) { return py::str(py::type::handle_of(value).attr("__name__")); }

YamlNode scalar(std::string text) { return {.kind = YamlNode::Kind::Scalar, .text = std::move(text)}; }

/// repr() of a float round-trips exactly.
YamlNode number(const py::handle& value) {
  const double read = PyFloat_AsDouble(value.ptr());
  if (read == -1 && PyErr_Occurred() != nullptr) throw py::error_already_set();
  return scalar(std::isfinite(read) ? std::string(py::repr(py::float_(read))) : ".nan");
}

YamlNode map_of(const py::handle& value, const std::string& key) {
  YamlNode node{.kind = YamlNode::Kind::Map};
  for (const auto& [name, item] : py::reinterpret_borrow<py::dict>(value)) {
    if (!py::isinstance<py::str>(name))
      refuse(key, fmt::format("a key is {}, not a string", with_article(type_of(name))));
    node.keys.push_back(py::cast<std::string>(name));
    node.key_lines.push_back(1);
    node.items.push_back(tree_of(item, (key.empty() ? "" : key + ".") + node.keys.back()));
  }
  return node;
}

}  // namespace

YamlNode tree_of(const py::handle& value, const std::string& key) {
  if (value.is_none()) return {};
  if (PyBool_Check(value.ptr()) || type_of(value) == "bool_")
    return scalar(PyObject_IsTrue(value.ptr()) == 1 ? "true" : "false");
  if (PyUnicode_Check(value.ptr())) return scalar(py::cast<std::string>(value));
  if (PyDict_Check(value.ptr())) return map_of(value, key);
  if (PyFloat_Check(value.ptr())) return number(value);
  if (PyIndex_Check(value.ptr()) && !py::hasattr(value, "__len__"))
    return scalar(py::str(py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()))));
  if (py::isinstance<py::sequence>(value) ||
      (py::hasattr(value, "__len__") && py::hasattr(value, "__iter__"))) {
    YamlNode node{.kind = YamlNode::Kind::Sequence};
    for (const py::handle& item : py::iter(value)) node.items.push_back(tree_of(item, key));
    return node;
  }
  if (py::hasattr(value, "__float__")) return number(value);
  refuse(key, fmt::format("{} is not a valid option value", with_article(type_of(value))),
         "Pass a number, a string, True or False, a list, or a dictionary.");
}

Error without_file(Error error) {
  error.place.source.clear();
  error.place.line.reset();
  return error;
}

void add_option_line(std::string& text, int indent, const Field& field, const std::string& usual) {
  std::string written = usual;
  while (!written.empty() && written.back() == '\n') written.pop_back();
  std::string range;
  if (std::isfinite(field.min) && std::isfinite(field.max))
    range = fmt::format(", {} to {}", field.min, field.max);
  text += fmt::format("{:{}}{}: {} [{}{}]\n", "", indent, field.name, field.sentence,
                      written.empty() ? "None" : written.substr(written.front() == ' ' ? 1 : 0), range);
}

py::object take(py::dict& given, const char* name) {
  if (!given.contains(name)) return py::none();
  py::object value = given[name];
  PyDict_DelItemString(given.ptr(), name);
  return value;
}

}  // namespace waymark::python
