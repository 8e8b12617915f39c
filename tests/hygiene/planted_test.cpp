// Each rule on small planted trees: it finds what it is for, where it is, and lets the right form pass.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/hygiene/rules.hpp"

namespace rig::hygiene {
namespace {

using Check = Violations (*)(const SourceTree&);

SourceTree planted(const std::string& path, const std::string& text) {
    SourceTree tree;
    // What planted files may include.
    for (const char* header :
         {"core/limits.hpp", "core/base/check.hpp", "core/image/view.hpp", "core/solve/nnls.hpp",
          "core/detect/observation.hpp", "core/detect/runs.hpp", "core/pipeline/pipeline.hpp",
          "core/geometry/camera_model.hpp", "hal/clock.hpp", "hal/linux/tty_link.hpp",
          "hal/sim/manual_clock.hpp", "hal/sim/world_protocol.hpp", "firmware_host/daemon/app.hpp"}) {
        tree.add(header, "// A header.\n#pragma once\n");
    }
    tree.add(path, text);
    return tree;
}

// How often the rule complains about the planted file.
std::size_t count(Check check, const std::string& path, const std::string& text) {
    const Violations violations = check(planted(path, text));
    return static_cast<std::size_t>(std::count_if(violations.begin(), violations.end(),
                                                  [&](const Violation& v) { return v.path == path; }));
}

std::string include(const std::string& path) {
    return "#include \"" + path + "\"\n";
}

TEST(PlantedIncludeSpelling, WantsPathsFromTheRoot) {
    EXPECT_EQ(
        count(include_spelling, "core/base/a.cpp", include("core/base/check.hpp") + "#include <array>\n"),
        0U);
    EXPECT_EQ(count(include_spelling, "core/base/a.cpp", include("check.hpp")), 1U);
    EXPECT_EQ(count(include_spelling, "core/base/a.cpp", include("../base/check.hpp")), 1U);
    EXPECT_EQ(count(include_spelling, "core/base/a.cpp", "#include <core/base/check.hpp>\n"), 1U);
    EXPECT_EQ(count(include_spelling, "core/pack/a.cpp", include("core/pack/manifest_generated.h")), 0U);
}

TEST(PlantedIncludeDirections, PointDownInCore) {
    EXPECT_EQ(count(include_directions, "core/detect/a.cpp",
                    include("core/image/view.hpp") + include("core/limits.hpp")),
              0U);
    EXPECT_EQ(count(include_directions, "core/base/a.cpp", include("core/image/view.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "core/image/a.cpp", include("core/geometry/camera_model.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "core/track/a.cpp", include("core/detect/observation.hpp")), 0U);
    EXPECT_EQ(count(include_directions, "core/track/a.cpp", include("core/detect/runs.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "core/detect/a.cpp", include("core/solve/nnls.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "core/base/a.cpp", include("hal/clock.hpp")), 1U);
}

TEST(PlantedIncludeDirections, NothingInCoreOrHalSeesThePipeline) {
    for (const char* path :
         {"core/solve/a.cpp", "core/wire/a.cpp", "core/filter/a.hpp", "hal/sim/a.cpp", "hal/clock.hpp"}) {
        EXPECT_EQ(count(include_directions, path, include("core/pipeline/pipeline.hpp")), 1U) << path;
    }
    EXPECT_EQ(
        count(include_directions, "firmware_host/daemon/app.cpp", include("core/pipeline/pipeline.hpp")), 0U);
    EXPECT_EQ(count(include_directions, "core/pipeline/a.cpp", include("core/solve/nnls.hpp")), 0U);
}

TEST(PlantedIncludeDirections, TheSimulatedWorldIsIndependent) {
    EXPECT_EQ(
        count(include_directions, "hal/sim/a.cpp", include("hal/clock.hpp") + include("core/base/check.hpp")),
        0U);
    EXPECT_EQ(count(include_directions, "hal/sim/a.cpp", include("core/solve/nnls.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "hal/sim/a.cpp", include("hal/linux/tty_link.hpp")), 1U);
    EXPECT_EQ(count(include_directions, "firmware_host/companion/world/a.cpp",
                    include("core/geometry/camera_model.hpp")),
              1U);
    EXPECT_EQ(count(include_directions, "firmware_host/companion/world/a.cpp",
                    include("hal/sim/world_protocol.hpp")),
              0U);
}

TEST(PlantedIncludeDirections, ProgramsDoNotSeeEachOther) {
    EXPECT_EQ(
        count(include_directions, "firmware_host/companion/a.cpp", include("firmware_host/daemon/app.hpp")),
        1U);
    EXPECT_EQ(count(include_directions, "hal/linux/a.cpp", include("firmware_host/daemon/app.hpp")), 1U);
}

TEST(PlantedCoreHeaders, AreOnTheAllowList) {
    EXPECT_EQ(
        count(core_headers, "core/solve/a.cpp", "#include <array>\n#include <cmath>\n#include <span>\n"), 0U);
    for (const char* header :
         {"vector", "string", "iostream", "chrono", "thread", "random", "functional", "memory", "unistd.h",
          "math.h", "Eigen/Core", "opencv2/core.hpp", "atomic", "flatbuffers/flatbuffers.h"}) {
        EXPECT_EQ(count(core_headers, "core/solve/a.cpp", "#include <" + std::string(header) + ">\n"), 1U)
            << header;
    }
    EXPECT_EQ(count(core_headers, "core/pack/a.cpp", "#include <flatbuffers/flatbuffers.h>\n"), 0U);
    EXPECT_EQ(count(core_headers, "core/base/linalg.hpp", "#include <Eigen/Core>\n"), 0U);
    EXPECT_EQ(count(core_headers, "hal/clock.hpp", "#include <unistd.h>\n"), 1U);
    EXPECT_EQ(count(core_headers, "hal/linux/a.cpp", "#include <unistd.h>\n"), 0U);
}

TEST(PlantedBackendNaming, IsForWiringAlone) {
    EXPECT_EQ(count(backend_naming, "firmware_host/daemon/wiring.cpp", include("hal/linux/tty_link.hpp")),
              0U);
    EXPECT_EQ(count(backend_naming, "firmware_host/daemon/app.cpp", include("hal/linux/tty_link.hpp")), 1U);
    EXPECT_EQ(count(backend_naming, "firmware_host/daemon/app.cpp", include("hal/sim/manual_clock.hpp")), 1U);
    EXPECT_EQ(count(backend_naming, "firmware_host/daemon/app.cpp", include("hal/clock.hpp")), 0U);
    EXPECT_EQ(
        count(backend_naming, "firmware_host/companion/world/a.cpp", include("hal/sim/world_protocol.hpp")),
        0U);
    EXPECT_EQ(
        count(backend_naming, "firmware_host/companion/world/a.cpp", include("hal/sim/manual_clock.hpp")),
        1U);
}

TEST(PlantedCoreWords, FindsEveryBannedForm) {
    for (const char* code : {"int* p = new int;",
                             "delete p;",
                             "void* p = malloc(4);",
                             "free(p);",
                             "std::vector<int> v;",
                             "std::string s;",
                             "throw 1;",
                             "try { f(); } catch (...) {}",
                             "double y = std::sin(x);",
                             "double y = sin(x);",
                             "float y = expf(x);",
                             "double y = std::exp(x);",
                             "double y = ::exp(x);",
                             "double y = std::pow(x, 2.0);",
                             "double y = __builtin_log(x);",
                             "int r = rand();",
                             "long t = time(nullptr);",
                             "std::cout << 1;",
                             "printf(\"x\");",
                             "if (typeid(a) == t) f();",
                             "auto* d = dynamic_cast<D*>(b);",
                             "thread_local int x;",
                             "std::atomic<int> a;",
                             "exit(1);",
                             "assert(x);",
                             "Eigen::MatrixXd m;",
                             "std::stable_sort(a, b);",
                             "double y = std::floor(x);",
                             "double y = std::fma(a, b, c);",
                             "if (errno == 4) f();"}) {
        EXPECT_GE(count(core_words, "core/solve/a.cpp", "void f() { " + std::string(code) + " }\n"), 1U)
            << code;
        EXPECT_EQ(count(core_words, "hal/linux/a.cpp", "void f() { " + std::string(code) + " }\n"), 0U)
            << code;
    }
}

TEST(PlantedCoreWords, LetsTheRightFormsPass) {
    for (const char* code :
         {"double y = std::sqrt(x);", "double y = rig::exp(x);", "double y = exp(x);",
          "double y = atan2(b, a);", "double s = turn.sin * turn.cos;", "Frame(const Frame&) = delete;",
          "// new, malloc, throw and std::string", "const char* s = \"throw new string\";",
          "double time_us = 0;", "double y = std::abs(x);", "int log = 1;",
          "const double time = frame.time();", "std::string_view s;", "double y = own::floor(x);"}) {
        EXPECT_EQ(count(core_words, "core/solve/a.cpp", "void f() { " + std::string(code) + "\n}\n"), 0U)
            << code;
    }
}

TEST(PlantedCoreGlobals, FindsMutableOnes) {
    EXPECT_EQ(count(core_globals, "core/solve/a.cpp", "namespace rig {\nint calls = 0;\n}\n"), 1U);
    EXPECT_EQ(count(core_globals, "core/solve/a.cpp", "namespace {\nstd::array<int, 4> g_cache{};\n}\n"), 1U);
    EXPECT_EQ(count(core_globals, "core/solve/a.cpp",
                    "int f() {\n    static int calls = 0;\n    return ++calls;\n}\n"),
              1U);
    EXPECT_EQ(count(core_globals, "core/solve/a.cpp",
                    "namespace rig {\nconstexpr int kA = 1;\nconst double kB = 2;\ninline constexpr "
                    "std::array<int, 2> kC{1, 2};\n"
                    "struct S {\n    int x = 0;\n    static int count();\n};\nint f(int a);\nusing T = int;\n"
                    "template <class T>\nvoid g(T t) {\n    static constexpr int kD = 1;\n    int local = "
                    "t;\n}\n}\n"),
              0U);
}

TEST(PlantedProductName, IsInNoIdentifier) {
    EXPECT_EQ(count(product_name, "core/solve/a.cpp", "int headrig_count();\n"), 1U);
    EXPECT_EQ(count(product_name, "core/solve/a.cpp", "namespace HeadRig {}\n"), 1U);
    EXPECT_EQ(count(product_name, "core/solve/a.cpp", "#define HEADRIG_VERSION 1\n"), 1U);
    EXPECT_EQ(count(product_name, "core/solve/a.cpp", "// headrig\nconst char* kName = \"headrig\";\n"), 0U);
}

TEST(PlantedEmptyNames, AreFound) {
    for (const char* code : {"class SolverImpl {};", "struct frame_manager {};", "class Helper;",
                             "void path_utils();", "class LinkManagerBase {};", "int util_count;"}) {
        EXPECT_EQ(count(empty_names, "core/solve/a.cpp", code), 1U) << code;
    }
    EXPECT_EQ(count(empty_names, "core/solve/solve_utils.cpp", "int x();\n"), 1U);
    EXPECT_EQ(
        count(empty_names, "core/solve/a.cpp", "int implicit; int utility; void simple(); bool manages;\n"),
        0U);
}

std::string function_of(int lines) {
    std::string text = "int f() {\n";
    for (int i = 0; i < lines - 2; ++i) text += "    g();\n";
    return text + "}\n";
}

TEST(PlantedSizes, FilesAndFunctions) {
    const auto blank = [](int lines) { return std::string(static_cast<std::size_t>(lines), '\n'); };
    EXPECT_EQ(count(file_lengths, "core/a.cpp", blank(kMaxFileLines)), 0U);
    EXPECT_EQ(count(file_lengths, "core/a.cpp", blank(kMaxFileLines + 1)), 1U);
    EXPECT_EQ(count(function_lengths, "core/a.cpp", function_of(kMaxFunctionLines)), 0U);
    EXPECT_EQ(count(function_lengths, "core/a.cpp", function_of(kMaxFunctionLines + 1)), 1U);
    EXPECT_EQ(count(function_lengths, "core/a.cpp",
                    "class A {\n  public:\n" + function_of(kMaxFunctionLines + 1) + "};\n"),
              1U);
    // Ten short functions are not one long one.
    std::string many;
    for (int i = 0; i < 10; ++i) many += function_of(20);
    EXPECT_EQ(count(function_lengths, "core/a.cpp", many), 0U);
    EXPECT_EQ(measure_functions(planted("core/a.cpp", many + function_of(9))).total, 11);
    EXPECT_EQ(measure_functions(planted("core/a.cpp", many + function_of(9))).under_ten, 1);
}

TEST(PlantedWhitespace, IsFound) {
    EXPECT_EQ(count(whitespace, "core/a.cpp", "int a;\n"), 0U);
    EXPECT_EQ(count(whitespace, "core/a.cpp", "\tint a;\n"), 1U);
    EXPECT_EQ(count(whitespace, "core/a.cpp", "int a; \n"), 1U);
    EXPECT_EQ(count(whitespace, "core/a.cpp", "int a;\r\n"), 1U);
    EXPECT_EQ(count(whitespace, "core/a.cpp", "int a;"), 1U);
}

TEST(PlantedMachinePaths, AreFound) {
    const std::string slash = "/";
    EXPECT_EQ(count(machine_paths, "scripts/a.sh", "cd " + slash + "work/main\n"), 1U);
    EXPECT_EQ(count(machine_paths, "README.md", "see `" + slash + "home/someone/x`\n"), 1U);
    EXPECT_EQ(count(machine_paths, "core/a.cpp", "// \"" + slash + "farm/x\"\n"), 1U);
    EXPECT_EQ(
        count(machine_paths, "README.md", "../shared" + slash + "work/x build" + slash + "root/bin a/work\n"),
        0U);
}

TEST(PlantedHeaderForm, WantsACommentAndAGuard) {
    EXPECT_EQ(count(header_form, "core/base/a.hpp", "// What it is for.\n#pragma once\n"), 0U);
    EXPECT_EQ(count(header_form, "core/base/a.hpp", "#pragma once\n// What it is for.\n"), 2U);
    EXPECT_EQ(count(header_form, "core/base/a.hpp", "// What it is for.\n#ifndef A\n#endif\n"), 1U);
}

TEST(PlantedUnitTests, MirrorCore) {
    SourceTree tree = planted("core/solve/nnls.cpp", "int x();\n");
    ASSERT_EQ(unit_tests(tree).size(), 1U);
    EXPECT_EQ(unit_tests(tree)[0].path, "core/solve/nnls.cpp");
    tree.add("tests/unit/core/nnls_test.cpp", "");
    EXPECT_EQ(unit_tests(tree).size(), 1U);
    tree.add("tests/unit/core/solve/nnls_test.cpp", "");
    EXPECT_TRUE(unit_tests(tree).empty());
}

TEST(PlantedListedSources, AreNamedByABuildFile) {
    SourceTree tree = planted("core/solve/nnls.cpp", "int x();\n");
    tree.add("core/solve/CMakeLists.txt", "rig_core_library(core_solve\n    SOURCES sparse_nnls.cpp)\n");
    EXPECT_EQ(listed_sources(tree).size(), 1U);
    tree.add("core/solve/CMakeLists.txt",
             "rig_core_library(core_solve\n    SOURCES sparse_nnls.cpp nnls.cpp)\n");
    EXPECT_TRUE(listed_sources(tree).empty());
}

TEST(PlantedFolderReadmes, EndWithDecisions) {
    EXPECT_EQ(count(folder_readmes, "core/solve/README.md", "# Solve\n\nText.\n\n## Decisions\n\n- one\n"),
              0U);
    EXPECT_EQ(count(folder_readmes, "core/solve/README.md", "# Solve\n\n## Decisions\n\n## More\n"), 1U);
    EXPECT_EQ(count(folder_readmes, "core/solve/README.md", "# Decisions\n" + std::string(100, '\n')), 1U);
    const Violations missing = folder_readmes(planted("core/track/a.cpp", ""));
    EXPECT_TRUE(std::any_of(missing.begin(), missing.end(),
                            [](const Violation& v) { return v.path == "core/track/README.md"; }));
    // A room that is not written yet owes nothing.
    EXPECT_TRUE(std::none_of(missing.begin(), missing.end(),
                             [](const Violation& v) { return v.path == "boards/README.md"; }));
}

TEST(PlantedFaultCodes, StandOnceEach) {
    const auto faults = [](int from, int to, const std::string& more) {
        std::string text = "enum class Fault {\n";
        for (int i = from; i <= to; ++i)
            text += "kFault" + std::to_string(i) + " = " + std::to_string(i) + ",\n";
        return text + more + "};\n";
    };
    const std::string path = "core/base/faults.hpp";
    EXPECT_EQ(count(fault_codes, path, faults(1, 55, "")), 0U);
    EXPECT_EQ(count(fault_codes, path, faults(2, 55, "")), 1U);
    EXPECT_EQ(count(fault_codes, path, faults(1, 55, "kAgain = 7,\n")), 1U);
    EXPECT_EQ(count(fault_codes, path, faults(1, 56, "")), 1U);
}

TEST(PlantedReadmeCommands, AreRunByCi) {
    const auto violations = [](const std::string& readme, const std::string& ci) {
        SourceTree tree = planted(".ci/run", ci);
        tree.add("README.md", readme);
        return readme_commands(tree).size();
    };
    const std::string demo = "Text.\n```sh\n./scripts/demo --rig a   # real data\n```\n";
    EXPECT_EQ(violations(demo, "run ./scripts/demo --rig a </dev/null\n"), 0U);
    EXPECT_EQ(violations(demo, "run ./scripts/demo\n"), 1U);
    EXPECT_EQ(violations(demo, "# run ./scripts/demo --rig a\n"), 1U);
    EXPECT_EQ(violations(demo, "run ./scripts/demo --rig a --take b\n"), 1U);
    EXPECT_EQ(violations("```sh\n./scripts/flash  # not in CI: needs a board\n```\n", ""), 0U);
    EXPECT_EQ(violations("```sh\n./scripts/flash  # not in CI:\n```\n", ""), 1U);
    EXPECT_EQ(violations("```sh\n./a \\\n  b\n```\n", "./a   b\n"), 0U);
    EXPECT_EQ(violations("```text\n./a\n```\n", ""), 0U);
    EXPECT_EQ(readme_commands(planted(".ci/run", "")).size(), 1U);
}

}  // namespace
}  // namespace rig::hygiene
