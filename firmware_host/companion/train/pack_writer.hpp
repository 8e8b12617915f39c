// A SolvePack to the bytes of a pack file. Not a judgement: open_pack() of the same bytes is.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "core/pack/pack_format.hpp"
#include "core/pack/solve_pack.hpp"
#include "firmware_host/companion/files/npy.hpp"

namespace rig::host {

struct PackIdentity {
    std::string name = "pack";
    std::uint32_t pack_version = 1;
    std::uint32_t security_counter = 0;
    std::vector<std::string> boards{};  // compatible boards by name; empty: any
};

// Bytes that open_pack() takes when the numbers in `pack` pass its checks; the writer itself checks nothing,
// so that tests can make packs that must be refused. Counts come from the counts of `pack`, lengths from its
// spans. The pack's UUID is taken from the hashes of its sections: the same contents make the same file.
[[nodiscard]] std::vector<std::byte> write_pack(const SolvePack& pack, const PackIdentity& identity,
                                                HashFunction hash);

// write_pack() with SHA-256, verified by opening it again, then into `path` by writing beside it and
// renaming.
[[nodiscard]] Result<void, FileError> save_pack(const std::filesystem::path& path, const SolvePack& pack,
                                                const PackIdentity& identity);

}  // namespace rig::host
