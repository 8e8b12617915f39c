#include "firmware_host/companion/rig_folder/take_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "core/base/check.hpp"
#include "firmware_host/companion/files/csv.hpp"
#include "firmware_host/companion/files/whole_file.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLeadingColumns = 2;         // frame, time_s
constexpr std::size_t kMaxTakeFrames = 4'000'000;  // 18 hours at 60 Hz
constexpr double kMaxWeight = 100.0;     // anything beyond is a percentage or a fault, never a weight
constexpr double kDefaultRateHz = 60.0;  // of a take of one frame
// time_s is written with microseconds at best and milliseconds at worst.
constexpr double kTimeToleranceS = 1.0e-3;

// For each column of the file, where its values go in a frame.
Result<std::vector<std::size_t>, FileError> match_columns(const NumericTable& table, const fs::path& name,
                                                          const std::vector<std::string>& shape_names) {
    if (table.columns.size() < kLeadingColumns || table.columns[0] != "frame" ||
        table.columns[1] != "time_s") {
        return file_failure_at(name, 1, "a take starts with the columns frame,time_s");
    }
    std::unordered_map<std::string_view, std::size_t> index_of;
    for (std::size_t s = 0; s < shape_names.size(); ++s) index_of.emplace(shape_names[s], s);
    std::vector<std::size_t> target;
    for (std::size_t c = kLeadingColumns; c < table.columns.size(); ++c) {
        const auto found = index_of.find(table.columns[c]);
        if (found == index_of.end()) {
            return file_failure_at(name, 1,
                                   fmt::format("the rig has no shape '{}'", printable(table.columns[c])));
        }
        target.push_back(found->second);
    }
    if (target.empty()) return file_failure_at(name, 1, "there is no column of weights");
    return target;
}

double value_at(const NumericTable& table, std::size_t row, std::size_t column) {
    return table.values[row * table.columns.size() + column];
}

// Frames count up from the first by one, times are even; the rate follows from the first and the last.
Result<double, FileError> check_times(const NumericTable& table, const fs::path& name) {
    const std::size_t last = table.row_count - 1;
    const double start_s = value_at(table, 0, 1);
    const double span_s = value_at(table, last, 1) - start_s;
    if (last > 0 && !(span_s > 0.0)) return file_failure(name, "time_s does not rise");
    const double rate_hz = last > 0 ? static_cast<double>(last) / span_s : kDefaultRateHz;
    for (std::size_t row = 0; row <= last; ++row) {
        if (value_at(table, row, 0) != value_at(table, 0, 0) + static_cast<double>(row)) {
            return file_failure_at(name, row + 2, "column 'frame' does not count up by one");
        }
        const double expected_s = start_s + static_cast<double>(row) / rate_hz;
        if (std::abs(value_at(table, row, 1) - expected_s) > kTimeToleranceS) {
            return file_failure_at(name, row + 2,
                                   fmt::format("time_s is {}, expected {:.6f} at an even rate of {:.3f} Hz",
                                               value_at(table, row, 1), expected_s, rate_hz));
        }
    }
    // Times rounded to microseconds put the quotient a hair beside the rate that was meant.
    const double whole_hz = std::round(rate_hz);
    const double rounding = std::min(5.0e-4, kTimeToleranceS / span_s);  // 59.94 Hz is 1e-3 away from 60
    return last > 0 && whole_hz > 0.0 && std::abs(rate_hz - whole_hz) < rounding * whole_hz ? whole_hz
                                                                                            : rate_hz;
}

}  // namespace

Result<Take, FileError> parse_take(std::string_view text, const fs::path& name,
                                   const std::vector<std::string>& shape_names) {
    const auto table = parse_numeric_csv(text, name);
    if (!table) return failure(table.error());
    const auto target = match_columns(*table, name, shape_names);
    if (!target) return failure(target.error());
    if (table->row_count == 0) return file_failure(name, "the take has no frames");
    if (table->row_count > kMaxTakeFrames) return file_failure(name, "the take is too long");
    const auto rate_hz = check_times(*table, name);
    if (!rate_hz) return failure(rate_hz.error());
    Take take{
        .shape_names = shape_names, .rate_hz = *rate_hz, .frame_count = table->row_count, .weights = {}};
    take.weights.assign(take.frame_count * shape_names.size(), 0.0F);
    for (std::size_t frame = 0; frame < take.frame_count; ++frame) {
        for (std::size_t c = 0; c < target->size(); ++c) {
            const double weight = value_at(*table, frame, kLeadingColumns + c);
            if (std::abs(weight) > kMaxWeight) {
                return file_failure_at(name, frame + 2,
                                       fmt::format("column '{}' is {}, not a weight (1 is the full shape)",
                                                   printable(table->columns[kLeadingColumns + c]), weight));
            }
            take.weights[frame * shape_names.size() + (*target)[c]] = static_cast<float>(weight);
        }
    }
    return take;
}

Result<Take, FileError> load_take(const fs::path& csv, const Rig& rig) {
    const auto text = read_whole_text(csv);
    if (!text) return failure(text.error());
    std::vector<std::string> shape_names;
    for (const SparseShape& shape : rig.shapes) shape_names.push_back(shape.name);
    return parse_take(*text, csv, shape_names);
}

Result<void, FileError> save_take(const fs::path& csv, const Take& take) {
    RIG_CHECK(take.weights.size() == take.frame_count * take.shape_names.size());
    std::vector<std::string> columns{"frame", "time_s"};
    columns.insert(columns.end(), take.shape_names.begin(), take.shape_names.end());
    CsvWriter writer{columns};
    for (std::size_t frame = 0; frame < take.frame_count; ++frame) {
        writer.integer(static_cast<std::int64_t>(frame)).number(static_cast<double>(frame) / take.rate_hz, 6);
        for (std::size_t s = 0; s < take.shape_names.size(); ++s) {
            writer.number(static_cast<double>(take.weights[frame * take.shape_names.size() + s]), 5);
        }
        writer.end_row();
    }
    return writer.save(csv);
}

}  // namespace rig::host
