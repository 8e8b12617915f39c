// An ellipse that is turned, for drawing outlines sample by sample. Not for: pictures (dot_scene).
#pragma once

#include <cmath>

namespace rig::test {

struct TiltedEllipse {
    double x = 0.0;  // centre, px
    double y = 0.0;
    double a = 1.0;  // semi-axes along the angle and across it, px
    double b = 1.0;
    double angle_rad = 0.0;
    [[nodiscard]] bool holds(double px, double py) const {
        const double u = (std::cos(angle_rad) * (px - x) + std::sin(angle_rad) * (py - y)) / a;
        const double v = (std::cos(angle_rad) * (py - y) - std::sin(angle_rad) * (px - x)) / b;
        return u * u + v * v <= 1.0;
    }
};

}  // namespace rig::test
