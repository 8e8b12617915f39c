#include "firmware_host/companion/sample/head_mesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/base/check.hpp"
#include "core/base/math.hpp"
#include "firmware_host/companion/sample/head_surface.hpp"

namespace rig::host {

namespace {

constexpr double kPi = 3.14159265358979323846;

// Rows of the grid from the crown down: `count` steps to `t_mm`. Dense where the face moves most.
struct RowBand {
    double t_mm;
    int count;
};
constexpr std::array kRowBands{RowBand{117, 1},  RowBand{110, 2},  RowBand{50, 10}, RowBand{36, 4},
                               RowBand{15, 8},   RowBand{-0.5, 9}, RowBand{-15, 8}, RowBand{-47, 13},
                               RowBand{-60, 6},  RowBand{-71, 7},  RowBand{-82, 7}, RowBand{-117, 14},
                               RowBand{-148, 6}, RowBand{-190, 5}};

// Columns on either side of the middle: even steps over the face, then growing ones to the back.
constexpr int kFaceColumns = 30;
constexpr double kFaceAzimuth_rad = 1.2;
constexpr int kBackColumns = 16;
constexpr int kHalfColumns = kFaceColumns + kBackColumns;
constexpr double kBackHeadAzimuth_rad = 1.7;
constexpr double kScalp_mm = 78.0;  // the face part ends above it

double azimuth_of(int column) {
    if (column <= kFaceColumns) return kFaceAzimuth_rad * column / kFaceColumns;
    const double s = static_cast<double>(column - kFaceColumns) / kBackColumns;
    const double step = kFaceAzimuth_rad / kFaceColumns * kBackColumns;
    return kFaceAzimuth_rad + step * s + (kPi - kFaceAzimuth_rad - step) * s * s;
}

std::vector<double> row_positions() {
    std::vector<double> rows;
    double from = kCrownT_mm;
    for (const RowBand& band : kRowBands) {
        for (int i = 1; i <= band.count; ++i) rows.push_back(from + (band.t_mm - from) * i / band.count);
        from = band.t_mm;
    }
    return rows;
}

// A row whose vertices are there twice between two columns.
struct Slit {
    std::size_t row = 0;
    int first = 0;  // columns, both with one vertex: the corners
    int last = 0;
    [[nodiscard]] bool splits(std::size_t r, int column) const {
        return r == row && column > first && column < last;
    }
};

class HeadBuilder {
  public:
    HeadMesh build() {
        find_slits();
        add_crown();
        for (std::size_t r = 0; r < rows_.size(); ++r) add_row(r);
        add_skin_triangles();
        add_mouth_pocket();
        for (const Slit* eye : {&left_eye_, &right_eye_}) add_lid_rims(*eye);
        add_teeth(HeadPart::kUpperTeeth);
        add_teeth(HeadPart::kLowerTeeth);
        add_eyeball(HeadPart::kLeftEyeball);
        add_eyeball(HeadPart::kRightEyeball);
        mesh_.parts = {"face",        "back_head", "mouth_inside", "upper_teeth",
                       "lower_teeth", "eyeball_L", "eyeball_R"};
        find_mirrors();
        return std::move(mesh_);
    }

  private:
    struct Node {
        std::size_t above = 0;  // equal where there is one vertex only
        std::size_t below = 0;
    };

    void find_slits() {
        const auto row_at = [&](double t_mm) {
            const auto found =
                std::ranges::find_if(rows_, [&](double t) { return std::abs(t - t_mm) < 1e-9; });
            RIG_CHECK(found != rows_.end());
            return static_cast<std::size_t>(found - rows_.begin());
        };
        const auto column_at = [](double t_mm, double x_mm) {
            int nearest = 0;
            for (int c = 0; c <= kFaceColumns; ++c) {
                const auto off = [&](int column) {
                    return std::abs(skin_point(t_mm, azimuth_of(column)).x() - x_mm);
                };
                if (off(c) < off(nearest)) nearest = c;
            }
            return nearest;
        };
        const int mouth_end = column_at(kMouthLineY_mm, kMouthHalfWidth_mm);
        mouth_ = {.row = row_at(kMouthLineY_mm), .first = -mouth_end, .last = mouth_end};
        const int inner = column_at(kEyeLineY_mm, kEyeX_mm - kEyeHalfWidth_mm);
        const int outer = column_at(kEyeLineY_mm, kEyeX_mm + kEyeHalfWidth_mm);
        left_eye_ = {.row = row_at(kEyeLineY_mm), .first = inner, .last = outer};
        right_eye_ = {.row = left_eye_.row, .first = -outer, .last = -inner};
    }

    [[nodiscard]] bool is_split(std::size_t row, int column) const {
        return mouth_.splits(row, column) || left_eye_.splits(row, column) || right_eye_.splits(row, column);
    }

    std::size_t add(HeadVertex vertex) {
        mesh_.vertices.push_back(vertex);
        return mesh_.vertices.size() - 1;
    }
    std::size_t add_skin(const Vec3& rest_mm, SlitSide mouth, SlitSide eye) {
        return add({.rest_mm = rest_mm, .mouth = mouth, .eye = eye, .anchor_mm = rest_mm});
    }
    void add_triangle(std::size_t a, std::size_t b, std::size_t c, HeadPart part) {
        mesh_.triangles.push_back(
            {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), static_cast<std::int32_t>(c)});
        mesh_.triangle_part.push_back(static_cast<std::uint8_t>(part));
    }
    // a b above, c d below them, seen from outside with a at the viewer's left; cut along the diagonal that
    // the mirrored quad has mirrored.
    void add_quad(std::size_t a, std::size_t b, std::size_t c, std::size_t d, bool flip, HeadPart part) {
        if (flip) {
            add_triangle(a, c, d, part);
            add_triangle(a, d, b, part);
        } else {
            add_triangle(a, c, b, part);
            add_triangle(b, c, d, part);
        }
    }

    void add_crown() { crown_ = add_skin({0.0, kCrownT_mm, -70.0}, SlitSide::kAbove, SlitSide::kAbove); }

    // The grid's point with the eye held open: lids part from the eye line and drag the skin around along.
    [[nodiscard]] static Vec3 open_point(double t_mm, int column, SlitSide eye) {
        const int side = column < 0 ? -1 : 1;
        Vec3 point = skin_point(t_mm, azimuth_of(std::abs(column)));
        if (column == 0 || column == kHalfColumns) point.x() = 0.0;
        const double distance_mm = std::abs(t_mm - kEyeLineY_mm);
        if (distance_mm < kLidReach_mm && point.z() > -20.0) {
            const double opening = eye == SlitSide::kAbove ? kUpperLidOpening_mm : -kLowerLidOpening_mm;
            point.y() += opening * eye_opening(point.x()) * lid_share(distance_mm);
            point.z() = face_z_mm(point.x(), point.y());
        }
        point.x() *= side;
        return point;
    }

    void add_row(std::size_t r) {
        const SlitSide mouth = r <= mouth_.row ? SlitSide::kAbove : SlitSide::kBelow;
        const SlitSide eye = r <= left_eye_.row ? SlitSide::kAbove : SlitSide::kBelow;
        for (int c = -kHalfColumns + 1; c <= kHalfColumns; ++c) {
            Node node;
            node.above = add_skin(open_point(rows_[r], c, eye), mouth, eye);
            node.below = node.above;
            if (is_split(r, c)) {
                const SlitSide below_mouth = r == mouth_.row ? SlitSide::kBelow : mouth;
                const SlitSide below_eye = r == left_eye_.row ? SlitSide::kBelow : eye;
                node.below = add_skin(open_point(rows_[r], c, below_eye), below_mouth, below_eye);
            }
            nodes_.push_back(node);
        }
    }

    [[nodiscard]] const Node& node(std::size_t row, int column) const {
        const int wrapped = column == -kHalfColumns ? kHalfColumns : column;
        return nodes_[row * 2 * kHalfColumns + static_cast<std::size_t>(wrapped + kHalfColumns - 1)];
    }

    // Columns rise towards the performer's left: the viewer's right.
    void add_skin_triangles() {
        for (int c = -kHalfColumns; c < kHalfColumns; ++c) {
            const bool at_left = c >= 0;
            const double azimuth_rad = azimuth_of(at_left ? c : -c - 1);
            add_triangle(crown_, node(0, c).above, node(0, c + 1).above, HeadPart::kBackHead);
            for (std::size_t r = 0; r + 1 < rows_.size(); ++r) {
                const bool on_face = azimuth_rad < kBackHeadAzimuth_rad && rows_[r] < kScalp_mm;
                add_quad(node(r, c).below, node(r, c + 1).below, node(r + 1, c).above,
                         node(r + 1, c + 1).above, at_left, on_face ? HeadPart::kFace : HeadPart::kBackHead);
            }
        }
    }

    // A pouch from the upper lip's edge over the back of the mouth to the lower lip's edge, seen through the
    // open lips.
    void add_mouth_pocket() {
        struct Station {
            double dy_mm, dz_mm, narrow, follow;
            SlitSide side;
        };
        constexpr std::array kStations{Station{1.0, -3.0, 0.99, 0.95, SlitSide::kAbove},
                                       Station{5.0, -6.5, 0.97, 0.6, SlitSide::kAbove},
                                       Station{10.0, -12.0, 0.93, 0.15, SlitSide::kAbove},
                                       Station{9.0, -38.0, 0.80, 0.0, SlitSide::kAbove},
                                       Station{-9.0, -38.0, 0.80, 0.5, SlitSide::kBelow},
                                       Station{-11.0, -12.0, 0.93, 0.9, SlitSide::kBelow},
                                       Station{-5.0, -6.5, 0.97, 0.95, SlitSide::kBelow},
                                       Station{-1.0, -3.0, 0.99, 0.98, SlitSide::kBelow}};
        const auto at_edge = [&](int c, SlitSide side) {
            return side == SlitSide::kAbove ? node(mouth_.row, c).above : node(mouth_.row, c).below;
        };
        std::vector<std::vector<std::size_t>> strips;
        for (int c = mouth_.first + 1; c < mouth_.last; ++c) {
            std::vector<std::size_t> strip{at_edge(c, SlitSide::kAbove)};
            for (const Station& station : kStations) {
                const HeadVertex& edge = mesh_.vertices[at_edge(c, station.side)];
                const Vec3 rest_mm{edge.rest_mm.x() * station.narrow, edge.rest_mm.y() + station.dy_mm,
                                   edge.rest_mm.z() + station.dz_mm};
                strip.push_back(add({.rest_mm = rest_mm,
                                     .part = HeadPart::kMouthInside,
                                     .mouth = station.side,
                                     .eye = SlitSide::kBelow,
                                     .anchor_mm = edge.rest_mm,
                                     .follow = station.follow}));
            }
            strip.push_back(at_edge(c, SlitSide::kBelow));
            strips.push_back(std::move(strip));
        }
        // Seen from in front the pouch is hollow: the strip runs upwards behind the upper lip.
        for (std::size_t s = 0; s + 1 < strips.size(); ++s) {
            for (std::size_t k = 0; k + 1 < strips[s].size(); ++k) {
                add_quad(strips[s][k], strips[s + 1][k], strips[s][k + 1], strips[s + 1][k + 1],
                         s + 1 >= strips.size() / 2 + strips.size() % 2, HeadPart::kMouthInside);
            }
        }
        const std::size_t right_corner = node(mouth_.row, mouth_.first).above;
        const std::size_t left_corner = node(mouth_.row, mouth_.last).above;
        for (std::size_t k = 0; k + 1 < strips.front().size(); ++k) {
            add_triangle(right_corner, strips.front()[k + 1], strips.front()[k], HeadPart::kMouthInside);
            add_triangle(left_corner, strips.back()[k], strips.back()[k + 1], HeadPart::kMouthInside);
        }
    }

    // Each lid ends in a rim that reaches into the eyeball, so that no gap shows between them.
    void add_lid_rims(const Slit& slit) {
        const double centre_x = slit.first > 0 ? kEyeX_mm : -kEyeX_mm;
        for (const SlitSide side : {SlitSide::kAbove, SlitSide::kBelow}) {
            const auto edge_at = [&](int c) {
                return side == SlitSide::kAbove ? node(slit.row, c).above : node(slit.row, c).below;
            };
            std::vector<std::size_t> edge, rim;
            for (int c = slit.first; c <= slit.last; ++c) {
                edge.push_back(edge_at(c));
                const bool corner = c == slit.first || c == slit.last;
                rim.push_back(corner ? edge.back() : add_rim(edge.back(), centre_x, side));
            }
            for (std::size_t i = 0; i + 1 < edge.size(); ++i) {
                const bool above = side == SlitSide::kAbove;
                const auto& upper = above ? edge : rim;
                const auto& lower = above ? rim : edge;
                add_rim_quad(upper[i], upper[i + 1], lower[i], lower[i + 1], slit.first > 0);
            }
        }
    }
    std::size_t add_rim(std::size_t edge, double centre_x, SlitSide side) {
        const Vec3 anchor_mm = mesh_.vertices[edge].rest_mm;
        const Vec3 centre{centre_x, 0.0, 0.0};
        const Vec3 out = anchor_mm - centre;
        const double length = rig::sqrt(out.dot(out));
        const Vec3 rest_mm = centre + out * ((kEyeballRadius_mm - 0.8) / length);
        return add({.rest_mm = rest_mm, .mouth = SlitSide::kAbove, .eye = side, .anchor_mm = anchor_mm});
    }
    void add_rim_quad(std::size_t a, std::size_t b, std::size_t c, std::size_t d, bool flip) {
        if (a == c) {
            add_triangle(a, d, b, HeadPart::kFace);
        } else if (b == d) {
            add_triangle(a, c, b, HeadPart::kFace);
        } else {
            add_quad(a, b, c, d, flip, HeadPart::kFace);
        }
    }

    // One curved band each: the lips hide everything but its front.
    void add_teeth(HeadPart part) {
        constexpr int kHalf = 10;
        const bool upper = part == HeadPart::kUpperTeeth;
        const double edge_y = kMouthLineY_mm + (upper ? -0.5 : 0.5);
        const double root_y = edge_y + (upper ? 9.5 : -8.5);
        const double front_z = upper ? 20.5 : 18.5;
        std::vector<std::size_t> top, bottom;
        for (int i = -kHalf; i <= kHalf; ++i) {
            const double x = 2.1 * i;
            const double z = front_z - 0.030 * x * x;
            const auto tooth = [&](double y) {
                const Vec3 rest_mm{x, y, z};
                return add({.rest_mm = rest_mm,
                            .part = part,
                            .mouth = upper ? SlitSide::kAbove : SlitSide::kBelow,
                            .eye = SlitSide::kBelow,
                            .anchor_mm = rest_mm});
            };
            top.push_back(tooth(std::max(edge_y, root_y)));
            bottom.push_back(tooth(std::min(edge_y, root_y)));
        }
        for (std::size_t i = 0; i + 1 < top.size(); ++i) {
            add_quad(top[i], top[i + 1], bottom[i], bottom[i + 1], i >= kHalf, part);
        }
    }

    // Rings about the axis of sight, from the front pole to the back pole.
    void add_eyeball(HeadPart part) {
        constexpr int kRings = 11;
        constexpr int kSectors = 20;
        const double side = part == HeadPart::kLeftEyeball ? 1.0 : -1.0;
        const auto point = [&](int ring, int sector) {
            const SinCos down = sin_cos(kPi * ring / (kRings + 1));
            const SinCos around = sin_cos(2.0 * kPi * sector / kSectors);
            const double radius = kEyeballRadius_mm * down.sin;
            const Vec3 rest_mm{side * (kEyeX_mm + radius * around.cos), radius * around.sin,
                               kEyeballRadius_mm * down.cos};
            return add({.rest_mm = rest_mm,
                        .part = part,
                        .eye = SlitSide::kBelow,
                        .anchor_mm = rest_mm,
                        .follow = 0.0});
        };
        const std::size_t front = point(0, 0);
        const std::size_t first = mesh_.vertices.size();
        for (int ring = 1; ring <= kRings; ++ring) {
            for (int sector = 0; sector < kSectors; ++sector) (void)point(ring, sector);
        }
        const std::size_t back = point(kRings + 1, 0);
        const auto at = [&](int ring, int sector) {
            return first + static_cast<std::size_t>((ring - 1) * kSectors + sector % kSectors);
        };
        const auto add_turned = [&](std::size_t a, std::size_t b, std::size_t c) {
            side > 0.0 ? add_triangle(a, b, c, part) : add_triangle(a, c, b, part);
        };
        for (int sector = 0; sector < kSectors; ++sector) {
            add_turned(front, at(1, sector), at(1, sector + 1));
            for (int ring = 1; ring < kRings; ++ring) {
                add_turned(at(ring, sector), at(ring + 1, sector), at(ring + 1, sector + 1));
                add_turned(at(ring, sector), at(ring + 1, sector + 1), at(ring, sector + 1));
            }
            add_turned(back, at(kRings, sector + 1), at(kRings, sector));
        }
    }

    // By position, side of the slits and part: found, not kept while building, so that it also checks the
    // symmetry.
    void find_mirrors() {
        const auto mirrored_part = [](HeadPart part) {
            if (part == HeadPart::kLeftEyeball) return HeadPart::kRightEyeball;
            return part == HeadPart::kRightEyeball ? HeadPart::kLeftEyeball : part;
        };
        const auto key = [](const HeadVertex& v, double side, HeadPart part) {
            return std::tuple{
                side * v.rest_mm.x() + 0.0, v.rest_mm.y(), v.rest_mm.z(), v.follow, part, v.mouth, v.eye};
        };
        using Key = decltype(key(mesh_.vertices[0], 1.0, HeadPart::kFace));
        std::vector<std::pair<Key, std::size_t>> sorted;
        for (std::size_t i = 0; i < mesh_.vertices.size(); ++i) {
            sorted.emplace_back(key(mesh_.vertices[i], 1.0, mesh_.vertices[i].part), i);
        }
        std::ranges::sort(sorted);
        for (HeadVertex& vertex : mesh_.vertices) {
            const Key wanted = key(vertex, -1.0, mirrored_part(vertex.part));
            const auto found = std::ranges::lower_bound(sorted, std::pair{wanted, std::size_t{0}});
            RIG_CHECK(found != sorted.end() && found->first == wanted);
            vertex.mirror = found->second;
        }
    }

    std::vector<double> rows_ = row_positions();
    Slit mouth_, left_eye_, right_eye_;
    std::size_t crown_ = 0;
    std::vector<Node> nodes_;
    HeadMesh mesh_;
};

}  // namespace

HeadMesh build_head_mesh() {
    return HeadBuilder{}.build();
}

}  // namespace rig::host
