// Measures one blob: its own background plane, its own mid-contrast outline, shape, and a centre that does
// not depend on the threshold that found it. Not for: finding blobs, or deciding among them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/detect/bit_rows.hpp"
#include "core/detect/components.hpp"
#include "core/image/view.hpp"
#include "core/limits.hpp"

namespace rig {

// Why a blob is no marker. kNone: it may be one.
enum class Rejection : std::uint8_t {
    kNone = 0,
    kSmall,      // fewer pixels than the smallest disc, or none at mid contrast
    kLarge,      // longer than the largest disc
    kEdge,       // reaches the border of the image: part of it is unseen
    kFaint,      // too little contrast against its surroundings or the noise
    kElongated,  // a line, a wrinkle, a disc seen too flat to trust
    kIrregular,  // outline is no ellipse: merged dots, corners, hair
    kOpen,       // not surrounded by background: the end or the bend of something larger
    kSeveral,    // falls into pieces at mid contrast
    kOddSize,    // much larger or smaller than the other markers of the image
    kCount
};

struct BlobLimits {
    double min_diameter_px = 3.0;    // of the disc of equal area
    double max_diameter_px = 28.0;   // long axis
    double min_contrast = 10.0;      // grey levels
    double max_aspect = 4.5;         // long axis / short axis
    double max_deviation_px = 0.17;  // mean distance of the outline from the ellipse of equal moments, plus
    double max_deviation = 0.03;     // this part of the mean radius
    double max_open = 0.22;          // part of the moat that is not background
    double usual_size_px = 0.0;      // long axis of the image's markers; 0: unknown, nothing is completed
    double usual_depth = 0.0;        // of their depths
    bool is_lobe = false;            // sticks out of something larger, its sibling
};

// The least pixels a disc of the least diameter shows above mid contrast, with a margin for blur.
[[nodiscard]] constexpr std::uint32_t least_area_px(const BlobLimits& limits) {
    const double area = 0.5 * 0.785398 * limits.min_diameter_px * limits.min_diameter_px;
    return area < 2.0 ? 2U : static_cast<std::uint32_t>(area);
}

struct Blob {
    double x_px = 0.0;
    double y_px = 0.0;
    double diameter_px = 0.0;   // of the disc of equal area
    double long_axis_px = 0.0;  // diameters of the ellipse of equal moments
    double short_axis_px = 0.0;
    double xx = 0.0;  // second moments of that ellipse, px^2
    double xy = 0.0;
    double yy = 0.0;
    bool hidden = false;     // something that is neither paint nor skin lies on it
    bool completed = false;  // from a part of its outline
    double filled_in = 0.0;  // part of its weight that was not seen
    double contrast = 0.0;   // grey levels between blob and background
    double snr = 0.0;        // contrast / rms of the surroundings about their plane, of a grey level at least
    double background = 0.0;  // grey level at the centre
    double deviation = 0.0;
    double open = 0.0;
    double depth =
        0.0;  // contrast / light: the part of the skin's light that the ink takes, or the paint adds
    double slope = 0.0;    // edge_slope(); 0 while unknown
    double badness = 0.0;  // 0 = a perfect disc; 1 = as far off as any one limit allows
    double score = 0.0;    // 0..1, from badness and the other blobs of the image
    Rejection rejection = Rejection::kSmall;
};

// Scratch of measure_blob(): a window around the blob, values turned so that the blob is dark. Rows are
// longer than the window, for vectors that begin inside it.
struct BlobWorkspace {
    static constexpr std::size_t kPitch = kBlobWindowPx + 16;
    std::array<std::array<std::uint8_t, kPitch>, kBlobWindowPx> values{};
    std::array<std::array<std::int16_t, kPitch>, kBlobWindowPx>
        cover{};  // 0..256: part of a pixel that is blob
    BitRows blob{};
    BitRows foreign{};  // nearer to another part of the same component
    BitRows hidden{};   // neither paint nor skin: a glint on ink, a lash on retro-reflective paint
    BitRows moat{};
    BitRows ring{};
    BitRows scratch{};
    BitBox box{};  // around `blob`
    int left = 0;
    int top = 0;
    int width = 0;
    int height = 0;
};

inline constexpr double kSureBadness = 0.7;     // of a blob: below, nothing is wrong with it
inline constexpr double kPieceSize = 0.85;      // in usual sizes: what is shorter may be a piece of a marker
inline constexpr std::uint32_t kPeerAreas = 3;  // a sibling with a third of the blob's area is its equal

// Whether a point lies in the ellipse of a blob.
[[nodiscard]] inline bool is_inside(const Blob& blob, double x_px, double y_px) {
    const double dx = x_px - blob.x_px;
    const double dy = y_px - blob.y_px;
    const double square = blob.yy * dx * dx - 2.0 * blob.xy * dx * dy + blob.xx * dy * dy;
    return square < 4.0 * (blob.xx * blob.yy - blob.xy * blob.xy);
}

// What was cut out of the same larger component, the blob itself among it: markers that touch share the
// pixels between them. Runs of each are in `grouped`. Both empty for a blob that stands alone.
struct Siblings {
    std::span<const Component> components;
    std::span<const Run> grouped;
};

// `runs` is one component, below (above) some threshold. The centre is in pixels of the image.
[[nodiscard]] Blob measure_blob(const ImageView& image, Side side, const Component& component,
                                std::span<const Run> runs, const Siblings& siblings, const BlobLimits& limits,
                                BlobWorkspace& workspace);

}  // namespace rig
