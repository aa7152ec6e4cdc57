// What most binding files include. Used by a quick build only (cmake/Precompiled.cmake).
#pragma once

#include "cmake/precompiled.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
