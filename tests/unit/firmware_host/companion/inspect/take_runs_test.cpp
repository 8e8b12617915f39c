// Takes of each kind, made by arithmetic, come back as what was put into them.
#include "firmware_host/companion/inspect/take_runs.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/wire/state_messages.hpp"
#include "firmware_host/companion/files/image_file.hpp"
#include "firmware_host/companion/files/npy.hpp"
#include "firmware_host/companion/inspect/inspect_page.hpp"
#include "firmware_host/companion/inspect/take_figures.hpp"
#include "firmware_host/companion/links/recording.hpp"
#include "firmware_host/companion/train/pack_writer.hpp"
#include "firmware_host/companion/train/train.hpp"
#include "firmware_host/take_log/observation_log.hpp"
#include "tests/support/pack_samples/tiny_rig.hpp"
#include "tests/support/random.hpp"
#include "tests/support/temp_folder.hpp"

namespace rig::host {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr std::size_t kMarkers = 24;
constexpr std::size_t kFrames = 120;

const InspectProgress kGoOn = [](std::uint64_t, std::uint64_t) { return true; };

// A camera 300 mm in front of the sheet.
CameraModel camera_ahead(double x_mm) {
    CameraModel camera;
    camera.width_px = 480;
    camera.height_px = 640;
    camera.fx_px = camera.fy_px = 700.0;
    camera.cx_px = 239.5;
    camera.cy_px = 319.5;
    const double turn = std::atan2(x_mm, 270.0);
    camera.camera_from_headset << std::cos(turn), 0.0, -std::sin(turn), 0.0, -1.0, 0.0, -std::sin(turn), 0.0,
        -std::cos(turn);
    camera.centre_mm = {x_mm, 0.0, 300.0};
    return camera;
}

class TakeRuns : public testing::Test {
  protected:
    TakeRuns() {
        TrainOptions options;
        options.takes = {tiny.take};
        options.cameras = {camera_ahead(-60.0), camera_ahead(60.0)};
        auto trained = train(tiny.rig, tiny.layout, options);
        EXPECT_TRUE(trained);
        EXPECT_TRUE(save_pack(folder / "tiny.pack", trained->view(), {.name = "tiny"}));
        auto opened = open_pack_file(folder / "tiny.pack");
        EXPECT_TRUE(opened);
        pack.emplace(std::move(*opened));
        const MarkerModel model = marker_model(tiny.rig, tiny.layout);
        const std::size_t shapes = tiny.rig.shapes.size();
        for (std::size_t f = 0; f < kFrames; ++f) {
            for (std::size_t row = 0; row < 3 * kMarkers; ++row) {
                float sum = model.neutral_mm[row];
                for (std::size_t i = 0; i < shapes; ++i)
                    sum += model.basis_mm[row * shapes + i] * tiny.take.weights[f * shapes + i];
                truth.push_back(sum + static_cast<float>(random.normal(0.0, 0.02)));
            }
        }
    }
    InspectRequest request(const std::string& name) {
        InspectRequest out;
        out.take = folder / name;
        out.pack_name = "tiny.pack";
        return out;
    }
    Vec3 truth_at(std::size_t frame, std::size_t marker) {
        const float* at = truth.data() + 3 * (frame * kMarkers + marker);
        return {static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2])};
    }
    // `hidden` of the first frames lack marker 5.
    void write_log(const std::string& name, std::size_t ticks) {
        ObservationLogHeader header;
        header.camera_count = 2;
        header.rate_millihertz = 60'000;
        header.pack_hash = pack->manifest().manifest_hash;
        const auto writer = ObservationLogWriter::create(folder / name, header);
        ASSERT_TRUE(writer);
        for (std::size_t t = 0; t < ticks; ++t) {
            std::array<std::vector<Observation>, 2> seen;
            for (std::size_t c = 0; c < 2; ++c) {
                for (std::size_t k = 0; k < kMarkers; ++k) {
                    if (k == 5 && t >= 60 && t < 90) continue;
                    const Projection at = project(pack->pack().cameras[c], truth_at(t, k));
                    seen[c].push_back(
                        {static_cast<float>(at.pixel[0]), static_cast<float>(at.pixel[1]), 9.0F, 0.4F, 0.9F});
                }
                if (t >= 100) seen[c].push_back({20.0F, 600.0F, 15.0F, 0.2F, 0.5F});
            }
            ObservationTick tick;
            tick.number = static_cast<std::uint32_t>(t);
            tick.capture_us = static_cast<std::int64_t>(t) * 16'667;
            tick.status = {CameraStatus::kGood, CameraStatus::kGood, CameraStatus::kUnused,
                           CameraStatus::kUnused};
            tick.cameras[0] = seen[0];
            tick.cameras[1] = seen[1];
            (*writer)->append(tick);
        }
        ASSERT_TRUE((*writer)->drain());
    }

    test::TempFolder folder;
    test::TinyRig tiny = test::tiny_rig(kMarkers, 5, 200);
    test::SeededRandom random{9};
    std::optional<OpenedPack> pack;
    std::vector<float> truth;
};

TEST_F(TakeRuns, KindsAreToldByContent) {
    ASSERT_TRUE(
        write_npy<float>(folder / "m.bin", {{1, kMarkers, 3}, std::vector<float>(3 * kMarkers, 0.0F)}));
    EXPECT_EQ(kind_of_take(folder / "m.bin"), TakeKind::kStream);
    EXPECT_EQ(kind_of_take(folder.path()), TakeKind::kPictures);
    write_log("t.rgo", 1);
    EXPECT_EQ(kind_of_take(folder / "t.rgo"), TakeKind::kLog);
    ASSERT_TRUE(RecordingWriter::create(folder / "t.rec")->close());
    EXPECT_EQ(kind_of_take(folder / "t.rec"), TakeKind::kRecording);
    std::ofstream(folder / "w.csv") << "frame,time_s,smile\n";
    const auto table = kind_of_take(folder / "w.csv");
    ASSERT_FALSE(table);
    EXPECT_NE(table.error().message.find("--raw"), std::string::npos) << table.error().message;
    const auto missing = kind_of_take(folder / "none.rgo");
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.find("none.rgo"), std::string::npos);
}

TEST_F(TakeRuns, AStreamsHiddenMarkerIsInferredAndItsOwnRow) {
    std::vector<float> values = truth;
    for (std::size_t f = 40; f < 70; ++f)
        std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(3 * (f * kMarkers + 7)), 3, kNan);
    ASSERT_TRUE(write_npy<float>(folder / "m.npy", {{kFrames, kMarkers, 3}, values}));
    const auto record = inspect_stream(request("m.npy"), pack->pack(), kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    const InspectFigures figures = figures_of(*record);
    EXPECT_EQ(figures.ticks, kFrames);
    EXPECT_NEAR(figures.visible, 1.0 - 30.0 / (kFrames * kMarkers), 1e-9);
    EXPECT_EQ(figures.lost, 0.0);
    EXPECT_NEAR(figures.markers[7].longest_hidden_s.value, 0.5, 1e-9);
    EXPECT_NEAR(figures.markers[7].longest_hidden_s.at_s, 40.0 / 60.0, 1e-9);
    EXPECT_LT(figures.residual_max_mm->value, 0.2);
    EXPECT_GT(*figures.residual_median_mm, 0.0);
    EXPECT_FALSE(record->counts_ghosts);
    ASSERT_FALSE(record->moments.empty());
    const std::vector<SceneBlob>& blobs = record->moments.front().views.front().blobs;
    ASSERT_EQ(blobs.size(), kMarkers);
    for (std::size_t k = 0; k < kMarkers; ++k) EXPECT_EQ(blobs[k].marker, static_cast<int>(k));
}

TEST_F(TakeRuns, AStreamWithoutAFaceIsLost) {
    std::vector<float> values = truth;
    std::fill(values.begin() + 50 * 3 * kMarkers, values.begin() + 80 * 3 * kMarkers, kNan);
    ASSERT_TRUE(write_npy<float>(folder / "m.npy", {{kFrames, kMarkers, 3}, values}));
    const auto record = inspect_stream(request("m.npy"), pack->pack(), kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    const InspectFigures figures = figures_of(*record);
    EXPECT_NEAR(figures.lost, 30.0 / kFrames, 1e-9);
    EXPECT_NEAR(figures.longest_loss_ms.value, 500.0, 1e-6);
    EXPECT_NEAR(figures.longest_loss_ms.at_s, 50.0 / 60.0, 1e-9);
    EXPECT_TRUE(std::ranges::any_of(figures.faults, [](const FaultSummary& f) { return f.number == 16; }));
}

TEST_F(TakeRuns, AnUnlabelledStreamsGhostsAreCounted) {
    std::vector<float> values;
    for (std::size_t f = 0; f < kFrames; ++f) {
        const auto from = truth.begin() + static_cast<std::ptrdiff_t>(3 * f * kMarkers);
        values.insert(values.end(), {150.0F, 150.0F, f >= 60 ? 0.0F : kNan});
        values.insert(values.end(), from, from + 3 * kMarkers);
    }
    ASSERT_TRUE(write_npy<float>(folder / "m.npy", {{kFrames, kMarkers + 1, 3}, values}));
    InspectRequest shuffled = request("m.npy");
    shuffled.unlabelled = true;
    const auto record = inspect_stream(shuffled, pack->pack(), kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    const InspectFigures figures = figures_of(*record);
    EXPECT_GT(figures.visible, 0.9);
    EXPECT_TRUE(record->counts_ghosts);
    EXPECT_GE(figures.ghosts, 60U);
    EXPECT_LE(figures.ghosts, 80U);
    const auto wrong = inspect_stream(request("m.npy"), pack->pack(), kGoOn);
    ASSERT_FALSE(wrong);
    EXPECT_NE(wrong.error().message.find("--unlabelled"), std::string::npos) << wrong.error().message;
}

TEST_F(TakeRuns, AnEmptyStreamHasAPage) {
    ASSERT_TRUE(write_npy<float>(folder / "m.npy", {{0, kMarkers, 3}, {}}));
    const auto record = inspect_stream(request("m.npy"), pack->pack(), kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    EXPECT_NE(inspect_page(*record).find("holds no frame"), std::string::npos);
}

TEST_F(TakeRuns, ALogTellsBlobsGhostsAndHiddenMarkers) {
    write_log("t.rgo", kFrames);
    const auto record = inspect_log(request("t.rgo"), *pack, kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    const InspectFigures figures = figures_of(*record);
    EXPECT_EQ(figures.ticks, kFrames);
    ASSERT_TRUE(figures.first_face_s);
    EXPECT_LT(*figures.first_face_s, 0.2);
    EXPECT_GE(figures.ghosts, 40U);
    EXPECT_LE(figures.ghosts, 44U);
    EXPECT_NEAR(figures.markers[5].longest_hidden_s.value, 0.5, 0.02);
    EXPECT_EQ(record->diameter_px.counts[9], record->diameter_px.total() - 40);
    EXPECT_EQ(record->cameras.size(), 2U);
    EXPECT_TRUE(record->cut.empty());
    const auto views = record->moments.back().views;
    ASSERT_EQ(views.size(), 2U);
    EXPECT_EQ(views[0].width_px, 480.0);
}

TEST_F(TakeRuns, ACutLogShowsWhatIsWhole) {
    write_log("t.rgo", 40);
    std::filesystem::resize_file(folder / "t.rgo", std::filesystem::file_size(folder / "t.rgo") - 11);
    const auto record = inspect_log(request("t.rgo"), *pack, kGoOn);
    ASSERT_TRUE(record) << record.error().message;
    EXPECT_EQ(record->ticks.size(), 39U);
    EXPECT_NE(record->cut.find("t.rgo"), std::string::npos);
    EXPECT_NE(inspect_page(*record).find("The file ends early"), std::string::npos);
}

TEST_F(TakeRuns, ARecordingIsShownAsItWasStreamed) {
    auto writer = RecordingWriter::create(folder / "t.rec");
    ASSERT_TRUE(writer);
    std::array<std::byte, kMaxWireFrameBytes> payload{};
    std::array<std::byte, kMaxWireFrameBytes> wire{};
    for (std::uint32_t t = 0; t < 60; ++t) {
        if (t == 30 || t == 31) continue;
        FaceState state;
        state.sequence = 1000 + t;
        state.capture_us = t * 16'667;
        state.state = t < 50 ? TrackingState::kLive : TrackingState::kHold;
        state.held = t >= 50;
        state.shape_count = 5;
        state.cameras = {CameraStatus::kGood, CameraStatus::kMissing, CameraStatus::kUnused,
                         CameraStatus::kUnused};
        state.slip.translation_mm = {3.0F, 4.0F, 0.0F};
        state.faults = t >= 50 ? fault_bit(Fault::kMarkersLost) : 0;
        const auto weights = encode_weights(state, 0, payload);
        ASSERT_TRUE(weights);
        auto size = encode_frame({.type = MessageType::kWeights, .sequence = 2 * t},
                                 ByteSpan(payload).first(*weights), wire);
        ASSERT_TRUE(size);
        ASSERT_TRUE(writer->add(ByteSpan(wire).first(*size), t * 16'667));
        MarkerFrame markers;
        markers.sequence = state.sequence;
        markers.marker_count = kMarkers;
        for (std::size_t k = 0; k < kMarkers; ++k)
            markers.markers[k].seen = !state.held && !(k == 3 && t >= 20 && t < 29);
        const auto points = encode_markers(markers, 0, payload);
        ASSERT_TRUE(points);
        size = encode_frame({.type = MessageType::kMarkers, .sequence = 2 * t + 1},
                            ByteSpan(payload).first(*points), wire);
        ASSERT_TRUE(size);
        ASSERT_TRUE(writer->add(ByteSpan(wire).first(*size), t * 16'667));
    }
    ASSERT_TRUE(writer->close());
    for (const SolvePack* with : {static_cast<const SolvePack*>(nullptr), &pack->pack()}) {
        const auto record = inspect_recording(request("t.rec"), with, kGoOn);
        ASSERT_TRUE(record) << record.error().message;
        const InspectFigures figures = figures_of(*record);
        EXPECT_EQ(figures.ticks, 58U);
        EXPECT_EQ(record->missing_ticks, 2U);
        EXPECT_EQ(record->cameras, (std::vector<std::string>{"1", "2"}));
        EXPECT_NEAR(figures.slip_max_mm->value, 5.0, 0.02);
        EXPECT_NEAR(figures.markers[3].inferred, 9.0 / 58.0, 1e-9);
        EXPECT_NEAR(figures.lost, 10.0 / 58.0, 1e-9);
        EXPECT_EQ(record->markers[3].region.has_value(), with != nullptr);
        EXPECT_TRUE(record->residuals_mm.empty());
        const std::string page = inspect_page(*record);
        EXPECT_NE(page.find("F16"), std::string::npos);
        EXPECT_EQ(page.find("most mm"), std::string::npos);
    }
}

TEST_F(TakeRuns, PicturesOfOtherCamerasOrSizesAreRefused) {
    const auto write = [&](const std::string& name, int width) {
        const GreyImage image{width, 640,
                              std::vector<std::uint8_t>(static_cast<std::size_t>(width) * 640, 90)};
        ASSERT_TRUE(write_grey_image(folder / name, image.view()));
    };
    std::filesystem::create_directory(folder / "p");
    const auto empty = inspect_pictures(request("p"), pack->pack(), kGoOn);
    ASSERT_FALSE(empty);
    EXPECT_NE(empty.error().message.find("no .png"), std::string::npos) << empty.error().message;
    write("p/f001_a.pgm", 480);
    const auto one = inspect_pictures(request("p"), pack->pack(), kGoOn);
    ASSERT_FALSE(one);
    EXPECT_NE(one.error().message.find("pictures of 1 cameras"), std::string::npos) << one.error().message;
    write("p/f001_b.pgm", 320);
    const auto small = inspect_pictures(request("p"), pack->pack(), kGoOn);
    ASSERT_FALSE(small);
    EXPECT_NE(small.error().message.find("f001_b.pgm: 320 x 640 px"), std::string::npos)
        << small.error().message;
    write("p/f001_b.pgm", 480);
    write("p/f004_a.pgm", 480);
    const auto blank = inspect_pictures(request("p"), pack->pack(), kGoOn);
    ASSERT_TRUE(blank) << blank.error().message;
    ASSERT_EQ(blank->ticks.size(), 2U);
    EXPECT_NEAR(blank->ticks[1].time_s, 3.0 / 60.0, 1e-9);  // the names' numbers
    EXPECT_EQ(blank->ticks[1].cameras[1], CameraStatus::kMissing);
    EXPECT_FALSE(figures_of(*blank).first_face_s);
    EXPECT_NE(inspect_page(*blank).find("no face was ever found"), std::string::npos);
}

}  // namespace
}  // namespace rig::host
