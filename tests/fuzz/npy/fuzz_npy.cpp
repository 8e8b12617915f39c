// Any bytes as a .npy file of every type: an array whose shape and values agree, or an error.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "firmware_host/companion/files/npy.hpp"

namespace {

template <class T>
void read_as(std::span<const std::byte> bytes) {
    const auto array = rig::host::parse_npy<T>(bytes, "fuzz.npy");
    if (!array) {
        if (array.error().message.find("fuzz.npy") == std::string::npos) std::abort();
        return;
    }
    std::size_t count = 1;
    for (const std::size_t size : array->shape) count *= size;
    if (count != array->values.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const auto bytes = std::as_bytes(std::span{data, size});
    read_as<float>(bytes);
    read_as<double>(bytes);
    read_as<std::int32_t>(bytes);
    read_as<std::int16_t>(bytes);
    read_as<std::uint8_t>(bytes);
    return 0;
}
