// The host's table of received weights, written as it comes: `frame,time_s,<shape names>`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "core/base/face_state.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// frame: the state's sequence minus the first one's, so a lost state is a gap; time_s: capture time minus the
// first one's, so a held state repeats a time; both go back when a board restarts in the middle. A comma,
// quote or blank at the edge of a shape's name becomes
// '_'.
class WeightsCsv {
  public:
    [[nodiscard]] static Result<WeightsCsv, FileError> create(const std::filesystem::path& path,
                                                              const std::vector<std::string>& shape_names);

    // False: nothing written, because the state has another number of shapes than there are names.
    [[nodiscard]] Result<bool, FileError> add(const FaceState& state);
    [[nodiscard]] Result<void, FileError> close();
    [[nodiscard]] std::uint64_t row_count() const { return row_count_; }

  private:
    WeightsCsv(const std::filesystem::path& path, std::size_t shape_count)
        : path_(path), file_(path, std::ios::binary), shape_count_(shape_count) {}

    std::filesystem::path path_;
    std::ofstream file_;
    std::size_t shape_count_;
    std::optional<std::uint32_t> first_sequence_;
    std::int64_t first_capture_us_ = 0;
    std::uint64_t row_count_ = 0;
};

}  // namespace rig::host
