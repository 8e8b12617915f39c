// A marker whose outline is seen in part only: a glint or a lash bites into it or cuts it in two, a wet spot
// of its own brightness lies beside it. The ellipse that most of the outline follows says what belongs to it.
// Not for: markers whose outline is whole.
#pragma once

#include "core/detect/blob.hpp"
#include "core/detect/blob_shape.hpp"

namespace rig {

// In pixels of the window; xx, xy, yy are the second moments of its area.
struct Ellipse {
    double x = 0.0;
    double y = 0.0;
    double xx = 0.0;
    double xy = 0.0;
    double yy = 0.0;
    double followed = 0.0;  // part of its rim that the outline follows
};

struct EllipseLimits {
    double longest_px = 64.0;     // its diameter at most
    double least_followed = 0.6;  // part of its rim that the outline follows
    bool disturbed = true;        // what is not of it may be a whole side of the outline
};

// Makes the blob every piece of paint, at which cover passes `outline`, that lies within `radius` of a place
// of the window and does not go on beyond it. False when that is no more than the blob already was. Cover
// must be known as far.
[[nodiscard]] bool gather_pieces(double x, double y, double radius, int outline, BlobWorkspace& workspace);

// Pixels of the window within `radius` of a place.
void mark_disc(double x, double y, double radius, const BlobWorkspace& workspace, BitRows& disc);

// The ellipse along which most of the outline lies at which cover passes `outline`, of workspace.blob and
// whatever else of it is inside. Weighted algebraic fit (Sampson82, eq. 1 as weights) in rounds that leave
// out what lies farther and farther off. False when there is no such ellipse.
[[nodiscard]] bool follow_ellipse(const BlobWorkspace& workspace, int outline, const EllipseLimits& limits,
                                  Ellipse& ellipse);

// Makes the blob what of it lies in the ellipse, and marks in `hidden` what is paint beside it or none in it,
// and one step around. False when less than half of the ellipse is paint.
[[nodiscard]] bool keep_ellipse(const Ellipse& ellipse, BlobWorkspace& workspace);

}  // namespace rig
