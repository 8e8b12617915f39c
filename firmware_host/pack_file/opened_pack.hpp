// A pack file, mapped read-only and verified, for every program that solves: headrigd, headrig solve, headrig
// pack info. Not for writing packs: firmware_host/companion/train/pack_writer.hpp.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/bytes.hpp"
#include "core/base/result.hpp"
#include "core/pack/manifest.hpp"
#include "core/pack/solve_pack.hpp"

namespace rig {

// One sentence that names the file, the fault and, where there is one, the remedy.
struct PackFileError {
    std::string message;
};

// Owns the bytes that its SolvePack points into; moving it leaves those bytes where they are. Another program
// must not shorten a mapped file: replace packs by writing beside them and renaming, never in place.
class OpenedPack {
  public:
    OpenedPack(OpenedPack&&) noexcept = default;
    OpenedPack& operator=(OpenedPack&&) noexcept = default;

    [[nodiscard]] const SolvePack& pack() const { return pack_; }
    [[nodiscard]] const PackManifest& manifest() const { return manifest_; }
    [[nodiscard]] ByteSpan bytes() const { return {bytes_.get(), bytes_.get_deleter().size}; }

  private:
    struct Release {
        std::size_t size = 0;
        bool mapped = false;
        void operator()(const std::byte* bytes) const;
    };
    using Bytes = std::unique_ptr<const std::byte, Release>;
    OpenedPack(Bytes bytes, const PackManifest& manifest, const SolvePack& pack)
        : bytes_(std::move(bytes)), manifest_(manifest), pack_(pack) {}
    static Result<OpenedPack, PackFileError> verify(Bytes bytes, const std::string& name);

    Bytes bytes_;
    PackManifest manifest_;
    SolvePack pack_;

    friend Result<OpenedPack, PackFileError> open_pack_file(const std::filesystem::path& path);
    friend Result<OpenedPack, PackFileError> open_pack_copy(ByteSpan bytes, const std::string& name);
};

// Maps and verifies. Allocates; call it before seal().
[[nodiscard]] Result<OpenedPack, PackFileError> open_pack_file(const std::filesystem::path& path);

// The same for bytes in memory, which are copied; `name` stands for the path in messages.
[[nodiscard]] Result<OpenedPack, PackFileError> open_pack_copy(ByteSpan bytes, const std::string& name);

}  // namespace rig
