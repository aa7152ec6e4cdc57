# What we ask of our own code. An interface target of ours only: nothing here reaches a consumer.
add_library(waymark_warnings INTERFACE)
# -Wshadow: not of files that are compiled together, where the names of one are beside the others'; tools/tidy.sh looks at each by itself.
target_compile_options(waymark_warnings INTERFACE -Wall -Wextra -Wpedantic $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow> -Wconversion -Wsign-conversion
  -Wnon-virtual-dtor -Woverloaded-virtual -Wnull-dereference $<$<BOOL:${WAYMARK_WERROR}>:-Werror>)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # GCC 12 reports these inside Eigen and the standard library when it inlines; clang-tidy and the sanitizers cover them.
  target_compile_options(waymark_warnings INTERFACE -Wno-null-dereference -Wno-maybe-uninitialized -Wno-array-bounds
    -Wno-stringop-overflow -Wno-restrict)
endif()

if(WAYMARK_SANITIZE)
  if(WAYMARK_SANITIZE MATCHES "thread" AND WAYMARK_SANITIZE MATCHES "address")
    message(FATAL_ERROR "WAYMARK_SANITIZE: 'thread' cannot be combined with 'address'; use the presets asan-ubsan or tsan.")
  endif()
  add_compile_options(-fsanitize=${WAYMARK_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${WAYMARK_SANITIZE})
endif()

# Hardening. Where a user runs it: canaries on the stack, checked copies. The programs in every build: position independent, relocations
# resolved before main() and read-only from then on (RELRO, BIND_NOW). tests/house/hardening_test.py looks at the result.
set(WAYMARK_HARDENED OFF)
if(PROJECT_IS_TOP_LEVEL AND CMAKE_BUILD_TYPE MATCHES "^(Release|RelWithDebInfo|MinSizeRel)$" AND NOT WAYMARK_SANITIZE)
  set(WAYMARK_HARDENED ON)
  add_compile_options(-fstack-protector-strong -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=2)
  # Jumps land only where the compiler meant them to (CET on x86-64, BTI and PAC on 64-bit ARM).
  include(CheckCXXCompilerFlag)
  set(flag -fcf-protection=full)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")
    set(flag -mbranch-protection=standard)
  endif()
  check_cxx_compiler_flag(${flag} WAYMARK_HAS_BRANCH_PROTECTION)
  if(WAYMARK_HAS_BRANCH_PROTECTION)
    add_compile_options(${flag})
  endif()
endif()
if(WAYMARK_PACKAGE)  # the same bytes, wherever it is built
  add_compile_options(-ffile-prefix-map=${PROJECT_BINARY_DIR}=build -ffile-prefix-map=${PROJECT_SOURCE_DIR}=.)
endif()
include(CheckPIESupported)
check_pie_supported(LANGUAGES CXX)
function(waymark_harden program)
  set_target_properties(${program} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(NOT APPLE)
    target_link_options(${program} PRIVATE -Wl,-z,relro,-z,now)
  endif()
  if(NOT WAYMARK_SANITIZE)
    target_compile_options(${program} PRIVATE -fstack-protector-strong)
  endif()
endfunction()

find_program(WAYMARK_CCACHE ccache)
if(WAYMARK_CCACHE AND PROJECT_IS_TOP_LEVEL AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${WAYMARK_CCACHE})
endif()
