// NumPy .npy version 1 files: little-endian, C order.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"

namespace rig::host {

// Why a file could not be read or written: names the file, the fault and, where there is one, the remedy.
struct FileError {
    std::string message;
};

template <class T>
struct NpyArray {
    std::vector<std::size_t> shape;
    std::vector<T> values;  // row-major
};

// T: float, double, std::int32_t, std::uint8_t, std::int16_t. The file's type must be exactly T, except that a double
// file may be read as float. Refuses: wrong magic, Fortran order, big-endian, header or data truncated, trailing bytes,
// more than 2^31 elements.
template <class T>
[[nodiscard]] Result<NpyArray<T>, FileError> read_npy(const std::filesystem::path& path);

template <class T>
[[nodiscard]] Result<void, FileError> write_npy(const std::filesystem::path& path, const NpyArray<T>& array);

}  // namespace rig::host
