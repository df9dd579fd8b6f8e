# mf_build_together(NAME): what makes a first build fast. The common headers come precompiled, and with
# MIRRORFIELD_UNITY several files are compiled at once.
function(mf_build_together name)
  target_precompile_headers(${name} REUSE_FROM mf_pch)
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${MIRRORFIELD_UNITY} UNITY_BUILD_BATCH_SIZE 6)
endfunction()

# mf_add_library(NAME SOURCES ... LINKS ... PRIVATE_LINKS ... [ALONE]): a folder of the house is one static library.
# ALONE: one that reads none of the common headers is built without waiting for them.
function(mf_add_library name)
  cmake_parse_arguments(ARG "ALONE" "" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PUBLIC ${ARG_LINKS} PRIVATE mf_warnings ${ARG_PRIVATE_LINKS})
  if(NOT ARG_ALONE)
    mf_build_together(${name})
  endif()
endfunction()

# mf_add_test(NAME SOURCES ... LINKS ... LABELS ...): one gtest program, one ctest entry.
# Exit code 77 (every test of the program skipped) is a visible skip.
function(mf_add_test name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINKS;LABELS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE mf_test_main mf_warnings ${ARG_LINKS})
  target_precompile_headers(${name} REUSE_FROM mf_test_pch)
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${PROJECT_BINARY_DIR})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 LABELS "${ARG_LABELS}" TIMEOUT 900)
endfunction()

# mf_add_long_test(NAME OF PROGRAM FILTER): tests of a program once more, with their full counts
# (tests/support/full_counts.h), labelled long: ctest -L long.
function(mf_add_long_test name program filter)
  add_test(NAME ${name} COMMAND ${program} --gtest_filter=${filter} WORKING_DIRECTORY ${PROJECT_BINARY_DIR})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77 LABELS long TIMEOUT 3600
                                          ENVIRONMENT MIRRORFIELD_FULL_COUNTS=1)
endfunction()
