#include "firmware_host/companion/links/weights_csv.hpp"

#include <fmt/format.h>

#include <iterator>

namespace rig::host {

namespace {

std::string column_name(const std::string& shape) {
    std::string name = shape;
    for (std::size_t i = 0; i < name.size(); ++i) {
        const bool blank_at_edge = name[i] == ' ' && (i == 0 || i + 1 == name.size());
        if (name[i] == ',' || name[i] == '"' || blank_at_edge) name[i] = '_';
    }
    return name;
}

}  // namespace

Result<WeightsCsv, FileError> WeightsCsv::create(const std::filesystem::path& path,
                                                 const std::vector<std::string>& shape_names) {
    WeightsCsv csv(path, shape_names.size());
    csv.file_ << "frame,time_s";
    for (const std::string& name : shape_names) csv.file_ << ',' << column_name(name);
    csv.file_ << '\n' << std::flush;
    if (!csv.file_) return file_failure(path, "cannot be written: does its folder exist, and is there room?");
    return csv;
}

Result<bool, FileError> WeightsCsv::add(const FaceState& state) {
    if (state.shape_count != shape_count_) return false;
    if (!first_sequence_) {
        first_sequence_ = state.sequence;
        first_capture_us_ = state.capture_us;
    }
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{},{:.6f}",
                   static_cast<std::int32_t>(state.sequence - *first_sequence_),
                   static_cast<double>(state.capture_us - first_capture_us_) * 1e-6);
    for (std::size_t i = 0; i < shape_count_; ++i) {
        fmt::format_to(std::back_inserter(line), ",{:.5f}", state.weights[i]);
    }
    line.push_back('\n');
    file_.write(line.data(), static_cast<std::streamsize>(line.size()));
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    ++row_count_;
    return true;
}

Result<void, FileError> WeightsCsv::close() {
    file_.close();
    if (!file_) return file_failure(path_, "writing failed: is the disk full?");
    return {};
}

}  // namespace rig::host
