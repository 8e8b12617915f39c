#include "firmware_host/companion/sample/head_surface.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/math.hpp"
#include "firmware_host/companion/sample/curve.hpp"

namespace rig::host {

namespace {

// One slice of the head: a closed curve through a front, a side and a back point, made of quarter ellipses.
struct Slice {
    double y_front, z_front;
    double half_width, y_side, z_side;
    double y_back, z_back;
};

struct SliceKey {
    double t;
    Slice slice;
};

// From the neck up to the crown. The nose, the lips and the other features of the face are not in it.
constexpr std::array kSlices{
    SliceKey{-190, {-178, -40, 63, -178, -78, -178, -134}},
    SliceKey{-165, {-153, -34, 56, -152, -72, -152, -128}},
    SliceKey{-148, {-135, -29, 52.5, -133, -68, -133, -125}},
    SliceKey{-132, {-120, -23, 50.5, -117, -63, -117, -124}},
    SliceKey{-124, {-116, -9, 50, -109, -59, -109, -124}},
    SliceKey{-117, {-115, 5, 50, -102.5, -56, -102, -125}},
    SliceKey{-112, {-112, 17, 50.5, -98, -54, -97, -126}},
    SliceKey{-107, {-107, 22.5, 51, -93.5, -52.5, -92, -127}},
    SliceKey{-100, {-100, 24, 52, -88, -51, -86, -128}},
    SliceKey{-93, {-93, 23, 53.5, -83, -50, -80.5, -129}},
    SliceKey{-86, {-86, 22.5, 55.3, -78, -49, -75, -130}},
    SliceKey{-80, {-80, 23.5, 57, -73.5, -48, -70.5, -131}},
    SliceKey{-71, {-71, 25, 59.5, -66.5, -47, -64, -133}},
    SliceKey{-60, {-60, 26.5, 62.3, -57.5, -46, -56, -137}},
    SliceKey{-50, {-50, 27, 65, -50, -45, -48, -142}},
    SliceKey{-40, {-40, 25.5, 67, -40, -44, -40, -148}},
    SliceKey{-30, {-30, 23.5, 68.5, -30, -43, -30, -154}},
    SliceKey{-20, {-20, 21.5, 69.5, -20, -42, -20, -160}},
    SliceKey{-10, {-10, 19.5, 70, -10, -41, -10, -165}},
    SliceKey{4, {4, 19, 70, 4, -40, 4, -170}},
    SliceKey{10, {10, 20.5, 70.5, 10, -41, 10, -171}},
    SliceKey{20, {20, 22.5, 71.5, 20, -43, 20, -172}},
    SliceKey{30, {30, 22, 73, 30, -48, 30, -172}},
    SliceKey{40, {40, 19.5, 74, 40, -54, 40, -171}},
    SliceKey{50, {50, 16, 74, 50, -60, 50, -168}},
    SliceKey{65, {65, 9, 71, 65, -65, 65, -162}},
    SliceKey{80, {80, -1, 64.5, 80, -68, 80, -152}},
    SliceKey{95, {95, -15, 53.5, 95, -70, 95, -135}},
    SliceKey{104, {104, -28, 43, 104, -70, 104, -120}},
    SliceKey{110, {110, -39, 33, 110, -70, 110, -106}},
    SliceKey{114, {114, -49, 23.5, 114, -70, 114, -94}},
    SliceKey{117, {117, -59, 12, 117, -70, 117, -82}},
    SliceKey{118, {118, -70, 0, 118, -70, 118, -70}},
};

double slice_value(double t_mm, double Slice::* member) {
    std::array<CurvePoint, kSlices.size()> points{};
    for (std::size_t i = 0; i < kSlices.size(); ++i) points[i] = {kSlices[i].t, kSlices[i].slice.*member};
    return curve_value(points, t_mm);
}

// The nose over the base of the face along the middle line, and its half width where it is 1/e as high.
constexpr std::array kNoseHeight_mm{CurvePoint{-51, 0},    CurvePoint{-47, 2.5}, CurvePoint{-43, 8.5},
                                    CurvePoint{-39, 16},   CurvePoint{-35, 21},  CurvePoint{-31, 22},
                                    CurvePoint{-20, 16.5}, CurvePoint{-8, 9},    CurvePoint{4, 3.5},
                                    CurvePoint{14, 0.6},   CurvePoint{22, 0}};
constexpr std::array kNoseHalfWidth_mm{CurvePoint{-47, 12}, CurvePoint{-38, 10.5}, CurvePoint{-31, 10.5},
                                       CurvePoint{-20, 10}, CurvePoint{-8, 8.5},   CurvePoint{4, 9},
                                       CurvePoint{22, 11}};

double nose_mm(double x, double y) {
    const double ridge =
        curve_value(kNoseHeight_mm, y) * gaussian(x, curve_value(kNoseHalfWidth_mm, y), 0.0, 1.0);
    const double wing = 7.5 * gaussian(std::abs(x) - 13.0, 5.0, y + 38.5, 5.5);
    return ridge + wing * smooth_step(-51.0, -44.0, y);
}

// Lips roll out from the line between them; a crease marks the line, a dent each corner.
double lips_mm(double x, double y) {
    const double below_mm = y - kMouthLineY_mm;
    const double bow = 1.2 * gaussian(std::abs(x) - 6.0, 6.0, 0.0, 1.0);  // two peaks of the upper lip
    const double upper = 4.4 * gaussian(x, 18.0, below_mm - 5.0 - bow, 4.2);
    const double lower = 5.6 * gaussian(x, 16.5, below_mm + 6.2, 5.0);
    const double crease = -2.4 * gaussian(x, 25.0, below_mm, 1.8);
    const double corner = -2.2 * gaussian(std::abs(x) - 27.5, 4.5, below_mm, 4.5);
    const double philtrum = -1.1 * gaussian(x, 3.2, y + 57.0, 6.0);
    return upper + lower + crease + corner + philtrum;
}

// Everything else that makes a skull a face; left and right alike.
double relief_mm(double x, double y) {
    const double side = std::abs(x);
    const double muzzle = 6.0 * gaussian(x, 25.0, y + 66.0, 17.0);
    const double chin = 4.0 * gaussian(x, 15.0, y + 101.0, 9.5);
    const double chin_crease = -1.6 * gaussian(x, 16.0, y + 87.0, 3.5);
    const double cheekbone = 4.5 * gaussian(side - 46.0, 15.0, y + 21.0, 13.0);
    const double cheek_hollow = -2.5 * gaussian(side - 44.0, 12.0, y + 60.0, 16.0);
    const double fold =
        -1.5 * gaussian(side - 27.0 - 0.25 * (-48.0 - y), 3.5, y + 50.0, 11.0);  // nose to mouth
    const double brow =
        3.4 * gaussian(side - 27.0, 19.0, y - 21.0 + 0.006 * (side - 27.0) * (side - 27.0), 7.0);
    const double temple = -3.0 * gaussian(side - 64.0, 12.0, y - 24.0, 18.0);
    const double socket = -8.5 * gaussian(side - 30.0, 15.5, y - 1.0, 12.0);
    const double inner_corner = -3.0 * gaussian(side - 16.0, 6.0, y - 1.0, 8.0);
    return muzzle + chin + chin_crease + cheekbone + cheek_hollow + fold + brow + temple + socket +
           inner_corner;
}

// max(a, b) with its edge rounded over about `width`.
double smooth_max(double a, double b, double width) {
    const double overlap = std::max(0.0, width - std::abs(a - b)) / width;
    return std::max(a, b) + 0.25 * width * overlap * overlap;
}

double with_lids_mm(double x, double y, double z) {
    const double dx = std::abs(x) - kEyeX_mm;
    const double under_root = kLidRadius_mm * kLidRadius_mm - dx * dx - y * y;
    if (under_root <= 0.0) return z;
    return smooth_max(z, rig::sqrt(under_root), 3.0);
}

double features_mm(double x, double y) {
    return nose_mm(x, y) + lips_mm(x, y) + relief_mm(x, y);
}

// How far the ear stands off the head at a point of its side; a rim around a shell.
double ear_mm(double y, double z) {
    const double u = (z + 82.0 + 0.2 * (y + 8.0)) / 17.0;  // leans back at the top
    const double v = (y + 8.0) / 31.0;
    const double r2 = u * u + v * v;
    const double rear = 0.55 + 0.45 * smooth_step(-0.9, 0.4, -u);  // the front edge lies on the head
    return 15.0 * rear * (1.0 - smooth_step(0.55, 1.25, r2)) -
           6.0 * rear * (1.0 - smooth_step(0.05, 0.5, r2));
}

}  // namespace

double face_z_mm(double x_mm, double y_mm) {
    const double half_width = slice_value(y_mm, &Slice::half_width);
    const double sine = std::min(1.0, std::abs(x_mm) / half_width);
    const double z_side = slice_value(y_mm, &Slice::z_side);
    const double z_front = slice_value(y_mm, &Slice::z_front);
    const double base = z_side + (z_front - z_side) * rig::sqrt(1.0 - sine * sine);
    return with_lids_mm(x_mm, y_mm, base + features_mm(x_mm, y_mm));
}

Vec3 skin_point(double t_mm, double azimuth_rad) {
    const SinCos turn = sin_cos(azimuth_rad);
    const double z_side = slice_value(t_mm, &Slice::z_side);
    const double y_side = slice_value(t_mm, &Slice::y_side);
    const bool in_front = turn.cos >= 0.0;
    const double z_end = slice_value(t_mm, in_front ? &Slice::z_front : &Slice::z_back);
    const double y_end = slice_value(t_mm, in_front ? &Slice::y_front : &Slice::y_back);
    const double reach = std::abs(turn.cos);
    Vec3 point{slice_value(t_mm, &Slice::half_width) * turn.sin, y_side + (y_end - y_side) * reach,
               z_side + (z_end - z_side) * reach};
    const double facing = in_front ? smooth_step(0.0, 0.35, reach) : 0.0;
    point.z() += facing * features_mm(point.x(), point.y()) * smooth_step(-122.0, -108.0, t_mm);
    if (in_front) point.z() = with_lids_mm(point.x(), point.y(), point.z());
    const double ear = std::max(0.0, ear_mm(point.y(), point.z()));
    point.x() += (point.x() > 0.0 ? 1.0 : -1.0) * ear * smooth_step(35.0, 55.0, std::abs(point.x()));
    return point;
}

double eye_opening(double x_mm) {
    const double q = (std::abs(x_mm) - kEyeX_mm) / kEyeHalfWidth_mm;
    return std::max(0.0, 1.0 - q * q);
}

double lid_share(double distance_mm) {
    return 1.0 - smooth_step(0.0, kLidReach_mm, distance_mm);
}

}  // namespace rig::host
