# rig_fuzz_target(NAME SOURCES a.cpp ... [DEPS x y] [CORPUS dir] [MUTATIONS n])    one parser, two uses of the same source
#
# The source defines LLVMFuzzerTestOneInput. In the fuzz preset (clang) it becomes the libFuzzer program NAME. In every
# other preset it becomes NAME_replay, an ordinary test labelled `fuzz` that feeds it each file of the corpus folder
# (default: corpus/ beside the CMakeLists.txt; an empty one is an error) and deterministic mutations of each.
# Search for new inputs with: build/fuzz/bin/NAME -max_total_time=60 tests/fuzz/NAME/corpus
function(rig_fuzz_target name)
    cmake_parse_arguments(ARG "" "CORPUS;MUTATIONS" "SOURCES;DEPS" ${ARGN})
    if(NOT ARG_CORPUS)
        set(ARG_CORPUS ${CMAKE_CURRENT_SOURCE_DIR}/corpus)
    endif()
    if(NOT ARG_MUTATIONS)
        set(ARG_MUTATIONS 500)
    endif()
    if(RIG_BUILD_FUZZERS)
        rig_program(${name} SOURCES ${ARG_SOURCES} DEPS ${ARG_DEPS})
        target_link_options(${name} PRIVATE -fsanitize=fuzzer)
        return()
    endif()
    rig_program(${name}_replay SOURCES ${ARG_SOURCES} ${CMAKE_SOURCE_DIR}/tests/support/fuzz_replay_main.cpp
                DEPS ${ARG_DEPS} tests_support)
    set_target_properties(${name}_replay PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/tests)
    add_test(NAME ${name}_replay COMMAND ${name}_replay ${ARG_CORPUS} ${ARG_MUTATIONS}
             WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
    set_tests_properties(${name}_replay PROPERTIES LABELS fuzz)
rig_timeout(${name}_replay 300)
endfunction()
