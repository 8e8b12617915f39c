# The one way to declare a target: sources by hand, flags per target, never globally.

set(RIG_WARNING_FLAGS -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Wold-style-cast -Wcast-align
    -Woverloaded-virtual -Wdouble-promotion -Wimplicit-fallthrough)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    list(APPEND RIG_WARNING_FLAGS -Wno-restrict)  # GCC 12 sees overlaps in "text" + std::string (its bug 105651)
endif()
if(RIG_WARNINGS_AS_ERRORS)
    list(APPEND RIG_WARNING_FLAGS -Werror)
endif()

function(rig_common_flags target)
    target_include_directories(${target} PUBLIC ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}/generated)
    target_compile_options(${target} PRIVATE ${RIG_WARNING_FLAGS})
    if(RIG_SANITIZE)
        target_compile_options(${target} PUBLIC -fsanitize=${RIG_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
        target_link_options(${target} PUBLIC -fsanitize=${RIG_SANITIZE})
    endif()
    if(RIG_BUILD_FUZZERS)
        target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)  # coverage for libFuzzer to follow
    endif()
endfunction()

# rig_library(NAME SOURCES a.cpp b.cpp [DEPS x y])    one static library per folder
function(rig_library name)
    cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
    add_library(${name} STATIC ${ARG_SOURCES})
    rig_common_flags(${name})
    target_link_libraries(${name} PUBLIC ${ARG_DEPS})
endfunction()

# rig_core_library(...)    the same, with the arithmetic rules of core: no exceptions, no RTTI, no
# contraction of a*b+c (a fused result differs between instruction sets), no Eigen vector kernels.
function(rig_core_library name)
    rig_library(${name} ${ARGN})
    target_compile_options(${name} PRIVATE -fno-exceptions -fno-rtti -ffp-contract=off -fno-math-errno
        $<$<CONFIG:Release>:-O3>)
    target_compile_definitions(${name} PUBLIC EIGEN_DONT_VECTORIZE EIGEN_DONT_PARALLELIZE)
endfunction()

# rig_program(NAME SOURCES ... [DEPS ...])    an executable into build/<preset>/bin
function(rig_program name)
    cmake_parse_arguments(ARG "" "" "SOURCES;DEPS" ${ARGN})
    add_executable(${name} ${ARG_SOURCES})
    rig_common_flags(${name})
    target_link_libraries(${name} PRIVATE ${ARG_DEPS})
endfunction()

# rig_timeout(test seconds)    sanitizers and coverage counters make a test many times slower, not wrong
function(rig_timeout test seconds)
    if(RIG_SANITIZE OR CMAKE_CXX_FLAGS_DEBUG MATCHES "coverage")
        math(EXPR seconds "${seconds} * 8")
    endif()
    set_tests_properties(${test} PROPERTIES TIMEOUT ${seconds})
endfunction()

# rig_thin(target)    for code that runs once, reads a command line and calls others: compile time counts, speed does not
function(rig_thin target)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# rig_test(NAME SOURCES ... [DEPS ...] [LABELS ...] [TIMEOUT seconds])    a GoogleTest program, one ctest entry per
# program (tests inside it are listed by --gtest_list_tests). A skip is reported by GoogleTest itself.
function(rig_test name)
    cmake_parse_arguments(ARG "" "TIMEOUT" "SOURCES;DEPS;LABELS" ${ARGN})
    rig_program(${name} SOURCES ${ARG_SOURCES} DEPS ${ARG_DEPS} GTest::gtest GTest::gtest_main)
    set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
    # Tests run for seconds and compile for minutes: what they test is fully optimised, they are not.
    rig_thin(${name})
    # Read once for all of them; the definitions are core's, so that the same Eigen fits every test.
    target_compile_definitions(${name} PRIVATE EIGEN_DONT_VECTORIZE EIGEN_DONT_PARALLELIZE)
    target_precompile_headers(${name} REUSE_FROM tests_headers)
    add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
    if(name MATCHES "^(unit|property)_core_")
        add_dependencies(core_tests ${name})  # what scripts/coverage builds and runs
    endif()
    if(NOT ARG_TIMEOUT)
        set(ARG_TIMEOUT 300)
    endif()
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}")
    rig_timeout(${name} ${ARG_TIMEOUT})
endfunction()
