#include <array>
#include <cmath>
#include <limits>

#include "core/base/check.hpp"
#include "core/base/linalg.hpp"
#include "core/base/math.hpp"
#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {

namespace {

// Where the marker goes, seen from in front; the nearest vertex of the face carries it.
struct Spot {
    const char* name;
    double x_mm, y_mm;
};

constexpr std::array kMiddle{Spot{"FH_M", 0, 47},  Spot{"GL_M", 0, 20},  Spot{"NT_M", 0, -32},
                             Spot{"UL_M", 0, -58}, Spot{"LL_M", 0, -84}, Spot{"CH_M", 0, -101},
                             Spot{"NB_M", 0, -7},  Spot{"FH2_M", 0, 34}};
// Of the left side; the right one mirrors it.
constexpr std::array kSides{
    Spot{"BR1", 11.5, 27},    Spot{"BR2", 25, 30},    Spot{"BR3", 40, 28.5},  Spot{"BR4", 53, 21.5},
    Spot{"FH1", 17, 45},      Spot{"FH2", 37, 46},    Spot{"EY1", 18.5, -17}, Spot{"EY2", 33, -19},
    Spot{"EY3", 48.5, -14},   Spot{"NW", 18, -40},    Spot{"CK1", 28, -31},   Spot{"CK2", 42.5, -34},
    Spot{"CK3", 40, -50},     Spot{"CK4", 56.5, -26}, Spot{"CK5", 53, -58},   Spot{"NL", 24.5, -50},
    Spot{"UL1", 10.5, -60.5}, Spot{"MC", 31, -72},    Spot{"LL1", 13, -82},   Spot{"CH1", 16, -96},
    Spot{"JW1", 32, -95},     Spot{"JW2", 45.5, -84}, Spot{"NS", 11.5, -24},  Spot{"TM", 58, 5},
    Spot{"UL2", 21, -62},     Spot{"FH3", 52, 37}};

bool is_skin(const Rig& rig, std::size_t triangle) {
    const std::string& part = rig.parts[rig.triangle_part[triangle]];
    return part == "face" || part == "back_head";
}

Vec3 to_vec3(const Float3& v) {
    return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

// Area-weighted over the skin around each vertex; zero for vertices without skin.
std::vector<Vec3> skin_normals(const Rig& rig) {
    std::vector<Vec3> normals(rig.vertices_mm.size(), Vec3::Zero());
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        if (!is_skin(rig, t)) continue;
        const auto corner = [&](std::size_t i) { return static_cast<std::size_t>(rig.triangles[t][i]); };
        const Vec3 a = to_vec3(rig.vertices_mm[corner(0)]);
        const Vec3 twice_area =
            (to_vec3(rig.vertices_mm[corner(1)]) - a).cross(to_vec3(rig.vertices_mm[corner(2)]) - a);
        for (std::size_t i = 0; i < 3; ++i) normals[corner(i)] += twice_area;
    }
    for (Vec3& normal : normals) {
        const double length = rig::sqrt(normal.dot(normal));
        if (length > 0.0) normal /= length;
    }
    return normals;
}

std::size_t nearest_vertex(const Rig& rig, const std::vector<Vec3>& normals, double x_mm, double y_mm) {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t v = 0; v < rig.vertices_mm.size(); ++v) {
        if (normals[v].z() < 0.1) continue;  // not seen from in front
        const Vec3 p = to_vec3(rig.vertices_mm[v]);
        if (p.z() < -45.0) continue;
        const double distance2 = (p.x() - x_mm) * (p.x() - x_mm) + (p.y() - y_mm) * (p.y() - y_mm);
        if (distance2 < least) {
            least = distance2;
            nearest = v;
        }
    }
    RIG_CHECK(least < 9.0);
    return nearest;
}

LayoutMarker on_vertex(const Rig& rig, const std::vector<Vec3>& normals, std::string name,
                       std::size_t vertex) {
    const auto index = static_cast<std::int32_t>(vertex);
    const Vec3& n = normals[vertex];
    return {.name = std::move(name),
            .vertices = {index, index, index},
            .barycentric = {1.0F, 0.0F, 0.0F},
            .neutral_mm = rig.vertices_mm[vertex],
            .normal = {static_cast<float>(n.x()), static_cast<float>(n.y()), static_cast<float>(n.z())}};
}

}  // namespace

MarkerLayout sample_layout(const Rig& rig) {
    const std::vector<Vec3> normals = skin_normals(rig);
    MarkerLayout layout;
    for (const Spot& spot : kMiddle) {
        layout.markers.push_back(
            on_vertex(rig, normals, spot.name, nearest_vertex(rig, normals, spot.x_mm, spot.y_mm)));
    }
    for (const Spot& spot : kSides) {
        const std::size_t left = nearest_vertex(rig, normals, spot.x_mm, spot.y_mm);
        const Float3& p = rig.vertices_mm[left];
        const std::size_t right =
            nearest_vertex(rig, normals, -static_cast<double>(p[0]), static_cast<double>(p[1]));
        layout.markers.push_back(on_vertex(rig, normals, std::string{spot.name} + "_L", left));
        layout.markers.push_back(on_vertex(rig, normals, std::string{spot.name} + "_R", right));
    }
    return layout;
}

}  // namespace rig::host
