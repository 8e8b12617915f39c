// Deng06 section 5: "we set the reduced dimensionality to four, which covers 90.21 % of the variation".
#include <fmt/format.h>

#include "firmware_host/companion/experiments/experiment.hpp"
#include "firmware_host/companion/experiments/performance.hpp"
#include "firmware_host/companion/train/rbf_training.hpp"

namespace rig::host {

namespace {

constexpr double kSourceShare = 0.9021;
constexpr std::size_t kSourceComponents = 4;

std::vector<std::string> row_of(std::string name, const std::vector<double>& shares) {
    double sum = 0.0;
    double at_four = 0.0;
    std::size_t needed = 0;
    std::string each;
    for (std::size_t a = 0; a < shares.size(); ++a) {
        sum += shares[a];
        if (a < 6) each += fmt::format("{}{:.1f}", each.empty() ? "" : " ", 100.0 * shares[a]);
        if (a + 1 == kSourceComponents) at_four = sum;
        if (needed == 0 && sum >= kSourceShare) needed = a + 1;
    }
    return {std::move(name), fmt::format("{:.2f} %", 100.0 * at_four),
            needed > 0 ? std::to_string(needed) : "more", each};
}

}  // namespace

Result<ExperimentTable, FileError> deng06_variance(const std::filesystem::path& data) {
    ExperimentTable out;
    out.columns = {"take, markers", "in four components", "components for 90.21 %", "first six, %"};
    for (const char* layout : {"60", "102"}) {
        const auto head = load_recorded_head(data, layout);
        if (!head) return failure(head.error());
        for (const auto& [name, take] :
             {std::pair{"range of motion", &head->range_of_motion}, std::pair{"speech", &head->speech}}) {
            const auto trained = train_rbf(head->model.neutral_mm, head->model.basis_mm, std::span(take, 1),
                                           0.1, {.centres = 20, .dimensions = kSourceComponents}, {});
            if (!trained) return failure(trained.error());
            out.rows.push_back(row_of(fmt::format("{}, {}", name, layout), trained->report.variance_shares));
        }
    }
    out.remarks = {
        "The source: four components, 90.21 %, 102 markers, one performer's speech and expressions."};
    return out;
}

}  // namespace rig::host
