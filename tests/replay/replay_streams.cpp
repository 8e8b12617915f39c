#include "tests/replay/replay_streams.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "tests/support/digest.hpp"

namespace rig::test {

namespace {

template <class T>
host::NpyArray<T> read_or_throw(const std::filesystem::path& file) {
    auto array = host::read_npy<T>(file);
    if (!array) throw std::runtime_error(array.error().message);
    return std::move(*array);
}

// The first number of "window_frames": [a, b] in the take's manifest.
std::size_t window_start(const std::filesystem::path& manifest) {
    std::ifstream in(manifest);
    std::stringstream text;
    text << in.rdbuf();
    const std::string all = text.str();
    const std::size_t at = all.find("\"window_frames\"");
    if (at == std::string::npos) throw std::runtime_error(manifest.string() + ": no window_frames");
    return std::stoul(all.substr(all.find('[', at) + 1));
}

void count_names(const ReplayStream& stream, std::size_t frame, const FrameReport& report, ReplayRun& run) {
    for (std::size_t s = 0; s < stream.slots; ++s) {
        const std::int32_t truth = stream.truth[frame * stream.slots + s];
        const bool present = std::isfinite(stream.points[frame * stream.slots + s][0]);
        if (!present) continue;
        if (truth < 0) {
            run.ghosts_named += report.labels[s] >= 0 ? 1U : 0U;
            continue;
        }
        ++run.visible;
        if (report.labels[s] == truth) {
            ++run.right;
        } else if (report.labels[s] >= 0) {
            ++run.wrong;
        }
    }
}

}  // namespace

ReplayPack::ReplayPack(const std::filesystem::path& data, int markers) : markers_(markers) {
    const std::string stem = "markers_" + std::to_string(markers);
    neutral_mm_ = read_or_throw<float>(data / "rig" / (stem + "_neutral.npy")).values;
    const host::NpyArray<float> basis = read_or_throw<float>(data / "rig" / (stem + "_B.npy"));
    basis_mm_ = basis.values;
    const std::size_t shapes = basis.shape.at(1);
    low_.assign(shapes, 0.0F);
    high_.assign(shapes, 1.0F);
    mean_.assign(shapes, 0.1F);
    sigma_.assign(shapes, 0.3F);
    gamma_.assign(shapes, 4.0F);  // noise 0.1 mm against a step of 0.05 a frame: (0.1 / 0.05)^2 mm^2
}

SolvePack ReplayPack::pack() const {
    SolvePack pack;
    pack.marker_count = static_cast<std::uint16_t>(markers_);
    pack.shape_count = static_cast<std::uint16_t>(low_.size());
    pack.solver = SolverKind::kBoxQp;
    pack.neutral_mm = neutral_mm_;
    pack.basis_mm = basis_mm_;
    pack.weight_low = low_;
    pack.weight_high = high_;
    pack.prior_mean = mean_;
    pack.prior_sigma = sigma_;
    pack.temporal_gamma = gamma_;
    pack.noise_mm = 0.1F;
    pack.ridge_mm2 = 0.0011F;
    return pack;
}

double ReplayPack::column_length(std::size_t shape) const {
    double sum = 0.0;
    for (std::size_t r = 0; r < neutral_mm_.size(); ++r) {
        const auto b = static_cast<double>(basis_mm_[r * shape_count() + shape]);
        sum += b * b;
    }
    return std::sqrt(sum);
}

double ReplayPack::marker_error2(const std::vector<double>& difference) const {
    double sum = 0.0;
    for (std::size_t r = 0; r < neutral_mm_.size(); ++r) {
        double moved = 0.0;
        for (std::size_t i = 0; i < difference.size(); ++i) {
            moved += static_cast<double>(basis_mm_[r * difference.size() + i]) * difference[i];
        }
        sum += moved * moved;
    }
    return sum;
}

ReplayStream read_stream(const std::filesystem::path& file) {
    const host::NpyArray<float> array = read_or_throw<float>(file);
    ReplayStream stream;
    stream.frames = array.shape.at(0);
    stream.slots = array.shape.at(1);
    for (std::size_t i = 0; i < stream.frames * stream.slots; ++i) {
        stream.points.emplace_back(static_cast<double>(array.values[3 * i]),
                                   static_cast<double>(array.values[3 * i + 1]),
                                   static_cast<double>(array.values[3 * i + 2]));
    }
    if (file.filename() == "unlabelled.npy") {
        stream.unlabelled = true;
        const auto ids = read_or_throw<std::int16_t>(file.parent_path() / "unlabelled_id.npy");
        stream.truth.assign(ids.values.begin(), ids.values.end());
    }
    return stream;
}

std::vector<std::vector<double>> read_truth(const std::filesystem::path& data, const std::string& take) {
    const std::size_t start = window_start(data / "markers" / take / "manifest.json");
    const std::filesystem::path file = data / "takes" / (take + "_weights60.csv");
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file.string() + ": cannot be read");
    std::string line;
    std::getline(in, line);
    std::vector<std::vector<double>> rows;
    for (std::size_t frame = 0; std::getline(in, line) && frame < start + 1200; ++frame) {
        if (frame < start) continue;
        std::vector<double> row;
        std::stringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
        row.erase(row.begin(), row.begin() + 2);
        rows.push_back(std::move(row));
    }
    return rows;
}

ReplayRun run_stream(const ReplayPack& pack, const ReplayStream& stream, const PipelineConfig& config) {
    auto pipeline = std::make_unique<Pipeline>();
    if (!pipeline->configure(pack.pack(), config)) throw std::runtime_error("the pack was refused");
    auto state = std::make_unique<FaceState>();
    auto report = std::make_unique<FrameReport>();
    ReplayRun run;
    Digest digest;
    for (std::size_t frame = 0; frame < stream.frames; ++frame) {
        const std::span<const Vec3> points(stream.points.data() + frame * stream.slots, stream.slots);
        const auto capture_us =
            static_cast<std::int64_t>(std::llround(static_cast<double>(frame) * 1e6 / config.rate_hz));
        if (stream.unlabelled) {
            pipeline->step(PointFrame{capture_us, points}, *state, *report);
            if (frame >= 30) count_names(stream, frame, *report, run);
        } else {
            pipeline->step(LabelledFrame{capture_us, points}, *state, *report);
        }
        run.weights.emplace_back(state->weights.begin(),
                                 state->weights.begin() + static_cast<std::ptrdiff_t>(state->shape_count));
        run.states.push_back(state->state);
        run.slips.push_back(state->slip);
        run.optimal += report->optimal ? 1U : 0U;
        run.worst_kkt = std::max(run.worst_kkt, report->kkt);
        digest.add(std::span<const float>(run.weights.back())).add(state->state).add(report->objective_mm2);
    }
    run.digest = digest.value();
    return run;
}

}  // namespace rig::test
