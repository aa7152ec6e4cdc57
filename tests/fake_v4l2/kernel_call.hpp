#pragma once

#include <type_traits>

#include <unistd.h>

namespace fake_v4l2 {

template <class Argument>
long register_of(Argument argument) {
  if constexpr (std::is_pointer_v<Argument>)
    return reinterpret_cast<long>(argument);
  else
    return static_cast<long>(argument);
}

/// syscall() with register-wide arguments. The kernel reads whole registers, but the upper half of an `int`
/// that is passed to a variadic function on the stack is undefined.
template <class... Arguments>
long kernel_call(long number, Arguments... arguments) {
  return ::syscall(number, register_of(arguments)...);
}

}  // namespace fake_v4l2
