#include "firmware_host/companion/report/data_uri.hpp"

#include <sodium.h>

namespace rig::host {

std::string data_uri(std::string_view media_type, std::span<const std::uint8_t> bytes) {
    std::string coded(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
    sodium_bin2base64(coded.data(), coded.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
    coded.pop_back();  // the terminating zero
    return "data:" + std::string(media_type) + ";base64," + coded;
}

}  // namespace rig::host
