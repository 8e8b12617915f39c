#include "firmware_host/companion/capture/coverage_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <utility>

#include "firmware_host/companion/capture/board_watch.hpp"

namespace rig::host {

namespace {

constexpr double kFacingSine = 0.17;   // about 10 degrees
constexpr double kUnlikeShare = 0.06;  // of the picture's diagonal that points have moved by
constexpr double kUnlikeLean = 0.12;
constexpr std::size_t kNewFields = 2;
constexpr std::size_t kCommonPoints = 6;

bool is_seen(const BoardSighting& sighting) {
    return sighting.points.size() >= kLeastPoints;
}

std::array<bool, kCoverageFields * kCoverageFields> fields_of(const BoardSighting& sighting,
                                                              PictureSize size) {
    std::array<bool, kCoverageFields * kCoverageFields> fields{};
    for (std::size_t i = 0; i < sighting.points.size(); ++i)
        fields[coverage_field(sighting.x_px[i], sighting.y_px[i], size.width_px, size.height_px)] = true;
    return fields;
}

// The ninth of the picture of which the largest share was never seen.
std::size_t emptiest_zone(const CoverageProgress& camera) {
    std::array<double, 9> empty{};
    std::array<double, 9> all{};
    for (std::size_t field = 0; field < camera.seen.size(); ++field) {
        const std::size_t row = field / kCoverageFields;
        const std::size_t column = field % kCoverageFields;
        const std::size_t zone = 3 * (3 * row / kCoverageFields) + 3 * column / kCoverageFields;
        all[zone] += 1.0;
        empty[zone] += camera.seen[field] ? 0.0 : 1.0;
    }
    std::size_t best = 0;
    for (std::size_t zone = 1; zone < 9; ++zone)
        if (empty[zone] * all[best] > empty[best] * all[zone]) best = zone;
    return best;
}

constexpr std::array<const char*, 9> kZoneNames{
    "upper left", "top", "upper right", "left", "middle", "right", "lower left", "bottom", "lower right"};
constexpr std::array<const char*, kTiltCount> kTiltAdvice{
    "hold the board square to", "tilt the top of the board away from",
    "tilt the bottom of the board away from", "turn the left of the board, as seen in its picture, away from",
    "turn the right of the board, as seen in its picture, away from"};

}  // namespace

std::optional<BoardLean> board_lean(const BoardSpec& board, const BoardSighting& sighting, PictureSize size) {
    if (!is_seen(sighting)) return std::nullopt;
    const std::vector<BoardPoint> all = board_points(board);
    std::vector<cv::Point2d> on_board;
    std::vector<cv::Point2d> in_picture;
    cv::Point2d middle(0.0, 0.0);
    for (std::size_t i = 0; i < sighting.points.size(); ++i) {
        const BoardPoint& point = all[sighting.points[i]];
        middle += cv::Point2d(point.x_mm, point.y_mm) / static_cast<double>(sighting.points.size());
    }
    for (std::size_t i = 0; i < sighting.points.size(); ++i) {
        const BoardPoint& point = all[sighting.points[i]];
        on_board.push_back(cv::Point2d(point.x_mm, point.y_mm) - middle);
        in_picture.emplace_back(sighting.x_px[i], sighting.y_px[i]);
    }
    const cv::Mat h = cv::findHomography(on_board, in_picture);
    if (h.empty() || !(std::abs(h.at<double>(2, 2)) > 1e-12)) return std::nullopt;
    // Depth along the board: 1 + growth . (x, y), growth = (r31, r32) / Z0; scale = f / Z0 across the slope.
    const double w = h.at<double>(2, 2);
    const double growth_x = h.at<double>(2, 0) / w;
    const double growth_y = h.at<double>(2, 1) / w;
    const double u = h.at<double>(0, 2) / w;
    const double v = h.at<double>(1, 2) / w;
    const cv::Matx22d slope(h.at<double>(0, 0) / w - u * growth_x, h.at<double>(0, 1) / w - u * growth_y,
                            h.at<double>(1, 0) / w - v * growth_x, h.at<double>(1, 1) / w - v * growth_y);
    cv::Vec2d scales;
    cv::SVD::compute(slope, scales, cv::SVD::NO_UV);
    const double px_per_mm = scales[0];
    const cv::Vec2d towards = slope * cv::Vec2d(growth_x, growth_y);
    const double length = std::hypot(towards[0], towards[1]);
    if (!(px_per_mm > 1e-9) || !std::isfinite(length)) return std::nullopt;
    if (!(length > 1e-15)) return BoardLean{};
    const double focal_px = std::max(size.width_px, size.height_px);
    const double sine = std::min(1.0, std::hypot(growth_x, growth_y) * focal_px / px_per_mm);
    return BoardLean{sine * towards[0] / length, sine * towards[1] / length};
}

BoardTilt tilt_of(const BoardLean& lean) {
    if (std::hypot(lean.x, lean.y) < kFacingSine) return BoardTilt::kFacing;
    if (std::abs(lean.y) >= std::abs(lean.x))
        return lean.y < 0.0 ? BoardTilt::kTopAway : BoardTilt::kBottomAway;
    return lean.x < 0.0 ? BoardTilt::kLeftAway : BoardTilt::kRightAway;
}

double CoverageProgress::share() const {
    return static_cast<double>(std::ranges::count(seen, true)) / static_cast<double>(seen.size());
}

CoveragePlan::CoveragePlan(BoardSpec board, std::size_t cameras, const CoverageGoal& goal)
    : board_(std::move(board)),
      goal_(goal),
      cameras_(cameras),
      earlier_(cameras),
      shared_(cameras, std::vector<std::size_t>(cameras, 0)) {
    update_links();
}

bool CoveragePlan::is_unlike_earlier(std::size_t c, const BoardSighting& sighting, PictureSize size) const {
    const double far_px = kUnlikeShare * std::hypot(size.width_px, size.height_px);
    const auto lean = board_lean(board_, sighting, size);
    return std::ranges::all_of(earlier_[c], [&](const TakenView& before) {
        const auto moved_px = sighting_distance_px(before.sighting, sighting, kCommonPoints);
        if (!moved_px || *moved_px > far_px) return true;
        return lean && before.lean &&
               std::hypot(lean->x - before.lean->x, lean->y - before.lean->y) > kUnlikeLean;
    });
}

bool CoveragePlan::adds_to(std::size_t c, std::span<const BoardSighting> sightings, PictureSize size) const {
    const CoverageProgress& camera = cameras_[c];
    const BoardSighting& sighting = sightings[c];
    if (!is_unlike_earlier(c, sighting, size)) return false;
    if (camera.pictures < goal_.pictures) return true;
    if (camera.share() < goal_.fields) {
        const auto fields = fields_of(sighting, size);
        std::size_t fresh = 0;
        for (std::size_t i = 0; i < fields.size(); ++i) fresh += fields[i] && !camera.seen[i] ? 1U : 0U;
        if (fresh >= kNewFields) return true;
    }
    if (const auto lean = board_lean(board_, sighting, size)) {
        const BoardTilt tilt = tilt_of(*lean);
        if (tilt != BoardTilt::kFacing && camera.tilts[static_cast<std::size_t>(tilt)] < goal_.each_tilt)
            return true;
    }
    for (std::size_t d = 0; d < cameras_.size(); ++d)
        if (is_seen(sightings[d]) && camera.linked != cameras_[d].linked) return true;
    return false;
}

bool CoveragePlan::adds(std::span<const BoardSighting> sightings, std::span<const PictureSize> sizes) const {
    for (std::size_t c = 0; c < cameras_.size(); ++c)
        if (is_seen(sightings[c]) && adds_to(c, sightings, sizes[c])) return true;
    return false;
}

void CoveragePlan::take(std::span<const BoardSighting> sightings, std::span<const PictureSize> sizes) {
    ++shots_;
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
        if (!is_seen(sightings[c])) continue;
        CoverageProgress& camera = cameras_[c];
        ++camera.pictures;
        const auto fields = fields_of(sightings[c], sizes[c]);
        for (std::size_t i = 0; i < fields.size(); ++i) camera.seen[i] = camera.seen[i] || fields[i];
        const auto lean = board_lean(board_, sightings[c], sizes[c]);
        if (lean) ++camera.tilts[static_cast<std::size_t>(tilt_of(*lean))];
        earlier_[c].push_back({sightings[c], lean});
        for (std::size_t d = 0; d < cameras_.size(); ++d)
            if (d != c && is_seen(sightings[d])) ++shared_[c][d];
    }
    update_links();
}

void CoveragePlan::update_links() {
    for (std::size_t c = 0; c < cameras_.size(); ++c) cameras_[c].linked = c == 0;
    for (std::size_t round = 1; round < cameras_.size(); ++round) {
        for (std::size_t c = 0; c < cameras_.size(); ++c) {
            for (std::size_t d = 0; d < cameras_.size(); ++d) {
                if (cameras_[d].linked && shared_[c][d] >= goal_.linked) cameras_[c].linked = true;
            }
        }
    }
}

double CoveragePlan::camera_progress(std::size_t c) const {
    const CoverageProgress& camera = cameras_[c];
    double tilts = 0.0;
    for (std::size_t t = 1; t < kTiltCount; ++t)
        tilts += static_cast<double>(std::min(camera.tilts[t], goal_.each_tilt));
    const double tilts_wanted = static_cast<double>((kTiltCount - 1) * goal_.each_tilt);
    const double pictures =
        std::min(1.0, static_cast<double>(camera.pictures) / static_cast<double>(goal_.pictures));
    return (pictures + std::min(1.0, camera.share() / goal_.fields) + tilts / tilts_wanted +
            (camera.linked ? 1.0 : 0.0)) /
           4.0;
}

double CoveragePlan::progress() const {
    double sum = 0.0;
    for (std::size_t c = 0; c < cameras_.size(); ++c) sum += camera_progress(c);
    return complete() ? 1.0 : std::min(0.99, sum / static_cast<double>(cameras_.size()));
}

bool CoveragePlan::complete() const {
    return std::ranges::all_of(cameras_, [this](const CoverageProgress& camera) {
        bool all = camera.linked && camera.pictures >= goal_.pictures && camera.share() >= goal_.fields;
        for (std::size_t t = 1; t < kTiltCount; ++t) all = all && camera.tilts[t] >= goal_.each_tilt;
        return all;
    });
}

std::string CoveragePlan::advice(std::span<const std::string> names) const {
    if (complete()) return {};
    std::size_t worst = 0;
    for (std::size_t c = 1; c < cameras_.size(); ++c) {
        const bool unseen = cameras_[worst].pictures == 0;  // a camera that saw nothing yet comes first
        if (!unseen && camera_progress(c) < camera_progress(worst)) worst = c;
    }
    const CoverageProgress& camera = cameras_[worst];
    const std::string& name = names[worst];
    if (camera.pictures == 0) return fmt::format("hold the board before camera {}, still for a moment", name);
    if (camera.share() < goal_.fields)
        return fmt::format("hold the board in the {} of camera {}", kZoneNames[emptiest_zone(camera)], name);
    for (std::size_t t = 1; t < kTiltCount; ++t) {
        if (camera.tilts[t] < goal_.each_tilt)
            return fmt::format("{} camera {} by 20 to 40 degrees", kTiltAdvice[t], name);
    }
    if (!camera.linked)
        return fmt::format("hold the board where camera {} and another one see it at once", name);
    return fmt::format("hold the board in another place before camera {}", name);
}

}  // namespace rig::host
