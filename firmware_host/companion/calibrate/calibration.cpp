#include "firmware_host/companion/calibrate/calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "core/base/check.hpp"
#include "firmware_host/companion/calibrate/board_check.hpp"
#include "firmware_host/companion/calibrate/initial_cameras.hpp"

namespace rig::host {

namespace {

constexpr double kBlurTimes = 1.8;        // a picture this much softer than its camera's median has moved
constexpr double kBlurFloor_px = 1.2;     // but nothing sharper than this is called blurred
constexpr double kOutlierTimes = 8.0;     // of the median distance of all points
constexpr double kOutlierFloor_px = 0.5;  // and nothing nearer than this is mistaken
constexpr double kPictureTimes = 5.0;     // of the median distance of all points
constexpr double kPictureFloor_px = 0.3;
constexpr double kHopeless_px = 1.5;  // rms of a camera: these points are not those of this board
constexpr int kRounds = 4;            // of leaving out and fitting again

double median_of(std::vector<double> values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

BoardPicture picture_of(const BoardSighting& sighting) {
    BoardPicture out;
    out.points = sighting.points;
    for (std::size_t i = 0; i < sighting.points.size(); ++i)
        out.seen_px.emplace_back(sighting.x_px[i], sighting.y_px[i]);
    return out;
}

class CalibrationRun {
  public:
    CalibrationRun(const CalibrationTask& task, const std::function<void(double)>& progress)
        : task_(task), progress_(progress), points_(board_points(task.board)) {
        result_.verdicts.resize(task.pictures.size());
        use_.resize(task.pictures.size());
        for (std::size_t p = 0; p < task.pictures.size(); ++p) {
            const BoardSighting& sighting = task.pictures[p].sighting;
            use_[p].assign(sighting.points.size(), true);
            moments_ = std::max(moments_, task.pictures[p].moment + 1);
        }
        poses_.assign(camera_count(), std::vector<std::optional<Rigid>>(moments_));
    }

    Result<Calibration, FileError> run() {
        for (const auto part : {&CalibrationRun::check_sizes, &CalibrationRun::reject_unfit,
                                &CalibrationRun::fit_alone, &CalibrationRun::fit_together}) {
            if (auto ok = (this->*part)(); !ok) return failure(ok.error());
        }
        summarise();
        return std::move(result_);
    }

  private:
    using Step = Result<void, FileError>;

    [[nodiscard]] std::size_t camera_count() const { return task_.camera_names.size(); }
    [[nodiscard]] bool used(std::size_t picture) const { return result_.verdicts[picture].rejection.empty(); }
    [[nodiscard]] bool of_camera(std::size_t picture, std::size_t camera) const {
        return task_.pictures[picture].camera == camera;
    }

    Step check_sizes() {
        std::vector<const CalibrationPicture*> first(camera_count(), nullptr);
        for (const CalibrationPicture& picture : task_.pictures) {
            if (picture.width_px == 0) continue;  // it could not be read
            const CalibrationPicture*& other = first[picture.camera];
            if (other == nullptr) other = &picture;
            if (other->width_px == picture.width_px && other->height_px == picture.height_px) continue;
            return failure(
                FileError{fmt::format("{}: is {} x {} px and {} is {} x {} px; pictures of one camera have "
                                      "one size, the one that the rig "
                                      "uses: take away those of the other size",
                                      picture.file, picture.width_px, picture.height_px, other->file,
                                      other->width_px, other->height_px)});
        }
        return {};
    }

    Step reject_unfit() {
        for (std::size_t c = 0; c < camera_count(); ++c) {
            std::vector<double> blur;
            for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
                const BoardSighting& sighting = task_.pictures[p].sighting;
                if (of_camera(p, c) && sighting.fault.empty()) blur.push_back(sighting.edge_sigma_px);
            }
            const double limit = std::max(kBlurFloor_px, kBlurTimes * median_of(blur));
            for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
                if (!of_camera(p, c)) continue;
                const BoardSighting& sighting = task_.pictures[p].sighting;
                PictureVerdict& verdict = result_.verdicts[p];
                verdict.points = sighting.points.size();
                verdict.rejection = sighting.fault;
                if (!verdict.rejection.empty()) continue;
                if (sighting.points.size() < kLeastPoints) {
                    verdict.rejection = fmt::format("only {} points of the board were found, {} are needed",
                                                    sighting.points.size(), kLeastPoints);
                } else if (sighting.edge_sigma_px > limit) {
                    verdict.rejection =
                        fmt::format("blurred: edges {:.1f} px wide where this camera's limit is {:.1f} px",
                                    sighting.edge_sigma_px, limit);
                }
            }
            if (auto ok = check_count(c); !ok) return ok;
        }
        return {};
    }

    [[nodiscard]] Step check_count(std::size_t camera) const {
        std::size_t good = 0;
        std::size_t all = 0;
        std::map<std::string, std::size_t> reasons;
        for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
            if (!of_camera(p, camera)) continue;
            ++all;
            if (used(p)) ++good;
            if (!used(p)) ++reasons[result_.verdicts[p].rejection];
        }
        if (good >= kLeastPictures) return {};
        std::string why;
        const auto most = std::ranges::max_element(reasons, {}, [](const auto& each) { return each.second; });
        if (most != reasons.end()) why = fmt::format("; most often: {}", most->first);
        return failure(FileError{fmt::format(
            "camera {}: {} of {} pictures can be used and {} are needed{}. Take more, sharp, the board at "
            "different "
            "angles and over the whole picture, and check that --board {} is the board in them",
            task_.camera_names[camera], good, all, kLeastPictures, why, board_text(task_.board))});
    }

    // The problem of some cameras, in the numbering of the used pictures' moments.
    BundleProblem problem_of(const std::vector<std::size_t>& cameras, std::vector<std::size_t>& moments,
                             std::vector<std::pair<std::size_t, std::size_t>>& sources) const {
        BundleProblem problem;
        problem.points = points_;
        problem.point_radius_mm = task_.board.kind == BoardKind::kCircles ? 0.5 * task_.board.mark_mm : 0.0;
        problem.terms = task_.terms;
        std::map<std::size_t, std::size_t> view_of_moment;
        for (std::size_t c = 0; c < cameras.size(); ++c) {
            problem.cameras.push_back(cameras_[cameras[c]]);
            for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
                if (!used(p) || !of_camera(p, cameras[c])) continue;
                const std::size_t moment = task_.pictures[p].moment;
                const auto [view, fresh] = view_of_moment.emplace(moment, view_of_moment.size());
                if (fresh) {
                    moments.push_back(moment);
                    problem.rig_from_board.push_back(rig_from_board(cameras[c], moment));
                }
                const BoardSighting& sighting = task_.pictures[p].sighting;
                for (std::size_t i = 0; i < sighting.points.size(); ++i) {
                    if (!use_[p][i]) continue;
                    problem.observations.push_back(
                        {c, view->second, sighting.points[i], Vec2{sighting.x_px[i], sighting.y_px[i]}});
                    sources.emplace_back(p, i);
                }
            }
        }
        return problem;
    }

    // From the pose that this camera alone saw, and where the camera is.
    [[nodiscard]] Rigid rig_from_board(std::size_t camera, std::size_t moment) const {
        const CameraModel& model = cameras_[camera];
        const Rigid& pose = *poses_[camera][moment];
        const Mat3 back = model.camera_from_headset.transpose();
        return {back * pose.rotation, back * pose.translation_mm + model.centre_mm};
    }

    void take_back(const BundleProblem& problem, const std::vector<std::size_t>& cameras,
                   const std::vector<std::size_t>& moments) {
        for (std::size_t c = 0; c < cameras.size(); ++c) {
            const CameraModel& model = problem.cameras[c];
            cameras_[cameras[c]] = model;
            for (std::size_t v = 0; v < moments.size(); ++v) {
                std::optional<Rigid>& pose = poses_[cameras[c]][moments[v]];
                if (!pose) continue;
                const Rigid& view = problem.rig_from_board[v];
                pose = Rigid{model.camera_from_headset * view.rotation,
                             model.camera_from_headset * (view.translation_mm - model.centre_mm)};
            }
        }
    }

    // Leaves out mistaken points, and pictures of which half the points do not fit. True when something was.
    bool leave_out(const BundleReport& report,
                   const std::vector<std::pair<std::size_t, std::size_t>>& sources) {
        std::vector<double> errors;
        std::map<std::size_t, std::vector<double>> of_picture;
        for (std::size_t i = 0; i < sources.size(); ++i) {
            errors.push_back(report.residual_px[i].norm());
            of_picture[sources[i].first].push_back(errors.back());
        }
        const double middle = median_of(errors);
        const double picture_limit = std::max(kPictureFloor_px, kPictureTimes * middle);
        const double point_limit = std::max(kOutlierFloor_px, kOutlierTimes * middle);
        bool any = false;
        for (const auto& [picture, distances] : of_picture) {
            const double typical = median_of(distances);
            if (typical <= picture_limit) continue;
            result_.verdicts[picture].rejection = fmt::format(
                "does not fit the others: half its points are off by more than {:.2f} px, the limit is "
                "{:.2f} px",
                typical, picture_limit);
            poses_[task_.pictures[picture].camera][task_.pictures[picture].moment].reset();
            any = true;
        }
        for (std::size_t i = 0; i < sources.size(); ++i) {
            const auto& [picture, point] = sources[i];
            if (errors[i] <= point_limit || !used(picture)) continue;
            use_[picture][point] = false;
            ++result_.verdicts[picture].outliers;
            any = true;
        }
        return any;
    }

    // A picture of which hardly a point is left says nothing.
    void drop_emptied() {
        for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
            const auto left = static_cast<std::size_t>(std::ranges::count(use_[p], true));
            if (!used(p) || left >= kLeastPoints) continue;
            result_.verdicts[p].rejection = fmt::format("only {} of its points fit the others", left);
            poses_[task_.pictures[p].camera][task_.pictures[p].moment].reset();
        }
    }

    BundleReport fit(const std::vector<std::size_t>& cameras,
                     std::vector<std::pair<std::size_t, std::size_t>>& sources) {
        BundleReport report;
        for (int round = 0; round < kRounds; ++round) {
            std::vector<std::size_t> moments;
            sources.clear();
            BundleProblem problem = problem_of(cameras, moments, sources);
            report = adjust(problem);
            take_back(problem, cameras, moments);
            if (round + 1 == kRounds || !leave_out(report, sources)) break;
            drop_emptied();
            for (const std::size_t c : cameras) {
                if (!check_count(c)) return report;  // told by the caller, with the reasons
            }
        }
        return report;
    }

    Step fit_alone() {
        cameras_.resize(camera_count());
        for (std::size_t c = 0; c < camera_count(); ++c) {
            progress_(0.6 * static_cast<double>(c) / static_cast<double>(camera_count()));
            if (auto ok = start_camera(c); !ok) return ok;
            std::vector<std::pair<std::size_t, std::size_t>> sources;
            const BundleReport report = fit({c}, sources);
            if (report.rms_px > kHopeless_px) return misfit(c, report.rms_px);
            if (auto ok = check_count(c); !ok) return ok;
        }
        return {};
    }

    [[nodiscard]] Step misfit(std::size_t c, double rms_px) const {
        return failure(
            FileError{fmt::format("camera {}: the pictures do not fit the board: {:.1f} px rms. Is --board "
                                  "{} what they show (counts, kind, "
                                  "dictionary), is the board flat, is the lens model the right one?",
                                  task_.camera_names[c], rms_px, board_text(task_.board))});
    }

    Step start_camera(std::size_t c) {
        std::vector<BoardPicture> pictures;
        const CalibrationPicture* any = nullptr;
        for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
            if (!used(p) || !of_camera(p, c)) continue;
            any = &task_.pictures[p];
            pictures.push_back(picture_of(any->sighting));
        }
        RIG_CHECK(any != nullptr);
        const auto start = initial_camera(any->width_px, any->height_px, pictures, points_, task_.terms);
        if (!start) {
            return failure(
                FileError{fmt::format("camera {}: no lens explains the pictures; tilt the board by 20 to 40 "
                                      "degrees in most of them, and "
                                      "check that --board {} is the board in them",
                                      task_.camera_names[c], board_text(task_.board))});
        }
        cameras_[c] = *start;
        cameras_[c].row_time_us = task_.row_time_us;
        for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
            if (!used(p) || !of_camera(p, c)) continue;
            auto& pose = poses_[c][task_.pictures[p].moment];
            pose = board_pose(*start, picture_of(task_.pictures[p].sighting), points_);
            if (!pose) result_.verdicts[p].rejection = "the board's pose could not be found";
        }
        return check_count(c);
    }

    Step fit_together() {
        const std::vector<std::optional<Rigid>> placed = chain_cameras(poses_);
        std::vector<std::size_t> all;
        for (std::size_t c = 0; c < camera_count(); ++c) {
            all.push_back(c);
            if (!placed[c] || (c > 0 && most_shared(c) < kLeastShared)) {
                return failure(
                    FileError{fmt::format("camera {}: it and any other camera saw the board together in {} "
                                          "moments, {} are needed. Pictures "
                                          "of one moment have the same name in every camera's folder; hold "
                                          "the board where two cameras see it",
                                          task_.camera_names[c], most_shared(c), kLeastShared)});
            }
            cameras_[c].camera_from_headset = placed[c]->rotation;
            cameras_[c].centre_mm = -(placed[c]->rotation.transpose() * placed[c]->translation_mm);
        }
        progress_(0.6);
        std::vector<std::pair<std::size_t, std::size_t>> sources;
        const BundleReport report = fit(all, sources);
        for (std::size_t c = 0; c < camera_count(); ++c) {
            if (auto ok = check_count(c); !ok) return ok;
        }
        if (report.rms_px > kHopeless_px) return misfit(0, report.rms_px);
        result_.uncertainty = report.uncertainty;
        result_.converged = report.converged;
        result_.all_rms_px = report.rms_px;
        for (std::size_t i = 0; i < sources.size(); ++i) {
            const auto& [p, point] = sources[i];
            const BoardSighting& sighting = task_.pictures[p].sighting;
            result_.seen.push_back({task_.pictures[p].camera,
                                    Vec2{sighting.x_px[point], sighting.y_px[point]}, report.residual_px[i]});
            result_.verdicts[p].rms_px += report.residual_px[i].squaredNorm();
        }
        progress_(1.0);
        return {};
    }

    [[nodiscard]] std::size_t most_shared(std::size_t camera) const {
        std::size_t most = 0;
        for (std::size_t other = 0; other < camera_count(); ++other) {
            if (other == camera) continue;
            std::size_t shared = 0;
            for (std::size_t m = 0; m < moments_; ++m)
                shared += poses_[camera][m] && poses_[other][m] ? 1 : 0;
            most = std::max(most, shared);
        }
        return most;
    }

    void summarise() {
        result_.cameras = cameras_;
        result_.rms_px.assign(camera_count(), 0.0);
        result_.picture_count.assign(camera_count(), 0);
        result_.point_count.assign(camera_count(), 0);
        std::vector<std::set<std::size_t>> fields(camera_count());
        for (const SeenPoint& seen : result_.seen) {
            result_.rms_px[seen.camera] += seen.residual_px.squaredNorm();
            ++result_.point_count[seen.camera];
            const CameraModel& camera = cameras_[seen.camera];
            fields[seen.camera].insert(
                coverage_field(seen.at_px[0], seen.at_px[1], camera.width_px, camera.height_px));
        }
        for (std::size_t p = 0; p < task_.pictures.size(); ++p) {
            PictureVerdict& verdict = result_.verdicts[p];
            if (!used(p)) continue;
            verdict.points = static_cast<std::size_t>(std::ranges::count(use_[p], true));
            verdict.rms_px = std::sqrt(verdict.rms_px / static_cast<double>(verdict.points));
            ++result_.picture_count[task_.pictures[p].camera];
        }
        for (std::size_t c = 0; c < camera_count(); ++c) {
            result_.rms_px[c] = std::sqrt(result_.rms_px[c] / static_cast<double>(result_.point_count[c]));
            result_.coverage.push_back(static_cast<double>(fields[c].size()) /
                                       (kCoverageFields * kCoverageFields));
        }
        std::vector<std::size_t> all(camera_count());
        for (std::size_t c = 0; c < all.size(); ++c) all[c] = c;
        std::vector<std::size_t> moments;
        std::vector<std::pair<std::size_t, std::size_t>> sources;
        result_.triangulation = check_triangulation(problem_of(all, moments, sources));
    }

    const CalibrationTask& task_;
    const std::function<void(double)>& progress_;
    std::vector<BoardPoint> points_;
    std::size_t moments_ = 0;
    std::vector<CameraModel> cameras_;
    std::vector<std::vector<std::optional<Rigid>>> poses_;  // [camera][moment], camera from board
    std::vector<std::vector<bool>> use_;                    // [picture][its point]
    Calibration result_;
};

}  // namespace

std::size_t coverage_field(double x_px, double y_px, int width_px, int height_px) {
    const auto along = [](double at, int size) {
        const double share = std::clamp((at + 0.5) / size, 0.0, 1.0 - 1e-9);
        return static_cast<std::size_t>(share * kCoverageFields);
    };
    return along(y_px, height_px) * kCoverageFields + along(x_px, width_px);
}

Result<Calibration, FileError> calibrate(const CalibrationTask& task,
                                         const std::function<void(double)>& progress) {
    RIG_CHECK(!task.camera_names.empty());
    return CalibrationRun(task, progress).run();
}

}  // namespace rig::host
