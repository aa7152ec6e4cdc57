// Headers included by most binding files. Used only in a quick build (cmake/Precompiled.cmake).
#pragma once

#include "cmake/precompiled.hpp"

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "python/bindings/arrays.hpp"
#include "python/bindings/errors.hpp"
#include "python/bindings/options.hpp"
