#include "tests/support/solver_problems.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/base/math.hpp"
#include "tests/support/random.hpp"

namespace rig::test {

namespace {

struct Bump {
    double x, y, radius;
    std::array<double, 3> direction;
};

constexpr double kMostCorrelation = 0.9;
constexpr double kNoiseShare = 0.002;

// A family member: the head of the family moved, resized and turned as far as `likeness` allows.
Bump member_of(const Bump& head, double likeness, SeededRandom& random) {
    Bump own = head;
    const double stray = 1.0 - likeness;
    own.x += 0.8 * stray * random.normal(0.0, 1.0);
    own.y += 0.8 * stray * random.normal(0.0, 1.0);
    own.radius *= random.uniform(0.85, 1.15);
    for (double& d : own.direction) d += 0.8 * std::sqrt(stray) * random.normal(0.0, 1.0);
    return own;
}

std::vector<double> column_of(const Bump& bump, const std::vector<std::array<double, 2>>& cloud) {
    std::vector<double> column;
    for (const auto& at : cloud) {
        const double dx = at[0] - bump.x;
        const double dy = at[1] - bump.y;
        const double height = rig::exp(-(dx * dx + dy * dy) / (bump.radius * bump.radius));
        for (const double d : bump.direction) column.push_back(d * height);
    }
    return column;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
    double ab = 0.0, aa = 0.0, bb = 0.0;
    for (std::size_t r = 0; r < a.size(); ++r) {
        ab += a[r] * b[r];
        aa += a[r] * a[r];
        bb += b[r] * b[r];
    }
    return std::fabs(ab) / std::sqrt(aa * bb);
}

void make_basis(SolverTrajectory& problem, SeededRandom& random) {
    std::vector<std::array<double, 2>> cloud(problem.rows / 3);
    for (auto& at : cloud) at = {random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)};
    std::vector<std::vector<double>> columns;
    while (columns.size() < problem.shapes) {
        const Bump head{random.uniform(-1.0, 1.0),
                        random.uniform(-1.0, 1.0),
                        random.uniform(0.25, 0.75),
                        {random.normal(0.0, 1.0), random.normal(0.0, 1.0), random.normal(0.0, 1.0)}};
        const std::size_t family = 2 + random.below(3);
        const std::size_t first = columns.size();
        while (columns.size() < std::min(first + family, problem.shapes)) {
            std::vector<double> column = column_of(member_of(head, random.uniform(0.5, 0.9), random), cloud);
            const bool too_like = std::any_of(columns.begin(), columns.end(), [&](const auto& other) {
                return correlation(column, other) > kMostCorrelation;
            });
            if (!too_like) columns.push_back(std::move(column));
        }
    }
    double squares = 0.0;
    for (const auto& column : columns) {
        for (const double b : column) squares += b * b;
    }
    const double scale = std::sqrt(static_cast<double>(problem.shapes) / squares);
    problem.basis.resize(problem.rows * problem.shapes);
    for (std::size_t r = 0; r < problem.rows; ++r) {
        for (std::size_t i = 0; i < problem.shapes; ++i) {
            problem.basis[r * problem.shapes + i] =
                static_cast<double>(static_cast<float>(scale * columns[i][r]));
        }
    }
}

// Keeps 5 to 20 events going: a new one begins when fewer than a wandering target are.
void make_performance(SolverTrajectory& problem, std::size_t frames, SeededRandom& random) {
    problem.weights.assign(frames, std::vector<double>(problem.shapes, 0.0));
    std::vector<std::size_t> ends;
    for (std::size_t f = 0; f < frames; ++f) {
        std::erase_if(ends, [f](std::size_t end) { return end <= f; });
        const double wave = sin_cos(static_cast<double>(f) * 2.0 * std::numbers::pi / 500.0).sin;
        const auto wanted = static_cast<std::size_t>(12.5 + 7.5 * wave);
        while (ends.size() < wanted) {
            const std::size_t shape = random.below(problem.shapes);
            const std::size_t length = 30 + random.below(61);
            const double height = random.uniform(0.3, 1.0);
            for (std::size_t k = 0; k < length && f + k < frames; ++k) {
                const double phase =
                    2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
                double& w = problem.weights[f + k][shape];
                w = std::min(1.0, w + 0.5 * height * (1.0 - sin_cos(phase).cos));
            }
            ends.push_back(f + length);
        }
    }
}

}  // namespace

SolverTrajectory make_solver_trajectory(std::size_t rows, std::size_t shapes, std::size_t frames,
                                        std::uint64_t seed) {
    SeededRandom random(seed);
    SolverTrajectory problem;
    problem.rows = rows;
    problem.shapes = shapes;
    make_basis(problem, random);
    make_performance(problem, frames, random);
    double squares = 0.0;
    for (const auto& w : problem.weights) {
        std::vector<double> t(rows, 0.0);
        for (std::size_t r = 0; r < rows; ++r) {
            for (std::size_t i = 0; i < shapes; ++i) t[r] += problem.basis[r * shapes + i] * w[i];
            squares += t[r] * t[r];
        }
        problem.targets.push_back(std::move(t));
    }
    const double noise = kNoiseShare * std::sqrt(squares / static_cast<double>(rows * frames));
    for (auto& t : problem.targets) {
        for (double& x : t) x += random.normal(0.0, noise);
    }
    return problem;
}

std::vector<double> gram_of(const SolverTrajectory& problem, double diagonal) {
    const std::size_t n = problem.shapes;
    std::vector<double> gram(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            double sum = 0.0;
            for (std::size_t r = 0; r < problem.rows; ++r) {
                sum += problem.basis[r * n + i] * problem.basis[r * n + j];
            }
            gram[i * n + j] = gram[j * n + i] = sum + (i == j ? diagonal : 0.0);
        }
    }
    return gram;
}

}  // namespace rig::test
