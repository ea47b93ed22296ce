# How every library, program, test and benchmark of the project is declared.

add_library(rilievo_warnings INTERFACE)
target_compile_options(rilievo_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror
  # Said with _FORTIFY_SOURCE alone, of results that nothing follows from.
  -Wno-unused-result)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 reports fixed-size Eigen storage as uninitialised where it is not.
  target_compile_options(rilievo_warnings INTERFACE -Wno-maybe-uninitialized)
endif()

if(CMAKE_BUILD_TYPE STREQUAL "Release")
  set(RILIEVO_TEST_OPTIMISATION -O1)
endif()

# The headers of others that nearly every source reads are parsed once: one set for libraries, one with
# GoogleTest for tests. Headers of the project are never among them. A build without (the sanitizers')
# sees whether each file includes what it uses.
option(RILIEVO_PRECOMPILED_HEADERS "Parse the headers of libraries once" ON)
if(RILIEVO_PRECOMPILED_HEADERS)
  # Some libraries ask for it; the headers are taken only where all flags are the same.
  add_compile_options(-pthread)
  set(precompiled <algorithm> <array> <cmath> <cstdint> <functional> <limits> <memory> <optional>
    <string> <utility> <vector> <Eigen/Core> <Eigen/Geometry>
    [["absl/status/statusor.h"]] [["absl/strings/str_cat.h"]])
  add_library(rilievo_precompiled STATIC ${CMAKE_SOURCE_DIR}/cmake/precompiled.cc)
  target_link_libraries(rilievo_precompiled PRIVATE Eigen3::Eigen absl::statusor absl::strings
    rilievo_warnings)
  target_precompile_headers(rilievo_precompiled PRIVATE ${precompiled})
  if(RILIEVO_BUILD_TESTS)
    add_executable(rilievo_precompiled_test EXCLUDE_FROM_ALL ${CMAKE_SOURCE_DIR}/cmake/precompiled.cc)
    target_link_libraries(rilievo_precompiled_test PRIVATE Eigen3::Eigen absl::statusor absl::strings
      rilievo_warnings GTest::gmock GTest::gtest_main)
    target_compile_options(rilievo_precompiled_test PRIVATE ${RILIEVO_TEST_OPTIMISATION})
    target_precompile_headers(rilievo_precompiled_test PRIVATE ${precompiled} <gmock/gmock.h>
      <gtest/gtest.h>)
  endif()
endif()

# Sources are compiled eight to a unit (tests and the command line: sixteen), because most of the time goes into the
# headers of gRPC, CLI11 and Eigen and into what their templates become. Private names differ within a room. Without
# this, as for the sanitizers, each source is compiled alone.
option(RILIEVO_UNITY_BUILD "Compile sources several in one go" OFF)

# rilievo_library(NAME [WINGS] DEPENDS public-libraries... PRIVATE private-libraries...): a room, every .cc of
# its folder (WINGS: and of the folders in it; ONLY: those that match this regular expression; EXCLUDE:
# those that do not).
function(rilievo_library name)
  cmake_parse_arguments(ARG "WINGS" "ONLY;EXCLUDE" "DEPENDS;PRIVATE" ${ARGN})
  set(glob GLOB)
  if(ARG_WINGS)
    set(glob GLOB_RECURSE)
  endif()
  file(${glob} sources CONFIGURE_DEPENDS *.cc)
  if(ARG_ONLY)
    list(FILTER sources INCLUDE REGEX ${ARG_ONLY})
  endif()
  if(ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX ${ARG_EXCLUDE})
  endif()
  if(NOT sources)
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE
      $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include>)
    target_link_libraries(${name} INTERFACE ${ARG_DEPENDS})
    return()
  endif()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include>)
  target_link_libraries(${name} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_PRIVATE} rilievo_warnings)
  if(RILIEVO_PRECOMPILED_HEADERS)
    target_precompile_headers(${name} REUSE_FROM rilievo_precompiled)
  endif()
endfunction()

# rilievo_test_program(NAME [SECONDS n] [ALONE]): a test that is a program of this build, which a sanitizer
# can look into. A report of one fails it, also that of a process it started, and it may take ten times
# as long. Tests run side by side, those of most SECONDS first; ALONE: this one with no other, because it
# measures time.
function(rilievo_test_program name)
  cmake_parse_arguments(ARG "ALONE" "SECONDS" "" ${ARGN})
  set_tests_properties(${name} PROPERTIES LABELS program)
  if(ARG_SECONDS)
    set_tests_properties(${name} PROPERTIES COST ${ARG_SECONDS})
  endif()
  if(ARG_ALONE)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL ON)
  endif()
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
    set_tests_properties(${name} PROPERTIES TIMEOUT 3000
      FAIL_REGULAR_EXPRESSION "SUMMARY: [A-Za-z]+Sanitizer|: runtime error: ")
  endif()
endfunction()

# rilievo_test(NAME DIRECTORY folder [WINGS] [SECONDS n] [SHARDS n] [ALONE tests...] DEPENDS libraries...):
# one GoogleTest program of all the *_test.cc in the folder (WINGS: and in the folders in it), and its
# ctest entry. SHARDS: so many entries, NAME, NAME_2 and so on, each with its share of the tests and all
# of SECONDS. ALONE: these tests, named as in --gtest_filter, have an entry of their own, NAME_alone,
# which runs with no other.
function(rilievo_test name)
  if(NOT RILIEVO_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "WINGS" "TIMEOUT;DIRECTORY;SECONDS;SHARDS" "ALONE;DEPENDS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  set(glob GLOB)
  if(ARG_WINGS)
    set(glob GLOB_RECURSE)
  endif()
  file(${glob} sources CONFIGURE_DEPENDS ${ARG_DIRECTORY}/*_test.cc)
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} rilievo_warnings GTest::gmock GTest::gtest_main)
  # What is tested is compiled as it is shipped; the tests themselves are quicker to compile so.
  target_compile_options(${name} PRIVATE ${RILIEVO_TEST_OPTIMISATION})
  if(RILIEVO_PRECOMPILED_HEADERS)
    target_precompile_headers(${name} REUSE_FROM rilievo_precompiled_test)
  endif()
  if(ARG_ALONE AND ARG_SHARDS)
    message(FATAL_ERROR "${name}: ALONE and SHARDS do not go together")
  endif()
  list(JOIN ARG_ALONE ":" alone)
  if(ARG_ALONE)
    add_test(NAME ${name} COMMAND ${name} --gtest_filter=-${alone})
    add_test(NAME ${name}_alone COMMAND ${name} --gtest_filter=${alone})
    set_tests_properties(${name}_alone PROPERTIES TIMEOUT ${ARG_TIMEOUT})
    rilievo_test_program(${name}_alone ALONE)
  else()
    add_test(NAME ${name} COMMAND ${name})
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  rilievo_test_program(${name} SECONDS ${ARG_SECONDS})
  if(ARG_SHARDS)
    foreach(shard RANGE 1 ${ARG_SHARDS})
      set(entry ${name}_${shard})
      if(shard EQUAL 1)
        set(entry ${name})
      else()
        add_test(NAME ${entry} COMMAND ${name})
        set_tests_properties(${entry} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
        rilievo_test_program(${entry} SECONDS ${ARG_SECONDS})
      endif()
      math(EXPR index "${shard} - 1")
      set_tests_properties(${entry} PROPERTIES
        ENVIRONMENT "GTEST_TOTAL_SHARDS=${ARG_SHARDS};GTEST_SHARD_INDEX=${index}")
    endforeach()
  endif()
endfunction()

# rilievo_benchmark(NAME SOURCES ... DEPENDS libraries...): a Google Benchmark program.
function(rilievo_benchmark name)
  if(NOT RILIEVO_BUILD_BENCHMARKS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "" "SOURCES;DEPENDS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} rilievo_warnings benchmark::benchmark_main)
endfunction()
