# One folder, one target: the arrows between folders are the link lines, so a wrong include fails to link.

option(VANTAGE_WERROR "Treat warnings as errors" OFF)
set(VANTAGE_SANITIZE "" CACHE STRING "address or thread: build with that sanitizer")

add_library(vantage_flags INTERFACE)
# No fused multiply-add: results must not depend on which machine compiled them.
# g++ 12 reports -Wrestrict inside std::string (GCC bug 105651).
target_compile_options(vantage_flags INTERFACE -Wall -Wextra -Wno-restrict -Wshadow -Wconversion -ffp-contract=off
  $<$<BOOL:${VANTAGE_WERROR}>:-Werror>)
target_compile_definitions(vantage_flags INTERFACE SPDLOG_COMPILED_LIB SPDLOG_FMT_EXTERNAL)
target_include_directories(vantage_flags INTERFACE ${CMAKE_SOURCE_DIR})
if(VANTAGE_SANITIZE STREQUAL "address")
  # -fno-sanitize=vptr: with g++ 12 that check breaks LCM's member-function subscriptions.
  target_compile_options(vantage_flags INTERFACE -fsanitize=address,undefined -fno-sanitize=vptr -fno-omit-frame-pointer)
  target_link_options(vantage_flags INTERFACE -fsanitize=address,undefined)
elseif(VANTAGE_SANITIZE STREQUAL "thread")
  target_compile_options(vantage_flags INTERFACE -fsanitize=thread -fno-omit-frame-pointer)
  target_link_options(vantage_flags INTERFACE -fsanitize=thread)
endif()

# vantage_library(NAME [SOURCES a.cpp …] [LIBS …]): a static library of the folder's .cpp files (or of SOURCES).
function(vantage_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  if(NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  endif()
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_link_libraries(${name} PUBLIC vantage_flags ${ARG_LIBS})
  else()
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE vantage_flags ${ARG_LIBS})
  endif()
endfunction()

# vantage_job_kind(KIND [LIBS …]): KIND_job.cpp is light and goes into the plan that the scheduler links; all other
# files of the folder are heavy and only the worker links them.
function(vantage_job_kind kind)
  cmake_parse_arguments(ARG "" "" "LIBS" ${ARGN})
  target_sources(vantage_job_plan PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/${kind}_job.cpp)
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/${kind}_job\\.cpp$")
  vantage_library(vantage_run_${kind} SOURCES ${sources} LIBS vantage_job_plan vantage_vision ${ARG_LIBS})
  target_link_libraries(vantage_job_runs INTERFACE vantage_run_${kind})
endfunction()

# vantage_test(NAME [WHOLE] [SOURCES …] [TIMEOUT s] LIBS …): a GoogleTest program of the folder's *_test.cpp files, each test
# run by itself; with WHOLE the program runs once, for tests that share a costly set-up.
include(GoogleTest)
function(vantage_test name)
  cmake_parse_arguments(ARG "WHOLE" "TIMEOUT" "SOURCES;LIBS" ${ARGN})
  if(NOT "SOURCES" IN_LIST ARG_KEYWORDS_MISSING_VALUES AND NOT ARG_SOURCES)
    file(GLOB ARG_SOURCES CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp)
  endif()
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 300)
  endif()
  if(ARG_SOURCES)
    add_executable(${name} ${ARG_SOURCES})
    target_link_libraries(${name} PRIVATE vantage_flags ${ARG_LIBS} GTest::gtest GTest::gtest_main)
    if(ARG_WHOLE)
      add_test(NAME ${name} COMMAND ${name})
      set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT})
    else()
      gtest_discover_tests(${name} DISCOVERY_MODE PRE_TEST PROPERTIES TIMEOUT ${ARG_TIMEOUT})
    endif()
  endif()
endfunction()
