#include "tests/support/published_problems.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

namespace rig::test {

namespace {

using Numbers = std::vector<long double>;

constexpr std::array kWords{"name", "kind", "form"};
constexpr std::array kNumbers{"size",
                              "rows",
                              "matrix",
                              "target",
                              "hessian",
                              "linear",
                              "constant",
                              "low",
                              "high",
                              "optimum",
                              "optimum_half_unit",
                              "objective",
                              "objective_half_unit",
                              "norm",
                              "norm_half_unit"};

// The words of a file, comments taken off, as numbers behind the keyword they follow.
struct Fields {
    std::map<std::string, Numbers> numbers;
    std::map<std::string, std::string> words;  // the values of name, kind and form
};

bool read_number(const std::string& word, long double& out) {
    char* end = nullptr;
    out = std::strtold(word.c_str(), &end);
    return end != word.c_str() && *end == '\0' && !std::isnan(out);
}

bool read_fields(std::istream& in, Fields& out) {
    std::string line;
    std::string key;
    while (std::getline(in, line)) {
        std::istringstream words(line.substr(0, line.find('#')));
        std::string word;
        while (words >> word) {
            long double number = 0.0L;
            if (std::ranges::find(kWords, key) != kWords.end()) {
                out.words[key] = word;
                key.clear();
            } else if (read_number(word, number)) {
                if (key.empty()) return false;
                out.numbers[key].push_back(number);
            } else {
                key = word;
                if (out.numbers.contains(key) || out.words.contains(key)) return false;
                if (std::ranges::find(kWords, key) != kWords.end()) continue;
                if (std::ranges::find(kNumbers, key) == kNumbers.end()) return false;
                out.numbers[key] = {};
            }
        }
    }
    return true;
}

// As many numbers as wanted behind the keyword.
bool take(const Fields& fields, const std::string& key, std::size_t count, Numbers& out) {
    const auto found = fields.numbers.find(key);
    if (found == fields.numbers.end() || found->second.size() != count) return false;
    out = found->second;
    return true;
}

bool take_one(const Fields& fields, const std::string& key, long double& out) {
    Numbers one;
    if (!take(fields, key, 1, one)) return false;
    out = one[0];
    return true;
}

bool read_least_squares(const Fields& fields, PublishedProblem& problem) {
    long double count = 0.0L;
    if (!take_one(fields, "rows", count) || count < 1.0L) return false;
    const auto rows = static_cast<std::size_t>(count);
    const std::size_t n = problem.size;
    Numbers a;
    Numbers b;
    if (!take(fields, "matrix", rows * n, a) || !take(fields, "target", rows, b)) return false;
    problem.hessian.assign(n * n, 0.0L);
    problem.linear.assign(n, 0.0L);
    for (std::size_t r = 0; r < rows; ++r) {
        problem.constant += b[r] * b[r];
        for (std::size_t i = 0; i < n; ++i) {
            problem.linear[i] -= 2.0L * a[r * n + i] * b[r];
            for (std::size_t j = 0; j < n; ++j)
                problem.hessian[i * n + j] += 2.0L * a[r * n + i] * a[r * n + j];
        }
    }
    return true;
}

bool read_answer(const Fields& fields, PublishedProblem& problem) {
    if (fields.numbers.contains("optimum")) {
        if (!take(fields, "optimum", problem.size, problem.optimum)) return false;
        if (!take_one(fields, "optimum_half_unit", problem.optimum_half_unit)) return false;
    }
    if (fields.numbers.contains("objective")) {
        problem.has_objective = true;
        if (!take_one(fields, "objective", problem.objective)) return false;
        if (!take_one(fields, "objective_half_unit", problem.objective_half_unit)) return false;
    }
    long double norm = 0.0L;
    if (take_one(fields, "norm", norm)) {  // |A x - b|
        long double half = 0.0L;
        if (problem.has_objective || !take_one(fields, "norm_half_unit", half)) return false;
        problem.has_objective = true;
        problem.objective = norm * norm;
        problem.objective_half_unit = 2.0L * norm * half + half * half;
    }
    return problem.has_objective || !problem.optimum.empty();
}

bool read_problem(std::istream& in, PublishedProblem& problem) {
    Fields fields;
    if (!read_fields(in, fields)) return false;
    problem.name = fields.words["name"];
    const std::string kind = fields.words["kind"];
    const std::string form = fields.words["form"];
    if (problem.name.empty() || (kind != "box" && kind != "simplex")) return false;
    problem.kind = kind == "box" ? PublishedKind::kBox : PublishedKind::kSimplex;
    long double size = 0.0L;
    if (!take_one(fields, "size", size) || size < 1.0L) return false;
    problem.size = static_cast<std::size_t>(size);
    const std::size_t n = problem.size;
    if (form == "least_squares") {
        if (!read_least_squares(fields, problem)) return false;
    } else if (form != "quadratic" || !take(fields, "hessian", n * n, problem.hessian) ||
               !take(fields, "linear", n, problem.linear) ||
               !take_one(fields, "constant", problem.constant)) {
        return false;
    }
    return take(fields, "low", n, problem.low) && take(fields, "high", n, problem.high) &&
           read_answer(fields, problem);
}

}  // namespace

long double PublishedProblem::value(const std::vector<long double>& x) const {
    long double sum = constant;
    for (std::size_t i = 0; i < size; ++i) {
        long double row = linear[i];
        for (std::size_t j = 0; j < size; ++j) row += 0.5L * hessian[i * size + j] * x[j];
        sum += row * x[i];
    }
    return sum;
}

std::vector<long double> PublishedProblem::gradient(const std::vector<long double>& x) const {
    std::vector<long double> out = linear;
    for (std::size_t i = 0; i < size; ++i) {
        for (std::size_t j = 0; j < size; ++j) out[i] += hessian[i * size + j] * x[j];
    }
    return out;
}

PublishedProblems load_published_problems(const std::filesystem::path& folder) {
    PublishedProblems out;
    std::vector<std::filesystem::path> files;
    std::error_code error;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
        if (entry.path().extension() == ".txt") files.push_back(entry.path());
    }
    std::ranges::sort(files);
    for (const std::filesystem::path& file : files) {
        std::ifstream in(file);
        PublishedProblem problem;
        if (!read_problem(in, problem) || problem.name != file.stem()) {
            out.fault = file.filename().string() + " is not a published problem as the README has it";
            return out;
        }
        out.problems.push_back(std::move(problem));
    }
    if (files.empty()) out.fault = folder.string() + " holds no problems";
    return out;
}

PublishedProblems load_published_problems() {
    return load_published_problems(std::filesystem::path(RIG_SOURCE_FOLDER) / "tests" / "data" /
                                   "published_problems");
}

}  // namespace rig::test
