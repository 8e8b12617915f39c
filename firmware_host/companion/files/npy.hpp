// NumPy .npy version 1 files: little-endian, C order. Not for .npz archives or structured types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/base/bytes.hpp"
#include "firmware_host/companion/files/file_error.hpp"

namespace rig::host {

template <class T>
struct NpyArray {
    std::vector<std::size_t> shape;
    std::vector<T> values;  // row-major
};

// T: float, double, std::int32_t, std::uint8_t, std::int16_t. The file's type must be exactly T, except that
// a double file may be read as float. Refuses: wrong magic, other versions, Fortran order, big-endian, header
// or data truncated, trailing bytes, more than 2^31 elements or 8 dimensions. NaN and infinity pass: who
// reads decides.
template <class T>
[[nodiscard]] Result<NpyArray<T>, FileError> read_npy(const std::filesystem::path& path);

// The same from the bytes of a file; `name` stands for the file in errors.
template <class T>
[[nodiscard]] Result<NpyArray<T>, FileError> parse_npy(ByteSpan bytes, const std::filesystem::path& name);

// The product of shape must be the number of values. The same array always gives the same bytes.
template <class T>
[[nodiscard]] Result<void, FileError> write_npy(const std::filesystem::path& path, const NpyArray<T>& array);

}  // namespace rig::host
