# How every target of the project is made: the warnings, the sanitizers, the include root.

add_library(stance_options INTERFACE)
target_include_directories(stance_options INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(stance_options INTERFACE
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  $<$<BOOL:${STANCE_WARNINGS_AS_ERRORS}>:-Werror>)
if(STANCE_SANITIZE)
  target_compile_options(stance_options INTERFACE -fsanitize=${STANCE_SANITIZE} -fno-omit-frame-pointer)
  target_link_options(stance_options INTERFACE -fsanitize=${STANCE_SANITIZE})
endif()

# stance_add_library(<name> SOURCES ... HEADERS ... [PUBLIC libs...] [PRIVATE libs...])
#
# Makes the static library stance_<name> and its alias stance::<name>. HEADERS form a header set, so that
# the target all_verify_interface_header_sets proves that each compiles alone.
function(stance_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  add_library(stance_${name} STATIC ${ARG_SOURCES})
  add_library(stance::${name} ALIAS stance_${name})
  target_sources(stance_${name} PUBLIC FILE_SET HEADERS BASE_DIRS ${PROJECT_SOURCE_DIR} FILES ${ARG_HEADERS})
  set_target_properties(stance_${name} PROPERTIES VERIFY_INTERFACE_HEADER_SETS ON)
  target_link_libraries(stance_${name} PUBLIC ${ARG_PUBLIC} PRIVATE stance_options ${ARG_PRIVATE})
endfunction()

# stance_add_binary(<name> SOURCES ... [LIBS ...]): an executable in build/<preset>/bin.
function(stance_add_binary name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE stance_options ${ARG_LIBS})
endfunction()

# stance_add_test(<name> SOURCES ... [LIBS ...] [ENVIRONMENT ...]): a GoogleTest binary, one ctest per case.
function(stance_add_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;LIBS;ENVIRONMENT" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE stance_options ${ARG_LIBS} GTest::gmock GTest::gtest_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/tests)
  gtest_discover_tests(${name}
    DISCOVERY_TIMEOUT 60
    PROPERTIES TIMEOUT ${ARG_TIMEOUT} ENVIRONMENT "${ARG_ENVIRONMENT}")
endfunction()
