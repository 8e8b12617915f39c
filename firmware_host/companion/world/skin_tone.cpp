#include "firmware_host/companion/world/skin_tone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>

#include "firmware_host/companion/world/vector.hpp"

namespace rig::host {

namespace {

// Reflectances in the near infrared and green, where such cameras look; eye-balled against the reference
// pictures.
constexpr double kSkinAlbedo = 0.62;
constexpr double kLipAlbedo = 0.46;
constexpr double kBrowAlbedo = 0.30;
constexpr double kTeethAlbedo = 0.80;
constexpr double kGumsAlbedo = 0.40;
constexpr double kEyeWhiteAlbedo = 0.75;
constexpr double kIrisAlbedo = 0.28;
constexpr double kPupilAlbedo = 0.04;
constexpr double kNeckAlbedo = 0.42;
constexpr double kIrisRadius_mm = 5.9;
constexpr double kPupilRadius_mm = 2.2;

double lattice(std::uint64_t seed, std::int64_t x, std::int64_t y, std::int64_t z) {
    const auto mixed = static_cast<std::uint64_t>(x * 73856093) ^ static_cast<std::uint64_t>(y * 19349663) ^
                       static_cast<std::uint64_t>(z * 83492791);
    return 2.0 * uniform(seed, 7, mixed) - 1.0;
}

// Smooth noise in [-1, 1] with features of the given size.
double value_noise(std::uint64_t seed, const Vec3d& p_mm, double size_mm) {
    std::array<std::int64_t, 3> cell{};
    Vec3d f{};
    for (std::size_t k = 0; k < 3; ++k) {
        const double scaled = p_mm[k] / size_mm;
        cell[k] = static_cast<std::int64_t>(std::floor(scaled));
        const double t = scaled - std::floor(scaled);
        f[k] = t * t * (3.0 - 2.0 * t);
    }
    double sum = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
        const int dx = corner & 1, dy = (corner >> 1) & 1, dz = corner >> 2;
        const double weight = (dx ? f[0] : 1.0 - f[0]) * (dy ? f[1] : 1.0 - f[1]) * (dz ? f[2] : 1.0 - f[2]);
        sum += weight * lattice(seed, cell[0] + dx, cell[1] + dy, cell[2] + dz);
    }
    return sum;
}

double bump(double distance, double inner, double outer) {
    const double t = std::clamp((outer - distance) / (outer - inner), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
}

// How much of a vertex is eyebrow: two arches above eyes whose midpoint is the origin (the rig's convention).
double brow_at(std::uint64_t seed, const Vec3d& p) {
    if (p[2] < 0.0) return 0.0;
    const double along = std::abs(p[0]);
    const double middle =
        21.0 + 5.0 * std::sin(std::clamp((along - 14.0) / 38.0, 0.0, 1.0) * 0.75 * std::numbers::pi);
    const double half_height = 3.6 - 1.6 * std::clamp((along - 14.0) / 38.0, 0.0, 1.0);
    const double band = bump(std::abs(p[1] - middle), 0.4 * half_height, 1.3 * half_height);
    const double ends = bump(-along, -16.0, -9.0) * bump(along, 44.0, 54.0);
    const double strokes = 0.75 + 0.25 * value_noise(seed + 3, {2.0 * p[0], p[1], p[2]}, 2.2);
    return band * ends * strokes;
}

struct LipSeam {
    std::vector<Vec3d> points;
};

// Lips are where skin that lies close together parts when the jaw opens.
LipSeam lip_seam(const Rig& rig, const std::vector<Vec3d>& rest, const std::vector<bool>& is_skin) {
    LipSeam seam;
    const auto jaw = std::find_if(rig.shapes.begin(), rig.shapes.end(), [](const SparseShape& shape) {
        return shape.name.starts_with("jawOpen") || shape.name.starts_with("jaw_open");
    });
    if (jaw == rig.shapes.end()) return seam;
    std::vector<double> drop(rest.size(), 0.0);
    for (std::size_t i = 0; i < jaw->vertices.size(); ++i) {
        drop[static_cast<std::size_t>(jaw->vertices[i])] = -static_cast<double>(jaw->delta_mm[i][1]);
    }
    const double largest = *std::max_element(drop.begin(), drop.end());
    std::vector<std::size_t> low, high;  // moving and resting skin that faces forward, below the nose
    for (std::size_t v = 0; v < rest.size(); ++v) {
        if (!is_skin[v] || rest[v][2] < 5.0 || rest[v][1] > -15.0) continue;
        if (drop[v] > 0.35 * largest) low.push_back(v);
        if (drop[v] < 0.15 * largest) high.push_back(v);
    }
    for (const std::size_t a : low) {
        for (const std::size_t b : high) {
            if (std::abs(rest[a][0] - rest[b][0]) > 3.0) continue;
            if (length(rest[a] - rest[b]) < 3.0) {
                seam.points.push_back(rest[a]);
                break;
            }
        }
    }
    return seam;
}

double lip_at(const LipSeam& seam, const Vec3d& p) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3d& point : seam.points) {
        const double dx = 0.8 * (p[0] - point[0]);
        const double dy = p[1] - point[1];
        nearest = std::min(nearest, dx * dx + dy * dy);
    }
    return bump(std::sqrt(nearest), 5.5, 8.5);
}

enum class Surface { kSkin, kNeck, kEyeWhite, kIris, kTeeth, kGums };

Surface surface_of(std::string_view part) {
    const auto has = [&](std::string_view word) { return part.find(word) != std::string_view::npos; };
    if (has("BackHead") || has("Neck") || has("back")) return Surface::kNeck;
    if (has("Sclera") || has("sclera") || has("Eyeball") || has("eyeball")) return Surface::kEyeWhite;
    if (has("Iris") || has("iris")) return Surface::kIris;
    if (has("Teeth") || has("teeth")) return Surface::kTeeth;
    if (has("Gums") || has("gums") || has("Tongue") || has("tongue") || has("Mouth") || has("mouth")) {
        return Surface::kGums;
    }
    return Surface::kSkin;
}

// Centre of the front of each eye part: the iris is painted there.
std::vector<Vec3d> part_centres(const Rig& rig, const std::vector<Vec3d>& rest) {
    std::vector<Vec3d> sums(256), centres(256);
    std::vector<double> counts(256, 0.0);
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        for (const std::int32_t v : rig.triangles[t]) {
            sums[rig.triangle_part[t]] = sums[rig.triangle_part[t]] + rest[static_cast<std::size_t>(v)];
            counts[rig.triangle_part[t]] += 1.0;
        }
    }
    for (std::size_t part = 0; part < 256; ++part) {
        if (counts[part] > 0.0) centres[part] = (1.0 / counts[part]) * sums[part];
    }
    return centres;
}

double eye_albedo(const Vec3d& p, const Vec3d& centre) {
    if (p[2] < centre[2]) return kEyeWhiteAlbedo;
    const double off_axis = std::hypot(p[0] - centre[0], p[1] - centre[1]);
    const double iris = bump(off_axis, kIrisRadius_mm - 0.4, kIrisRadius_mm + 0.4);
    const double pupil = bump(off_axis, kPupilRadius_mm - 0.4, kPupilRadius_mm + 0.4);
    return kEyeWhiteAlbedo + iris * (kIrisAlbedo - kEyeWhiteAlbedo) + pupil * (kPupilAlbedo - kIrisAlbedo);
}

// Depth of the head seen from far away along one direction.
class DepthMap {
  public:
    DepthMap(const Vec3d& towards_viewer, std::span<const Float3> vertices, std::span<const Int3> triangles)
        : w_(towards_viewer) {
        const Vec3d aside = std::abs(w_[1]) < 0.9 ? Vec3d{0, 1, 0} : Vec3d{1, 0, 0};
        u_ = normalised(cross(aside, w_));
        v_ = cross(w_, u_);
        low_ = {1e9, 1e9, 1e9};
        Vec3d high{-1e9, -1e9, -1e9};
        points_.reserve(vertices.size());
        for (const Float3& p : vertices) {
            const Vec3d q{static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
            const Vec3d seen{dot(q, u_), dot(q, v_), dot(q, w_)};
            points_.push_back(seen);
            for (std::size_t k = 0; k < 3; ++k) {
                low_[k] = std::min(low_[k], seen[k]);
                high[k] = std::max(high[k], seen[k]);
            }
        }
        cell_ = std::max(high[0] - low_[0], high[1] - low_[1]) / (kSide - 2) + 1e-6;
        depth_.assign(kSide * kSide, -1e9);
        for (const Int3& triangle : triangles) draw(triangle);
    }

    [[nodiscard]] bool open(std::size_t vertex, double bias_mm) const {
        const Vec3d& p = points_[vertex];
        const auto column = static_cast<std::size_t>((p[0] - low_[0]) / cell_ + 0.5);
        const auto row = static_cast<std::size_t>((p[1] - low_[1]) / cell_ + 0.5);
        return depth_[row * kSide + column] <= p[2] + bias_mm;
    }

  private:
    static constexpr std::size_t kSide = 160;

    void draw(const Int3& triangle) {
        std::array<Vec3d, 3> p{};
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = points_[static_cast<std::size_t>(triangle[k])];
            p[k][0] = (p[k][0] - low_[0]) / cell_;
            p[k][1] = (p[k][1] - low_[1]) / cell_;
        }
        const double area =
            (p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]);
        if (area == 0.0) return;
        const auto [x0, x1] = std::minmax({p[0][0], p[1][0], p[2][0]});
        const auto [y0, y1] = std::minmax({p[0][1], p[1][1], p[2][1]});
        for (double y = std::ceil(y0); y <= y1; y += 1.0) {
            for (double x = std::ceil(x0); x <= x1; x += 1.0) {
                const double b =
                    ((x - p[0][0]) * (p[2][1] - p[0][1]) - (p[2][0] - p[0][0]) * (y - p[0][1])) / area;
                const double c =
                    ((p[1][0] - p[0][0]) * (y - p[0][1]) - (x - p[0][0]) * (p[1][1] - p[0][1])) / area;
                if (b < 0.0 || c < 0.0 || b + c > 1.0) continue;
                const double depth = p[0][2] + b * (p[1][2] - p[0][2]) + c * (p[2][2] - p[0][2]);
                double& cell = depth_[static_cast<std::size_t>(y) * kSide + static_cast<std::size_t>(x)];
                cell = std::max(cell, depth);
            }
        }
    }

    Vec3d u_{}, v_{}, w_{}, low_{};
    double cell_ = 1.0;
    std::vector<Vec3d> points_;
    std::vector<double> depth_;
};

}  // namespace

SkinTone skin_tone(const Rig& rig, std::uint64_t seed) {
    std::vector<Vec3d> rest;
    for (const Float3& p : rig.vertices_mm) {
        rest.push_back({static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])});
    }
    std::vector<std::uint8_t> part(rest.size(), 0);
    std::vector<bool> is_skin(rest.size(), false);
    for (std::size_t t = rig.triangles.size(); t-- > 0;) {
        for (const std::int32_t v : rig.triangles[t])
            part[static_cast<std::size_t>(v)] = rig.triangle_part[t];
    }
    std::vector<Surface> surfaces(256, Surface::kSkin);
    for (std::size_t p = 0; p < rig.parts.size() && p < 256; ++p) surfaces[p] = surface_of(rig.parts[p]);
    for (std::size_t v = 0; v < rest.size(); ++v) is_skin[v] = surfaces[part[v]] == Surface::kSkin;
    const LipSeam seam = lip_seam(rig, rest, is_skin);
    const std::vector<Vec3d> centres = part_centres(rig, rest);

    SkinTone tone{std::vector<float>(rest.size()), std::vector<float>(rest.size())};
    for (std::size_t v = 0; v < rest.size(); ++v) {
        const Vec3d& p = rest[v];
        double albedo = kSkinAlbedo;
        double gloss = 0.25;
        const double blotch = 1.0 + 0.10 * value_noise(seed, p, 22.0) + 0.07 * value_noise(seed + 1, p, 8.0) +
                              0.06 * value_noise(seed + 2, p, 3.0);
        switch (surfaces[part[v]]) {
            case Surface::kSkin: {
                const double lip = lip_at(seam, p);
                const double brow = brow_at(seed, p);
                albedo = (kSkinAlbedo + lip * (kLipAlbedo - kSkinAlbedo)) * blotch;
                albedo += brow * (kBrowAlbedo - albedo);
                gloss += 0.25 * lip;
                break;
            }
            case Surface::kNeck:
                albedo = kNeckAlbedo * blotch;
                gloss = 0.1;
                break;
            case Surface::kEyeWhite:
            case Surface::kIris:
                albedo = eye_albedo(p, centres[part[v]]);
                gloss = 1.0;
                break;
            case Surface::kTeeth:
                albedo = kTeethAlbedo;
                gloss = 0.6;
                break;
            case Surface::kGums:
                albedo = kGumsAlbedo * blotch;
                gloss = 0.6;
                break;
        }
        tone.albedo[v] = static_cast<float>(std::clamp(albedo, 0.0, 1.0));
        tone.gloss[v] = static_cast<float>(gloss);
    }
    return tone;
}

std::vector<float> skin_openness(const Rig& rig, std::span<const Int3> triangles,
                                 std::span<const Float3> normals) {
    constexpr int kDirections = 48;
    constexpr double kBias_mm = 3.0;
    const std::size_t count = rig.vertices_mm.size();
    std::vector<double> open(count, 0.0), all(count, 1e-9);
    for (int d = 0; d < kDirections; ++d) {
        // A Fibonacci spiral over the front of the sphere, where the cameras and lights are.
        const double z = 1.0 - 1.3 * (d + 0.5) / kDirections;
        const double turn = d * std::numbers::pi * (3.0 - std::sqrt(5.0));
        const double r = std::sqrt(1.0 - z * z);
        const Vec3d direction{r * std::cos(turn), r * std::sin(turn), z};
        const DepthMap map(direction, rig.vertices_mm, triangles);
        for (std::size_t v = 0; v < count; ++v) {
            const double facing = static_cast<double>(normals[v][0]) * direction[0] +
                                  static_cast<double>(normals[v][1]) * direction[1] +
                                  static_cast<double>(normals[v][2]) * direction[2];
            if (facing <= 0.0) continue;
            all[v] += facing;
            if (map.open(v, kBias_mm)) open[v] += facing;
        }
    }
    std::vector<float> openness(count);
    for (std::size_t v = 0; v < count; ++v) openness[v] = static_cast<float>(open[v] / all[v]);
    return openness;
}

}  // namespace rig::host
