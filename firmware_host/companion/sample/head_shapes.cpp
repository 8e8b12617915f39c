#include "firmware_host/companion/sample/head_shapes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <string>

#include "core/base/math.hpp"
#include "firmware_host/companion/sample/curve.hpp"
#include "firmware_host/companion/sample/head_surface.hpp"

namespace rig::host {

namespace {

constexpr double kSmallest_mm = 0.005;

// Which lip a pull takes along.
enum class Lips : std::uint8_t { kBoth, kUpper, kLower };

// Skin around (x, y) is drawn by `pull_mm` at the centre, less around it as a Gaussian of radii rx, ry.
struct Pull {
    double x, y, rx, ry;
    double dx, dy, dz;
    Lips lips = Lips::kBoth;
};

// 1 for what belongs to the lower jaw, 0 for what belongs to the skull; a half at the corners of the mouth,
// where cheeks stretch between the two.
double jaw_share(const HeadVertex& vertex) {
    const Vec3& p = vertex.anchor_mm;
    const double side = std::abs(p.x());
    const double q = std::min(1.0, side / kMouthHalfWidth_mm);
    const double within = rig::sqrt(1.0 - q * q);
    const double reach_mm = 7.0 + 0.5 * std::max(0.0, side - 20.0);
    const double distance_mm = p.y() - kMouthLineY_mm;
    const double near = gaussian(distance_mm, reach_mm, 0.0, 1.0);
    if (vertex.mouth == SlitSide::kAbove) return (0.45 - 0.42 * within) * near;
    return 1.0 - (0.55 - 0.53 * within) * near;
}

// The field of a shape at a vertex, without regard to how much the vertex follows its anchor.
using Field = std::function<Vec3(const HeadVertex&)>;

// Pulls act on skin in front of the ears.
double facing_share(const Vec3& p) {
    return smooth_step(-75.0, -35.0, p.z()) * smooth_step(-150.0, -112.0, p.y());
}

Vec3 pulled(std::span<const Pull> pulls, const HeadVertex& vertex) {
    const Vec3& p = vertex.anchor_mm;
    const double lower = jaw_share(vertex);
    Vec3 sum = Vec3::Zero();
    for (const Pull& pull : pulls) {
        const double lips = pull.lips == Lips::kBoth ? 1.0 : pull.lips == Lips::kLower ? lower : 1.0 - lower;
        const double share = lips * gaussian(p.x() - pull.x, pull.rx, p.y() - pull.y, pull.ry);
        sum += share * Vec3{pull.dx, pull.dy, pull.dz};
    }
    return sum * facing_share(p);
}

// How much of the jaw bone's motion a vertex makes: all of it in front, none at the neck and behind the
// hinge.
double bone_share(const HeadVertex& vertex) {
    const Vec3& p = vertex.anchor_mm;
    return jaw_share(vertex) * smooth_step(-72.0, -30.0, p.z()) * smooth_step(-172.0, -116.0, p.y());
}

// The condyles: the jaw turns about the line through both, or about one of them.
constexpr double kHingeX_mm = 55.0;
constexpr double kHingeY_mm = -12.0;
constexpr double kHingeZ_mm = -78.0;

Vec3 jaw_turned(const HeadVertex& vertex, const Vec3& hinge_mm, const Vec3& turn_rad, const Vec3& slide_mm) {
    const Mat3 rotation = rotation_from_vector(turn_rad);
    const Vec3 from_hinge = vertex.anchor_mm - hinge_mm;
    return bone_share(vertex) * (rotation * from_hinge - from_hinge + slide_mm);
}

Vec3 jaw_opened(const HeadVertex& vertex) {
    return jaw_turned(vertex, {0.0, kHingeY_mm, kHingeZ_mm}, {0.235, 0.0, 0.0}, {0.0, -1.5, 2.0});
}

// The chin goes to the performer's left: the left condyle turns in place, the right one slides forward.
Vec3 jaw_to_left(const HeadVertex& vertex) {
    return jaw_turned(vertex, {kHingeX_mm, kHingeY_mm, kHingeZ_mm}, {0.02, 0.078, 0.0}, Vec3::Zero());
}

// Lips meet while the jaw is open: the lower one goes most of the jaw's way back, the upper one comes down to
// it.
Vec3 mouth_closed(const HeadVertex& vertex) {
    const Vec3& p = vertex.anchor_mm;
    HeadVertex jaw_point = vertex;
    jaw_point.mouth = SlitSide::kBelow;
    const double on_lips = gaussian(p.x(), 45.0, p.y() - kMouthLineY_mm + 3.0, 12.0);
    const Vec3 opened = jaw_opened(jaw_point);
    const double lower = jaw_share(vertex);
    return on_lips * (-0.66 * lower * opened + 0.34 * (1.0 - lower) * opened);
}

// Lids slide over the eyeball: `upper` and `lower` are the parts of the opening that each lid goes down.
Vec3 lids_moved(const HeadVertex& vertex, double upper, double lower) {
    const Vec3& p = vertex.anchor_mm;
    if (p.x() <= 0.0 || p.z() < -20.0) return Vec3::Zero();
    const bool above = vertex.eye == SlitSide::kAbove;
    const double opening_mm = above ? kUpperLidOpening_mm : kLowerLidOpening_mm;
    const double opening = opening_mm * eye_opening(p.x());
    // The rest position holds the lid open already: undo that to find the row's own distance from the eye
    // line.
    const double open_distance_mm = std::abs(p.y() - kEyeLineY_mm);
    double distance_mm = open_distance_mm;
    for (int i = 0; i < 30; ++i)
        distance_mm = std::max(0.0, open_distance_mm - opening * lid_share(distance_mm));
    const double full_mm = (kUpperLidOpening_mm + kLowerLidOpening_mm) * eye_opening(p.x());
    const double dy = -(above ? upper : lower) * full_mm * lid_share(distance_mm);
    if (dy == 0.0) return Vec3::Zero();
    return {0.0, dy, face_z_mm(p.x(), p.y() + dy) - face_z_mm(p.x(), p.y())};
}

Vec3 mirrored(const Vec3& v) {
    return {-v.x(), v.y(), v.z()};
}

class ShapeBuilder {
  public:
    explicit ShapeBuilder(const HeadMesh& mesh) : mesh_(mesh) {}

    void add(const std::string& name, const Field& field) {
        SparseShape shape{.name = name, .vertices = {}, .delta_mm = {}};
        for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
            const HeadVertex& vertex = mesh_.vertices[v];
            if (vertex.follow == 0.0) continue;
            keep(shape, v, vertex.follow * field(vertex));
        }
        shapes_.push_back(std::move(shape));
    }
    // `field` is that of the left side.
    void add_pair(const std::string& stem, const Field& field) {
        add(stem + "_L", field);
        add(stem + "_R",
            [&](const HeadVertex& vertex) { return mirrored(field(mesh_.vertices[vertex.mirror])); });
    }
    void add_pair(const std::string& stem, std::initializer_list<Pull> pulls) {
        add_pair(stem, [pulls](const HeadVertex& vertex) { return on_skin(pulls, vertex); });
    }
    // Left and right at once: `pulls` name the left side and the middle, the right side follows by itself.
    void add_both(const std::string& name, std::initializer_list<Pull> middle,
                  std::initializer_list<Pull> left) {
        add(name, [&](const HeadVertex& vertex) {
            const HeadVertex& other = mesh_.vertices[vertex.mirror];
            return Vec3{on_skin(middle, vertex) + on_skin(left, vertex) + mirrored(on_skin(left, other))};
        });
    }
    std::vector<SparseShape> take() {
        std::ranges::sort(shapes_, {}, &SparseShape::name);
        return std::move(shapes_);
    }

    [[nodiscard]] static Vec3 on_skin(std::span<const Pull> pulls, const HeadVertex& vertex) {
        const bool rigid = vertex.part == HeadPart::kUpperTeeth || vertex.part == HeadPart::kLowerTeeth;
        return rigid ? Vec3{Vec3::Zero()} : pulled(pulls, vertex);
    }

  private:
    static void keep(SparseShape& shape, std::size_t vertex, const Vec3& delta_mm) {
        if (delta_mm.dot(delta_mm) < kSmallest_mm * kSmallest_mm) return;
        shape.vertices.push_back(static_cast<std::int32_t>(vertex));
        shape.delta_mm.push_back(to_float3(delta_mm));
    }

    const HeadMesh& mesh_;
    std::vector<SparseShape> shapes_;
};

void add_upper_face(ShapeBuilder& shapes) {
    shapes.add_pair("browDown", {{20, 27, 17, 12, -2.0, -6.0, 0.8}, {40, 27, 14, 11, -0.5, -3.0, 0.3}});
    shapes.add_pair("browInnerUp", {{10, 26, 12, 14, 0.3, 6.5, -0.6}, {12, 44, 14, 14, 0.0, 3.0, -1.5}});
    shapes.add_pair("browOuterUp", {{43, 27, 15, 14, 0.5, 7.5, -2.5}, {38, 46, 14, 13, 0.0, 3.0, -2.0}});
    shapes.add_pair("cheekSquint", {{38, -24, 17, 12, -0.5, 5.0, 2.2}, {46, -14, 12, 9, 0.0, 1.5, 0.5}});
    shapes.add_pair("noseSneer", {{15, -36, 8, 10, 1.8, 5.0, 1.0},
                                  {9, -20, 8, 11, 0.3, 3.2, 0.6},
                                  {15, -58, 12, 9, 0.5, 3.8, 0.6, Lips::kUpper},
                                  {27, -32, 10, 12, 0.0, 2.2, 1.0}});
    shapes.add_pair("eyeBlink", [](const HeadVertex& vertex) {
        constexpr Pull kCheek{33, -17, 14, 7, 0, 0.7, 0.1};
        return Vec3{lids_moved(vertex, 0.86, -0.14) + ShapeBuilder::on_skin({&kCheek, 1}, vertex)};
    });
    shapes.add_pair("eyeSquint", [](const HeadVertex& vertex) {
        constexpr std::array kAround{Pull{35, -18, 18, 9, -0.5, 2.8, 0.6},
                                     Pull{50, -2, 8, 12, -2.0, 0.0, 0.0}};
        return Vec3{lids_moved(vertex, 0.22, -0.22) + ShapeBuilder::on_skin(kAround, vertex)};
    });
    shapes.add_pair("eyeWide", [](const HeadVertex& vertex) {
        constexpr Pull kBrow{30, 26, 20, 10, 0, 1.2, -0.2};
        return Vec3{lids_moved(vertex, -0.24, 0.06) + ShapeBuilder::on_skin({&kBrow, 1}, vertex)};
    });
}

void add_jaw(ShapeBuilder& shapes) {
    shapes.add("jawOpen", jaw_opened);
    shapes.add("jawForward",
               [](const HeadVertex& vertex) { return Vec3{bone_share(vertex) * Vec3{0.0, -1.0, 8.0}}; });
    shapes.add("mouthClose", mouth_closed);
}

// Shapes of one whole, each the mirror of the other.
void add_sideways(ShapeBuilder& shapes, const HeadMesh& mesh) {
    const auto mouth_to_left = [](const HeadVertex& vertex) {
        constexpr std::array kPulls{
            Pull{26, -70, 15, 15, 5.0, 2.5, -3.0}, Pull{0, -71, 19, 17, 7.5, 0.6, 0.5},
            Pull{-26, -71, 15, 15, 6.5, 0.0, 3.0}, Pull{42, -58, 15, 16, 1.5, 1.5, 3.5}};
        return ShapeBuilder::on_skin(kPulls, vertex);
    };
    for (const auto& [stem, field] :
         {std::pair<std::string, Field>{"jaw", jaw_to_left}, {"mouth", mouth_to_left}}) {
        shapes.add(stem + "Left", field);
        shapes.add(stem + "Right",
                   [&](const HeadVertex& vertex) { return mirrored(field(mesh.vertices[vertex.mirror])); });
    }
}

void add_corners(ShapeBuilder& shapes) {
    shapes.add_pair("cheekPuff", {{42, -56, 19, 18, 5.0, 0.5, 8.5}, {18, -60, 12, 10, 1.0, 0.0, 2.5}});
    shapes.add_pair("mouthSmile", {{28, -70, 14, 13, 6.5, 8.0, -3.5},
                                   {41, -46, 16, 15, 1.5, 4.5, 3.5},
                                   {13, -67, 11, 9, 2.5, 1.5, -1.5}});
    shapes.add_pair("mouthFrown", {{27, -74, 13, 12, 1.0, -7.5, -1.0}, {24, -90, 12, 11, 0.5, -3.0, 0.5}});
    shapes.add_pair("mouthDimple", {{30, -71, 11, 11, 4.5, 1.0, -5.5}});
    shapes.add_pair("mouthStretch", {{28, -75, 15, 13, 7.5, -3.5, -3.0}, {36, -92, 15, 13, 3.0, -3.0, -0.5}});
    shapes.add_pair("mouthPress", {{14, -66, 12, 6, 0.3, -2.0, -1.8, Lips::kUpper},
                                   {14, -77, 12, 7, 0.3, 2.4, -1.8, Lips::kLower},
                                   {27, -71, 9, 8, 1.5, 0.8, 1.2},
                                   {15, -93, 11, 9, 0.0, 1.8, 1.0}});
    shapes.add_pair("mouthUpperUp",
                    {{12, -64, 12, 9, 0.8, 6.5, 1.2, Lips::kUpper}, {23, -52, 10, 10, 0.5, 3.2, 1.2}});
    shapes.add_pair("mouthLowerDown",
                    {{13, -78, 12, 9, 1.5, -6.5, 0.8, Lips::kLower}, {16, -92, 11, 9, 0.0, -2.2, 0.3}});
}

void add_lips(ShapeBuilder& shapes) {
    shapes.add_both("mouthPucker",
                    {{0, -63, 12, 9, 0, 0.5, 5.5, Lips::kUpper}, {0, -79, 12, 9, 0, 0.5, 5.5, Lips::kLower}},
                    {{25, -71, 13, 13, -9.5, 0.0, 4.5}});
    shapes.add_both("mouthFunnel",
                    {{0, -63, 16, 9, 0, 3.8, 6.5, Lips::kUpper}, {0, -79, 16, 9, 0, -5.0, 6.5, Lips::kLower}},
                    {{24, -71, 12, 12, -4.5, 0.0, 4.5}});
    shapes.add_both("mouthRollLower",
                    {{0, -76, 22, 6.5, 0, 3.2, -6.5, Lips::kLower}, {0, -92, 20, 9, 0, 2.8, 0.8}}, {});
    shapes.add_both(
        "mouthRollUpper",
        {{0, -66, 20, 6, 0, -1.5, -6.0, Lips::kUpper}, {0, -56, 18, 7, 0, -0.6, -2.2, Lips::kUpper}}, {});
    shapes.add_both("mouthShrugLower",
                    {{0, -77, 19, 9, 0, 4.5, 3.0, Lips::kLower}, {0, -99, 21, 12, 0, 6.0, 2.5}}, {});
    shapes.add_both("mouthShrugUpper",
                    {{0, -64, 20, 9, 0, 4.5, 0.8, Lips::kUpper}, {0, -54, 14, 7, 0, 1.6, 1.2}}, {});
}

}  // namespace

std::vector<SparseShape> build_head_shapes(const HeadMesh& mesh) {
    ShapeBuilder shapes{mesh};
    add_upper_face(shapes);
    add_jaw(shapes);
    add_sideways(shapes, mesh);
    add_corners(shapes);
    add_lips(shapes);
    return shapes.take();
}

}  // namespace rig::host
