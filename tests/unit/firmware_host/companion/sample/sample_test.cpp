#include "firmware_host/companion/sample/sample.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <tuple>

#include "firmware_host/companion/files/whole_file.hpp"
#include "firmware_host/companion/rig_folder/obj_import.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

namespace fs = std::filesystem;

const Rig& the_rig() {
    static const Rig rig = sample_rig();
    return rig;
}

const MarkerLayout& the_layout() {
    static const MarkerLayout layout = sample_layout(the_rig());
    return layout;
}

float distance(const Float3& a, const Float3& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

std::set<std::int32_t> vertices_of(const std::string& part) {
    const Rig& rig = the_rig();
    std::set<std::int32_t> vertices;
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        if (rig.parts[rig.triangle_part[t]] == part)
            vertices.insert(rig.triangles[t].begin(), rig.triangles[t].end());
    }
    return vertices;
}

// Largest displacement of a shape, mm.
double amplitude_mm(const std::string& name) {
    double largest = 0.0;
    for (const SparseShape& shape : the_rig().shapes) {
        if (shape.name != name) continue;
        for (const Float3& d : shape.delta_mm)
            largest = std::max(largest, static_cast<double>(std::hypot(d[0], d[1], d[2])));
    }
    return largest;
}

TEST(SampleHead, IsAHeadInSize) {
    const Rig& rig = the_rig();
    EXPECT_GE(rig.vertices_mm.size(), 3000U);
    EXPECT_LE(rig.vertices_mm.size(), 12000U);
    EXPECT_GE(rig.shapes.size(), 30U);
    Float3 low{1e9F, 1e9F, 1e9F}, high{-1e9F, -1e9F, -1e9F};
    for (const std::int32_t v : vertices_of("face")) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            low[axis] = std::min(low[axis], rig.vertices_mm[static_cast<std::size_t>(v)][axis]);
            high[axis] = std::max(high[axis], rig.vertices_mm[static_cast<std::size_t>(v)][axis]);
        }
    }
    EXPECT_NEAR(high[0], 75.0F, 6.0F);  // half the width
    EXPECT_NEAR(high[2], 45.0F, 5.0F);  // tip of the nose in front of the eyes
    EXPECT_EQ(low[0], -high[0]);
    for (const char* eye : {"eyeball_L", "eyeball_R"}) {
        const auto vertices = vertices_of(eye);
        Float3 sum{};
        for (const std::int32_t v : vertices) {
            for (std::size_t axis = 0; axis < 3; ++axis)
                sum[axis] += rig.vertices_mm[static_cast<std::size_t>(v)][axis];
        }
        const auto count = static_cast<float>(vertices.size());
        EXPECT_NEAR(std::abs(sum[0] / count), 31.0F, 0.1F);
        EXPECT_NEAR(sum[1] / count, 0.0F, 0.1F);
        EXPECT_NEAR(sum[2] / count, 0.0F, 0.1F);
    }
}

TEST(SampleHead, FacesPointOutward) {
    const Rig& rig = the_rig();
    // Six times the enclosed volume; the open neck and mouth leave it far from zero.
    double volume = 0.0;
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        const auto corner = [&](std::size_t i) {
            return rig.vertices_mm[static_cast<std::size_t>(rig.triangles[t][i])];
        };
        const Float3 a = corner(0), b = corner(1), c = corner(2);
        volume +=
            static_cast<double>(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                                a[2] * (b[0] * c[1] - b[1] * c[0])) /
            6.0;
    }
    EXPECT_GT(volume, 3.0e6);  // mm^3: heads hold 4 to 5 litres
    EXPECT_LT(volume, 7.0e6);
}

using Point = std::tuple<float, float, float>;

TEST(SampleHead, IsMirroredExactly) {
    const Rig& rig = the_rig();
    std::multiset<Point> points;
    for (const Float3& p : rig.vertices_mm) points.emplace(p[0] + 0.0F, p[1], p[2]);
    for (const Float3& p : rig.vertices_mm) {
        EXPECT_EQ(points.count({p[0] + 0.0F, p[1], p[2]}), points.count({0.0F - p[0], p[1], p[2]}));
    }
}

TEST(SampleHead, RightShapesMirrorLeftOnes) {
    const Rig& rig = the_rig();
    std::map<std::string, const SparseShape*> shapes;
    for (const SparseShape& shape : rig.shapes) shapes[shape.name] = &shape;
    std::size_t pairs = 0;
    for (const auto& [name, left] : shapes) {
        if (!name.ends_with("_L")) continue;
        const auto right = shapes.find(name.substr(0, name.size() - 1) + "R");
        ASSERT_NE(right, shapes.end()) << name;
        using Moved = std::pair<Point, Point>;
        const auto moves = [&](const SparseShape& shape, float side) {
            std::multiset<Moved> set;
            for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
                const Float3& p = rig.vertices_mm[static_cast<std::size_t>(shape.vertices[i])];
                const Float3& d = shape.delta_mm[i];
                set.insert({{side * p[0] + 0.0F, p[1], p[2]}, {side * d[0] + 0.0F, d[1], d[2]}});
            }
            return set;
        };
        EXPECT_EQ(moves(*left, 1.0F), moves(*right->second, -1.0F)) << name;
        ++pairs;
    }
    EXPECT_GE(pairs, 10U);
}

TEST(SampleHead, AmplitudesAreThoseOfPeople) {
    struct Row {
        const char* name;
        double low_mm, high_mm;
    };
    for (const Row& row : {Row{"jawOpen", 25, 36}, Row{"mouthSmile_L", 8, 13}, Row{"browInnerUp_L", 5, 8},
                           Row{"browOuterUp_R", 5, 9}, Row{"browDown_L", 5, 8}, Row{"eyeBlink_L", 7, 12},
                           Row{"cheekPuff_R", 8, 13}, Row{"jawForward", 6, 10}, Row{"jawLeft", 7, 13},
                           Row{"mouthPucker", 8, 14}}) {
        EXPECT_GE(amplitude_mm(row.name), row.low_mm) << row.name;
        EXPECT_LE(amplitude_mm(row.name), row.high_mm) << row.name;
    }
}

TEST(SampleHead, ClosedLidsCoverTheEyeball) {
    const Rig& rig = the_rig();
    std::vector<Float3> closed = rig.vertices_mm;
    for (const SparseShape& shape : rig.shapes) {
        if (shape.name != "eyeBlink_L") continue;
        for (std::size_t i = 0; i < shape.vertices.size(); ++i) {
            for (std::size_t axis = 0; axis < 3; ++axis) {
                closed[static_cast<std::size_t>(shape.vertices[i])][axis] += shape.delta_mm[i][axis];
            }
        }
    }
    // No skin in front of the eye lies inside the eyeball, open, half closed or closed; rims do, on purpose.
    for (const std::int32_t v : vertices_of("face")) {
        const auto i = static_cast<std::size_t>(v);
        const float open_mm = distance(rig.vertices_mm[i], {31, 0, 0});
        if (rig.vertices_mm[i][2] < 5.0F || open_mm < 12.2F || open_mm > 20.0F) continue;
        for (const float weight : {0.5F, 1.0F}) {
            Float3 p = rig.vertices_mm[i];
            for (std::size_t axis = 0; axis < 3; ++axis) p[axis] += weight * (closed[i][axis] - p[axis]);
            EXPECT_GT(distance(p, {31, 0, 0}), 12.2F) << v << " at weight " << weight;
        }
    }
}

TEST(SampleLayout, IsSymmetricSpacedAndOnSkin) {
    const MarkerLayout& layout = the_layout();
    const Rig& rig = the_rig();
    ASSERT_EQ(layout.markers.size(), 60U);
    const auto face = vertices_of("face");
    std::map<std::string, const LayoutMarker*> by_name;
    for (const LayoutMarker& marker : layout.markers) by_name[marker.name] = &marker;
    ASSERT_EQ(by_name.size(), 60U);
    for (const LayoutMarker& marker : layout.markers) {
        EXPECT_TRUE(face.contains(marker.vertices[0])) << marker.name;
        EXPECT_GT(marker.normal[2], 0.0F) << marker.name;
        for (const float eye_x : {-31.0F, 31.0F}) {
            EXPECT_GT(distance(marker.neutral_mm, {eye_x, 0, 13}), 15.0F) << marker.name;  // no lids
        }
        for (const LayoutMarker& other : layout.markers) {
            if (&other == &marker) continue;
            EXPECT_GE(distance(marker.neutral_mm, other.neutral_mm), 8.0F)
                << marker.name << " " << other.name;
        }
        const std::string& name = marker.name;
        const std::string twin = name.ends_with("_M")
                                     ? name
                                     : name.substr(0, name.size() - 1) + (name.ends_with("_L") ? "R" : "L");
        ASSERT_TRUE(by_name.contains(twin)) << name;
        EXPECT_EQ(by_name[twin]->neutral_mm,
                  (Float3{0.0F - marker.neutral_mm[0], marker.neutral_mm[1], marker.neutral_mm[2]}))
            << name;
    }
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        if (rig.parts[rig.triangle_part[t]] != "face") continue;
        const auto corner = [&](std::size_t i) {
            return rig.vertices_mm[static_cast<std::size_t>(rig.triangles[t][i])];
        };
        const bool near_marker = std::ranges::any_of(layout.markers, [&](const LayoutMarker& marker) {
            return distance(marker.neutral_mm, corner(0)) < 8.0F;
        });
        if (!near_marker) continue;
        for (std::size_t i = 0; i < 3; ++i)
            EXPECT_LT(distance(corner(i), corner((i + 1) % 3)), 10.0F) << "triangle " << t;
    }
}

TEST(SampleLayout, MarkersSeeTheShapesApart) {
    const std::size_t shape_count = the_rig().shapes.size();
    const MarkerModel model = marker_model(the_rig(), the_layout());
    const auto product = [&](std::size_t a, std::size_t b) {
        double sum = 0.0;
        for (std::size_t row = 0; row < model.neutral_mm.size(); ++row) {
            sum += static_cast<double>(model.basis_mm[row * shape_count + a]) *
                   static_cast<double>(model.basis_mm[row * shape_count + b]);
        }
        return sum;
    };
    std::size_t visible = 0;
    for (std::size_t a = 0; a < shape_count; ++a) {
        const double length_a = std::sqrt(product(a, a));
        EXPECT_GT(length_a, 0.3) << the_rig().shapes[a].name;
        if (length_a > 3.0) ++visible;
        for (std::size_t b = 0; b < a; ++b) {
            const double cosine = product(a, b) / (length_a * std::sqrt(product(b, b)));
            EXPECT_LE(std::abs(cosine), 0.97)
                << the_rig().shapes[a].name << " and " << the_rig().shapes[b].name;
        }
    }
    EXPECT_GE(visible, 25U);
}

TEST(SampleTake, MovesEveryShapeSmoothly) {
    const Take take = sample_take(the_rig());
    const std::size_t shape_count = take.shape_names.size();
    ASSERT_EQ(take.frame_count, 1200U);
    ASSERT_EQ(take.rate_hz, 60.0);
    ASSERT_EQ(take.weights.size(), 1200 * shape_count);
    for (std::size_t s = 0; s < shape_count; ++s) {
        float largest = 0.0F, fastest = 0.0F, sharpest = 0.0F;
        for (std::size_t frame = 0; frame < take.frame_count; ++frame) {
            const auto at = [&](std::size_t f) { return take.weights[f * shape_count + s]; };
            ASSERT_GE(at(frame), 0.0F);
            ASSERT_LE(at(frame), 1.0F);
            if (frame < 30) {
                EXPECT_LE(at(frame), 0.05F) << take.shape_names[s];
            }
            largest = std::max(largest, at(frame));
            if (frame > 0) fastest = std::max(fastest, std::abs(at(frame) - at(frame - 1)));
            if (frame > 1)
                sharpest = std::max(sharpest, std::abs(at(frame) - 2 * at(frame - 1) + at(frame - 2)));
        }
        EXPECT_GE(largest, 0.5F) << take.shape_names[s];
        // A blink closes in seven frames; nothing else is nearly as fast.
        const bool is_blink = take.shape_names[s].starts_with("eyeBlink");
        EXPECT_LE(fastest, is_blink ? 0.25F : 0.17F) << take.shape_names[s];
        EXPECT_LE(sharpest, is_blink ? 0.12F : 0.07F) << take.shape_names[s];
    }
}

std::map<std::string, std::string> contents_of(const fs::path& folder) {
    std::map<std::string, std::string> contents;
    for (const auto& entry : fs::directory_iterator(folder)) {
        contents[entry.path().filename().string()] = read_whole_text(entry.path()).value();
    }
    return contents;
}

TEST(SampleFolder, TwoRunsWriteTheSameBytesAndTheyLoad) {
    const rig::test::TempFolder folder;
    ASSERT_TRUE(save_sample(folder / "a"));
    ASSERT_TRUE(save_sample(folder / "b"));
    const auto first = contents_of(folder / "a");
    EXPECT_EQ(first.size(), 12U);
    EXPECT_EQ(first, contents_of(folder / "b"));
    const auto rig = load_rig(folder / "a");
    ASSERT_TRUE(rig) << rig.error().message;
    EXPECT_EQ(rig->vertices_mm, the_rig().vertices_mm);
    const auto layout = load_layout(folder / "a", "60", *rig);
    ASSERT_TRUE(layout) << layout.error().message;
    const auto take = load_take(folder / "a" / "take.csv", *rig);
    ASSERT_TRUE(take) << take.error().message;
    EXPECT_EQ(take->weights, sample_take(the_rig()).weights);
    EXPECT_EQ(take->rate_hz, 60.0);
}

// What a modelling program would export: six decimals, one file a shape.
void export_obj(const fs::path& path, const Rig& rig, const SparseShape* shape) {
    std::vector<Float3> vertices = rig.vertices_mm;
    for (std::size_t i = 0; shape != nullptr && i < shape->vertices.size(); ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            vertices[static_cast<std::size_t>(shape->vertices[i])][axis] += shape->delta_mm[i][axis];
        }
    }
    std::string text;
    char line[128];
    for (const Float3& v : vertices) {
        std::snprintf(line, sizeof line, "v %.6f %.6f %.6f\n", static_cast<double>(v[0]),
                      static_cast<double>(v[1]), static_cast<double>(v[2]));
        text += line;
    }
    int part = -1;
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        if (rig.triangle_part[t] != part) {
            part = rig.triangle_part[t];
            text += "usemtl " + rig.parts[rig.triangle_part[t]] + "\n";
        }
        const Int3& c = rig.triangles[t];
        std::snprintf(line, sizeof line, "f %d %d %d\n", c[0] + 1, c[1] + 1, c[2] + 1);
        text += line;
    }
    ASSERT_TRUE(write_whole_text(path, text));
}

TEST(SampleFolder, SurvivesTheWayThroughObjFiles) {
    const rig::test::TempFolder folder;
    const Rig& rig = the_rig();
    export_obj(folder / "neutral.obj", rig, nullptr);
    for (const SparseShape& shape : rig.shapes) export_obj(folder / (shape.name + ".obj"), rig, &shape);
    std::string list = "name,vertex\n";
    for (const LayoutMarker& marker : the_layout().markers)
        list += marker.name + "," + std::to_string(marker.vertices[0]) + "\n";
    ASSERT_TRUE(write_whole_text(folder / "markers.csv", list));
    const auto back = import_obj_folder(
        {.folder = folder.path(), .neutral = "neutral.obj", .markers = folder / "markers.csv"});
    ASSERT_TRUE(back) << back.error().message;
    ASSERT_EQ(back->rig.vertices_mm.size(), rig.vertices_mm.size());
    EXPECT_EQ(back->rig.triangles, rig.triangles);
    for (std::size_t t = 0; t < rig.triangles.size(); ++t) {
        ASSERT_EQ(back->rig.parts[back->rig.triangle_part[t]], rig.parts[rig.triangle_part[t]]);
    }
    constexpr float kRounding_mm = 2.0e-5F;  // six decimals, and floats of 100 mm
    for (std::size_t v = 0; v < rig.vertices_mm.size(); ++v) {
        ASSERT_LE(distance(back->rig.vertices_mm[v], rig.vertices_mm[v]), kRounding_mm);
    }
    const MarkerModel model = marker_model(rig, the_layout());
    const MarkerModel again = marker_model(back->rig, back->layout);
    ASSERT_EQ(again.basis_mm.size(), model.basis_mm.size());
    for (std::size_t s = 0; s < rig.shapes.size(); ++s)
        ASSERT_EQ(back->rig.shapes[s].name, rig.shapes[s].name);
    for (std::size_t i = 0; i < model.basis_mm.size(); ++i) {
        // A delta at the edge of being dropped may be in one and not in the other.
        const float allowed_mm =
            again.basis_mm[i] == 0.0F || model.basis_mm[i] == 0.0F ? 0.0051F : kRounding_mm;
        ASSERT_NEAR(again.basis_mm[i], model.basis_mm[i], allowed_mm) << i;
    }
}

}  // namespace
}  // namespace rig::host
