// Any bytes as a pack. The hash is replaced by zeros, and the corpus has zeros for hashes, so that mutations
// get past the hashes to everything behind them.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "core/pack/open_pack.hpp"

namespace {

void no_hash(rig::ByteSpan, rig::Hash& digest) {
    digest.fill(std::byte{0});
}

void require(bool holds) {
    if (!holds) std::abort();
}

void require_finite(std::span<const float> values, std::size_t count) {
    require(values.size() == count);
    for (const float x : values) require(std::isfinite(x));
}

// What open_pack() promises of a pack that it lets through.
void check_promises(const rig::SolvePack& pack) {
    const std::size_t m = pack.marker_count;
    const std::size_t n = pack.shape_count;
    require(m >= rig::kMinMarkers && m <= rig::kMaxMarkers && n >= 1 && n <= rig::kMaxShapes);
    require_finite(pack.neutral_mm, 3 * m);
    require_finite(pack.basis_mm, 3 * m * n);
    for (const auto& values :
         {pack.weight_low, pack.weight_high, pack.prior_mean, pack.prior_sigma, pack.temporal_gamma}) {
        require_finite(values, n);
    }
    for (std::size_t i = 0; i < n; ++i) {
        require(pack.weight_low[i] <= pack.weight_high[i] && pack.prior_sigma[i] > 0.0F &&
                pack.temporal_gamma[i] >= 0.0F);
        require(!pack.shape_names[i].empty() && pack.shape_names[i].size() <= rig::kMaxNameBytes);
    }
    for (std::size_t k = 0; k < m; ++k) require(!pack.marker_names[k].empty());
    require(pack.camera_count <= rig::kMaxCameras);
    for (std::size_t c = 0; c < pack.camera_count; ++c)
        require(pack.cameras[c].fx_px > 0.0 && pack.cameras[c].width_px > 0);
    const rig::RbfModel& rbf = pack.rbf;
    require(rbf.dimension_count <= rig::kMaxRbfDimensions && rbf.centre_count <= rig::kMaxRbfCentres);
    require_finite(rbf.centres, std::size_t{rbf.centre_count} * rbf.dimension_count);
    require_finite(rbf.weights, rbf.centre_count * n);
    for (const float width : rbf.widths_mm) require(width > 0.0F);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    void* start = nullptr;
    require(::posix_memalign(&start, rig::kPackAlignment, size == 0 ? 1 : size) == 0);
    const std::unique_ptr<void, void (*)(void*)> owner(start, &std::free);
    if (size > 0) std::memcpy(start, data, size);
    const rig::ByteSpan bytes(static_cast<const std::byte*>(start), size);
    if (const auto pack = rig::open_pack(bytes, no_hash)) check_promises(*pack);
    return 0;
}
