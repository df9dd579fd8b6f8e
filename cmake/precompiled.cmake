# The headers that most files read, parsed once for the whole house: parsing them is half of a first build.
# Each file still includes what it uses; scripts/lint compiles without these.
# (JSON is left out: its header makes every file that has it slower by more than it costs the few that need it.)
set(MF_PRECOMPILED_HEADERS
  <Eigen/Cholesky> <Eigen/Core> <Eigen/Geometry> <Eigen/LU> <algorithm> <filesystem> <fmt/format.h> <map> <memory>
  <numbers> <optional> <span> <string> <vector>)

# mf_precompile(NAME HEADERS ... LINKS ...): an object library that exists for its precompiled headers.
function(mf_precompile name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LINKS" ${ARGN})
  set(source ${PROJECT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "// Only carries the precompiled headers.\n")
  add_library(${name} OBJECT EXCLUDE_FROM_ALL ${source})
  target_link_libraries(${name} PRIVATE mf_warnings Eigen3::Eigen fmt::fmt ${ARG_LINKS})
  target_precompile_headers(${name} PRIVATE ${MF_PRECOMPILED_HEADERS} ${ARG_HEADERS})
endfunction()

mf_precompile(mf_pch)
mf_precompile(mf_test_pch HEADERS <gtest/gtest.h> LINKS GTest::gtest)
