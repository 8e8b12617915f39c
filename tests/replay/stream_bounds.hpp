// What a recorded stream must come to, and the check of it: shared by the programs of this folder.
//
// The streams are solved by the pipeline without smoothing, against the weights that made them. Truth:
// takes/<take>_weights60.csv, from which the streams were computed as neutral + B w (exactly linear), then
// degraded. Bounds are two-sided: a figure far below its usual value is as suspicious as one above (a leak of
// truth, a stream that was not degraded, a metric that broke). They stand 10 to 25 % from the figures
// measured when they were set, except where an acceptance bound of the project is named.
#pragma once

#include <ostream>

namespace rig::test {

struct Bounds {
    double low;
    double high;
};

struct StreamCase {
    const char* take;
    int markers;
    const char* stream;
    Bounds weight_rms;     // over shapes whose marker column is longer than 1 mm
    Bounds marker_rms_mm;  // of B (w - w_true), over coordinates
};

void PrintTo(const StreamCase& c, std::ostream* out);

// Expectations of GoogleTest; skips the test where the stream is absent. An unlabelled stream must also
// name 99.5 % of the visible markers rightly after the first 30 frames, and none as another.
void expect_within_bounds(const StreamCase& c);

}  // namespace rig::test
