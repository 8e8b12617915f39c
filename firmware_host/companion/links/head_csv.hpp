// Where the head was, of a rig whose cameras are not on it: one row a received state, beside its weights.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>

#include "core/base/face_state.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

// frame,time_s,status,turn_{x,y,z}_rad,place_{x,y,z}_mm,sigma_turn_{x,y,z}_rad,sigma_place_{x,y,z}_mm,rms_px,points.
// frame as in the table of weights; time_s: mid-exposure of the frame's own pictures minus that of the first
// row, unlike the weights' time neither smoothed nor held. Rotation vector, reference = R face + place, in
// the frame of the cameras' places. All after the status is empty where the pose is not known.
class HeadCsv {
  public:
    [[nodiscard]] static Result<HeadCsv, FileError> create(const std::filesystem::path& path);
    [[nodiscard]] Result<void, FileError> add(const FaceState& state);
    [[nodiscard]] Result<void, FileError> close();
    [[nodiscard]] std::uint64_t row_count() const { return row_count_; }
    [[nodiscard]] std::uint64_t known_count() const { return known_count_; }

  private:
    explicit HeadCsv(const std::filesystem::path& path) : path_(path), file_(path, std::ios::binary) {}

    std::filesystem::path path_;
    std::ofstream file_;
    std::optional<std::uint32_t> first_sequence_;
    std::optional<std::int64_t> first_capture_us_;
    std::uint64_t row_count_ = 0;
    std::uint64_t known_count_ = 0;
};

// "take.csv" -> "take.head.csv"
[[nodiscard]] std::filesystem::path head_csv_path(const std::filesystem::path& weights_csv);

}  // namespace rig::host
