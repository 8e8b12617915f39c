#include "firmware_host/pack_file/sha256.hpp"

#include <sodium/crypto_hash_sha256.h>

namespace rig {

static_assert(crypto_hash_sha256_BYTES == kHashBytes);

void sha256(ByteSpan bytes, Hash& digest) {
    crypto_hash_sha256(reinterpret_cast<unsigned char*>(digest.data()),
                       reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

}  // namespace rig
