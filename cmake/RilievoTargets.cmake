# How every library, program, test and benchmark of the project is declared.

add_library(rilievo_warnings INTERFACE)
target_compile_options(rilievo_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Werror)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # g++ 12 reports fixed-size Eigen storage as uninitialised where it is not.
  target_compile_options(rilievo_warnings INTERFACE -Wno-maybe-uninitialized)
endif()

# rilievo_library(NAME DEPENDS public-libraries... PRIVATE private-libraries...): a room of the house,
# every .cc of its folder (PATTERN: those that match; EXCLUDE: but those of this regular expression).
function(rilievo_library name)
  cmake_parse_arguments(ARG "" "EXCLUDE" "PATTERN;DEPENDS;PRIVATE" ${ARGN})
  if(NOT ARG_PATTERN)
    set(ARG_PATTERN "*.cc")
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${ARG_PATTERN})
  if(ARG_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX ${ARG_EXCLUDE})
  endif()
  if(NOT sources)
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE
      $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/rilievo>)
    target_link_libraries(${name} INTERFACE ${ARG_DEPENDS})
    return()
  endif()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} PUBLIC
    $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/rilievo>)
  target_link_libraries(${name} PUBLIC ${ARG_DEPENDS} PRIVATE ${ARG_PRIVATE} rilievo_warnings)
endfunction()

# rilievo_test_program(NAME): a test that is a program of this build, which a sanitizer can look into.
# A report of one fails it, also that of a process it started, and it may take ten times as long.
function(rilievo_test_program name)
  set_tests_properties(${name} PROPERTIES LABELS program)
  if(CMAKE_CXX_FLAGS MATCHES "-fsanitize=")
    set_tests_properties(${name} PROPERTIES TIMEOUT 3000
      FAIL_REGULAR_EXPRESSION "SUMMARY: [A-Za-z]+Sanitizer|: runtime error: ")
  endif()
endfunction()

# rilievo_test(NAME DIRECTORY folder DEPENDS libraries...): one GoogleTest program of all the
# *_test.cc in the folder, one ctest entry.
function(rilievo_test name)
  if(NOT RILIEVO_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "TIMEOUT;DIRECTORY" "DEPENDS" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  file(GLOB sources CONFIGURE_DEPENDS ${ARG_DIRECTORY}/*_test.cc)
  if(NOT sources)
    return()
  endif()
  add_executable(${name} ${sources})
  target_link_libraries(${name} PRIVATE ${ARG_DEPENDS} rilievo_warnings GTest::gmock GTest::gtest_main)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
  rilievo_test_program(${name})
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
