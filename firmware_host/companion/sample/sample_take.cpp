#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>

#include "core/base/check.hpp"
#include "firmware_host/companion/sample/curve.hpp"
#include "firmware_host/companion/sample/sample.hpp"

namespace rig::host {

namespace {

constexpr double kRate_hz = 60.0;
constexpr std::size_t kFrames = 1200;

// A weight that rises smoothly from 0 to `peak`, holds for a fifth of its length, and falls back.
struct Gesture {
    std::string_view shape;  // without _L or _R: both sides, the right one a little later and weaker
    double start_s, length_s, peak;
};

double gesture_value(const Gesture& gesture, double time_s) {
    const double t = (time_s - gesture.start_s) / gesture.length_s;
    return gesture.peak * smooth_step(0.0, 0.4, t) * (1.0 - smooth_step(0.6, 1.0, t));
}

// First every shape by itself, in this order, overlapping its neighbours.
constexpr std::array<std::string_view, 29> kTour{
    "browInnerUp", "browOuterUp",    "browDown",       "eyeWide",         "eyeSquint",      "eyeBlink",
    "cheekSquint", "noseSneer",      "cheekPuff",      "jawForward",      "jawLeft",        "jawRight",
    "jawOpen",     "mouthClose",     "mouthSmile",     "mouthFrown",      "mouthDimple",    "mouthStretch",
    "mouthPress",  "mouthUpperUp",   "mouthLowerDown", "mouthPucker",     "mouthFunnel",    "mouthLeft",
    "mouthRight",  "mouthRollLower", "mouthRollUpper", "mouthShrugLower", "mouthShrugUpper"};
constexpr double kTourStart_s = 0.5;
constexpr double kTourStride_s = 0.3;
constexpr double kTourLength_s = 0.85;

// What lips and jaw do for a sound.
struct Pose {
    std::string_view shape;
    double weight;
};
constexpr std::array kOpenA{Pose{"jawOpen", 0.62}, Pose{"mouthLowerDown", 0.35}, Pose{"mouthUpperUp", 0.15}};
constexpr std::array kRoundO{Pose{"jawOpen", 0.36}, Pose{"mouthFunnel", 0.60}};
constexpr std::array kRoundU{Pose{"jawOpen", 0.12}, Pose{"mouthPucker", 0.68}};
constexpr std::array kWideE{Pose{"jawOpen", 0.24}, Pose{"mouthStretch", 0.42}, Pose{"mouthSmile", 0.28}};
constexpr std::array kShutM{Pose{"mouthPress", 0.55}, Pose{"mouthRollUpper", 0.18}, Pose{"jawOpen", 0.03}};
constexpr std::array kBitF{Pose{"mouthRollLower", 0.50}, Pose{"mouthUpperUp", 0.28}, Pose{"jawOpen", 0.10}};
constexpr std::array kTongueL{Pose{"jawOpen", 0.28}, Pose{"mouthShrugUpper", 0.20},
                              Pose{"mouthLowerDown", 0.22}};

using Sound = std::span<const Pose>;
const std::array<Sound, 30> kSpeech{kShutM,   kOpenA,  kTongueL, kRoundO,  kBitF,  kWideE, kShutM,   kRoundU,
                                    kTongueL, kOpenA,  kBitF,    kRoundO,  kShutM, kWideE, kTongueL, kOpenA,
                                    kRoundU,  kShutM,  kOpenA,   kTongueL, kWideE, kBitF,  kOpenA,   kRoundO,
                                    kShutM,   kRoundU, kTongueL, kWideE,   kOpenA, kShutM};
constexpr double kSpeechStart_s = 10.1;
constexpr double kSoundStride_s = 0.2;  // five sounds a second
constexpr double kSoundLength_s = 0.36;

// Then faces, with the brows that went along with speech in front.
constexpr std::array kFaces{
    Gesture{"browInnerUp", 10.6, 1.2, 0.35}, Gesture{"browOuterUp", 12.4, 1.5, 0.40},
    Gesture{"browDown", 14.3, 1.1, 0.30},    Gesture{"mouthSmile", 16.3, 1.4, 0.85},
    Gesture{"cheekSquint", 16.4, 1.2, 0.70}, Gesture{"eyeSquint", 16.4, 1.2, 0.50},
    Gesture{"browInnerUp", 17.2, 1.0, 0.80}, Gesture{"browOuterUp", 17.2, 1.0, 0.75},
    Gesture{"eyeWide", 17.2, 0.9, 0.70},     Gesture{"jawOpen", 17.3, 0.9, 0.55},
    Gesture{"browDown", 18.0, 1.0, 0.85},    Gesture{"noseSneer", 18.0, 1.0, 0.60},
    Gesture{"mouthPress", 18.1, 0.9, 0.50},  Gesture{"browInnerUp", 18.7, 1.1, 0.55},
    Gesture{"mouthFrown", 18.7, 1.1, 0.70},  Gesture{"mouthShrugLower", 18.8, 0.9, 0.50}};

constexpr std::array kBlinks_s{2.6, 5.1, 7.7, 10.4, 12.1, 13.2, 15.6, 17.95, 19.3};
constexpr double kBlinkLength_s = 0.3;

class Performance {
  public:
    explicit Performance(const Rig& rig)
        : shape_count_(rig.shapes.size()), stillness_(kFrames * rig.shapes.size(), 1.0) {
        for (const SparseShape& shape : rig.shapes) names_.push_back(shape.name);
    }

    // Both sides where the shape has sides.
    void add(const Gesture& gesture) {
        const std::string stem{gesture.shape};
        if (index_of(stem) < shape_count_) {
            add_to(index_of(stem), gesture);
            return;
        }
        Gesture right = gesture;
        right.start_s += 0.04;
        right.peak *= 0.9;
        add_to(index_of(stem + "_L"), gesture);
        add_to(index_of(stem + "_R"), right);
    }
    void blink(double start_s) {
        for (const char* name : {"eyeBlink_L", "eyeBlink_R"}) {
            add_to(index_of(name), {"eyeBlink", start_s, kBlinkLength_s, 0.97});
        }
    }
    [[nodiscard]] Take take() const {
        Take take{.shape_names = names_, .rate_hz = kRate_hz, .frame_count = kFrames, .weights = {}};
        for (const double stillness : stillness_) {
            // Five decimals, as the file holds them, so that what is saved and loaded is the same take.
            take.weights.push_back(static_cast<float>(std::round((1.0 - stillness) * 1.0e5) / 1.0e5));
        }
        return take;
    }

  private:
    [[nodiscard]] std::size_t index_of(std::string_view name) const {
        return static_cast<std::size_t>(std::ranges::find(names_, name) - names_.begin());
    }
    // Gestures that overlap join to 1 - (1 - a)(1 - b): smooth, and never above 1.
    void add_to(std::size_t shape, const Gesture& gesture) {
        RIG_CHECK(shape < shape_count_);
        for (std::size_t frame = 0; frame < kFrames; ++frame) {
            const double time_s = static_cast<double>(frame) / kRate_hz;
            stillness_[frame * shape_count_ + shape] *= 1.0 - gesture_value(gesture, time_s);
        }
    }

    std::size_t shape_count_;
    std::vector<double> stillness_;  // product of (1 - weight) so far
    std::vector<std::string> names_;
};

}  // namespace

Take sample_take(const Rig& rig) {
    Performance performance{rig};
    for (std::size_t i = 0; i < kTour.size(); ++i) {
        const double start_s = kTourStart_s + kTourStride_s * static_cast<double>(i);
        performance.add({kTour[i], start_s, kTourLength_s, 0.72 + 0.06 * static_cast<double>(i % 5)});
        // Lips can only close on a jaw that is open.
        if (kTour[i] == "mouthClose") performance.add({"jawOpen", start_s - 0.05, kTourLength_s + 0.1, 0.6});
    }
    for (std::size_t i = 0; i < kSpeech.size(); ++i) {
        const double start_s = kSpeechStart_s + kSoundStride_s * static_cast<double>(i);
        for (const Pose& pose : kSpeech[i])
            performance.add({pose.shape, start_s, kSoundLength_s, pose.weight});
    }
    for (const Gesture& gesture : kFaces) performance.add(gesture);
    for (const double start_s : kBlinks_s) performance.blink(start_s);
    return performance.take();
}

}  // namespace rig::host
