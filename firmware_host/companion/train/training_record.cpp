#include "firmware_host/companion/train/training_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "firmware_host/companion/files/csv.hpp"

namespace rig::host {

namespace {

const std::vector<std::string>& record_columns() {
    static const std::vector<std::string> columns{"pack", "curve", "series", "x", "y"};
    return columns;
}

// A named number of the record, to write and to read.
struct Figure {
    std::string_view curve;
    std::string_view series;
    double x = 0.0;
    std::function<double(const TrainingRecord&)> get;
    std::function<void(TrainingRecord&, double)> set;
};

Figure count(std::string_view series, std::size_t RbfTrainingReport::* at) {
    return {"figure", series, 0.0, [at](const TrainingRecord& r) { return static_cast<double>(r.rbf.*at); },
            [at](TrainingRecord& r, double y) { r.rbf.*at = static_cast<std::size_t>(std::max(0.0, y)); }};
}

Figure real(std::string_view series, double RbfTrainingReport::* at) {
    return {"figure", series, 0.0, [at](const TrainingRecord& r) { return r.rbf.*at; },
            [at](TrainingRecord& r, double y) { r.rbf.*at = y; }};
}

Figure cover(std::string_view series, double Coverage::* at) {
    return {"coverage", series, 0.0, [at](const TrainingRecord& r) { return r.coverage.*at; },
            [at](TrainingRecord& r, double y) { r.coverage.*at = y; }};
}

std::vector<Figure> figures() {
    using Report = RbfTrainingReport;
    std::vector<Figure> out{count("frames", &Report::frames),
                            count("dimensions", &Report::dimensions),
                            count("centres", &Report::centres),
                            real("variance_kept", &Report::variance_kept),
                            real("width_factor", &Report::width_factor),
                            real("median_lambda", &Report::median_lambda),
                            real("cross_validated_rms", &Report::cross_validated_rms),
                            real("in_take_rms", &Report::in_take_rms),
                            real("visible_in_take_rms", &Report::visible_in_take_rms),
                            real("distance_p50", &Report::distance_p50),
                            real("distance_p95", &Report::distance_p95),
                            cover("covered_share", &Coverage::covered_share),
                            cover("lost_share", &Coverage::lost_share),
                            cover("spread_mm", &Coverage::spread_mm)};
    out.push_back({"coverage", "frames", 0.0,
                   [](const TrainingRecord& r) { return static_cast<double>(r.coverage.frames); },
                   [](TrainingRecord& r, double y) {
                       r.coverage.frames = static_cast<std::size_t>(std::max(0.0, y));
                   }});
    for (std::size_t q = 0; q < kCoverageQuantiles.size(); ++q) {
        out.push_back({"coverage", "widths", kCoverageQuantiles[q],
                       [q](const TrainingRecord& r) { return r.coverage.widths[q]; },
                       [q](TrainingRecord& r, double y) { r.coverage.widths[q] = y; }});
        out.push_back({"coverage", "distance_mm", kCoverageQuantiles[q],
                       [q](const TrainingRecord& r) { return r.coverage.distance_mm[q]; },
                       [q](TrainingRecord& r, double y) { r.coverage.distance_mm[q] = y; }});
    }
    return out;
}

class Writer {
  public:
    explicit Writer(const std::string& uuid) : uuid_(uuid) {}
    void row(std::string_view curve, std::string_view series, double x, double y) {
        if (!std::isfinite(x) || !std::isfinite(y)) return;
        csv_.text(uuid_)
            .text(curve)
            .text(series)
            .text(fmt::format("{:.9g}", x))
            .text(fmt::format("{:.9g}", y));
        csv_.end_row();
    }
    [[nodiscard]] const std::string& contents() const { return csv_.contents(); }

  private:
    std::string uuid_;
    CsvWriter csv_{record_columns()};
};

// False for a row that is no part of a record.
bool take_row(std::string_view curve, std::string_view series, double x, double y,
              const std::vector<Figure>& known, TrainingRecord& out) {
    if (curve == "gcv") {
        if (out.shape_names.empty() || out.shape_names.back() != series) {
            out.shape_names.emplace_back(series);
            out.rbf.gcv_paths.emplace_back();
        }
        out.rbf.gcv_paths.back().push_back({x, y});
        return true;
    }
    if (curve == "variance") {
        out.rbf.variance_shares.push_back(y);
        return true;
    }
    if (curve == "cross_validation") {
        std::size_t dimensions = 0;
        for (const char digit : series) {
            if (digit < '0' || digit > '9' || dimensions > kMaxRbfDimensions) return false;
            dimensions = 10 * dimensions + static_cast<std::size_t>(digit - '0');
        }
        out.rbf.cross_validation.push_back({dimensions, x, y});
        return dimensions > 0;
    }
    const auto figure = std::ranges::find_if(known, [&](const Figure& f) {
        return f.curve == curve && f.series == series && std::abs(f.x - x) < 1e-6;
    });
    if (figure == known.end()) return false;
    figure->set(out, y);
    return true;
}

}  // namespace

std::string uuid_text(const PackManifest& manifest) {
    std::string out;
    for (const std::uint8_t byte : manifest.uuid) out += fmt::format("{:02x}", byte);
    return out;
}

std::filesystem::path training_record_path(const std::filesystem::path& pack) {
    std::filesystem::path out = pack;
    return out.replace_extension(".training.csv");
}

std::string training_record_text(const TrainingRecord& record) {
    Writer out(record.pack_uuid);
    for (const Figure& figure : figures()) out.row(figure.curve, figure.series, figure.x, figure.get(record));
    for (std::size_t k = 0; k < record.rbf.variance_shares.size(); ++k)
        out.row("variance", "share", static_cast<double>(k + 1), record.rbf.variance_shares[k]);
    for (const CrossValidation& tried : record.rbf.cross_validation) {
        out.row("cross_validation", std::to_string(tried.dimensions), tried.width_factor, tried.weight_rms);
    }
    for (std::size_t i = 0; i < record.rbf.gcv_paths.size() && i < record.shape_names.size(); ++i) {
        for (const GcvStep& step : record.rbf.gcv_paths[i])
            out.row("gcv", record.shape_names[i], step.lambda, step.gcv);
    }
    return out.contents();
}

Result<TrainingRecord, FileError> parse_training_record(std::string_view text,
                                                        const std::filesystem::path& name) {
    auto reader = CsvReader::open(text, name);
    if (!reader) return failure(reader.error());
    if (reader->columns() != record_columns()) return reader->fail("is not a record of a training");
    const std::vector<Figure> known = figures();
    TrainingRecord out;
    while (true) {
        const auto more = reader->next();
        if (!more) return failure(more.error());
        if (!*more) break;
        const std::string_view pack = reader->fields()[0];
        if (out.pack_uuid.empty()) out.pack_uuid = pack;
        if (pack.empty() || pack != out.pack_uuid)
            return reader->fail("belongs to another pack than the row above");
        const auto x = reader->number(3);
        if (!x) return failure(x.error());
        const auto y = reader->number(4);
        if (!y) return failure(y.error());
        if (!take_row(reader->fields()[1], reader->fields()[2], *x, *y, known, out))
            return reader->fail("is no curve or figure of a training");
    }
    if (out.pack_uuid.empty()) return reader->fail("holds no rows");
    return out;
}

}  // namespace rig::host
