// headrig calibrate cameras: pictures of a board to cameras.json.
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "core/pack/open_pack.hpp"
#include "firmware_host/companion/calibrate/calibration.hpp"
#include "firmware_host/companion/calibrate/coverage_picture.hpp"
#include "firmware_host/companion/calibrate/headset_frame.hpp"
#include "firmware_host/companion/calibrate/shot_files.hpp"
#include "firmware_host/companion/commands/calibrate_live.hpp"
#include "firmware_host/companion/commands/calibrate_reference.hpp"
#include "firmware_host/companion/commands/console.hpp"
#include "firmware_host/companion/commands/verbs.hpp"
#include "firmware_host/companion/train/camera_file.hpp"

namespace rig::host {

namespace {

constexpr double kGoodCoverage = 0.5;      // of the picture's fields
constexpr double kGoodFocalShare = 0.002;  // standard deviation of the focal length
constexpr double kFold_px = 0.01;

struct CalibrateCommand {
    std::string board;
    std::string make_board;
    std::vector<std::string> images;
    std::string by_name;
    LiveOptions live;
    LensTerms terms = LensTerms::kRational;
    std::string reference;
    double distance_mm = 200.0;
    double row_time_us = 0.0;
    std::string out;
};

int make_board(const CalibrateCommand& command, const BoardSpec& board) {
    const auto printed = write_printable_board(command.make_board, board);
    if (!printed) {
        print_error(printed.error().message);
        return kExitOutput;
    }
    fmt::print("{}: {} on {:.1f} x {:.1f} mm at {:.1f} px/mm\n", command.make_board, board_text(board),
               printed->width_mm, printed->height_mm, printed->px_per_mm);
    fmt::print(
        "Print it at 100 %, glue it flat, and measure: if the line is not {:.1f} mm long, scale the sizes "
        "given to "
        "--board by what it measures.\n",
        printed->line_mm);
    return kExitOk;
}

// Reads and searches every picture; what cannot be read becomes a rejection.
std::vector<CalibrationPicture> search_pictures(const ShotList& list, const BoardSpec& board) {
    std::vector<CalibrationPicture> pictures;
    Progress progress("board", list.shots.size());
    for (const Shot& shot : list.shots) {
        if (interrupted()) break;
        CalibrationPicture picture;
        picture.camera = shot.camera;
        picture.moment = shot.moment;
        picture.file = shot.file.string();
        const auto image = read_grey_image(shot.file);
        if (image) {
            picture.width_px = image->width_px;
            picture.height_px = image->height_px;
            picture.sighting = find_board(image->view(), board);
        } else {
            picture.sighting.fault = image.error().message;
        }
        pictures.push_back(std::move(picture));
        progress.update(pictures.size());
    }
    return pictures;
}

// True when every pixel on the picture's rim has a ray that leads back to it.
bool covers_its_picture(const CameraModel& camera) {
    const auto comes_back = [&](double x, double y) {
        const Vec3 ray = pixel_ray(camera, Vec2{x, y});
        const Projection back = project(camera, camera.centre_mm + 100.0 * ray);
        return back.z_mm > 0.0 && (back.pixel - Vec2{x, y}).norm() < kFold_px;
    };
    for (int x = 0; x < camera.width_px; x += 4) {
        if (!comes_back(x, 0.0) || !comes_back(x, camera.height_px - 1.0)) return false;
    }
    for (int y = 0; y < camera.height_px; y += 4) {
        if (!comes_back(0.0, y) || !comes_back(camera.width_px - 1.0, y)) return false;
    }
    return true;
}

void print_rejections(const CalibrationTask& task, const Calibration& result) {
    for (std::size_t p = 0; p < task.pictures.size(); ++p) {
        const PictureVerdict& verdict = result.verdicts[p];
        if (!verdict.rejection.empty())
            fmt::print("not used: {}: {}\n", task.pictures[p].file, verdict.rejection);
    }
}

void print_cameras(const CalibrationTask& task, const Calibration& result,
                   const std::vector<CameraModel>& cameras) {
    fmt::print("{:<10} {:>8} {:>7} {:>7} {:>9} {:>18} {:>18} {:>9} {:>22}\n", "camera", "pictures", "points",
               "rms px", "coverage", "f px", "centre px", "f +- px", "at mm");
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        const CameraModel& camera = cameras[c];
        const auto of_camera = std::ranges::count_if(
            task.pictures, [&](const CalibrationPicture& each) { return each.camera == c; });
        fmt::print("{:<10} {:>8} {:>7} {:>7.3f} {:>7.0f} % {:>18} {:>18} {:>9.3f} {:>22}\n",
                   task.camera_names[c], fmt::format("{}/{}", result.picture_count[c], of_camera),
                   result.point_count[c], result.rms_px[c], 100.0 * result.coverage[c],
                   fmt::format("{:.2f} {:.2f}", camera.fx_px, camera.fy_px),
                   fmt::format("{:.2f} {:.2f}", camera.cx_px, camera.cy_px), result.uncertainty[c].fx_px,
                   fmt::format("{:.2f} {:.2f} {:.2f}", camera.centre_mm[0], camera.centre_mm[1],
                               camera.centre_mm[2]));
    }
    for (std::size_t c = 1; c < cameras.size(); ++c) {
        fmt::print("baseline {} to {}: {:.3f} +- {:.3f} mm\n", task.camera_names[0], task.camera_names[c],
                   (cameras[c].centre_mm - cameras[0].centre_mm).norm(), result.uncertainty[c].baseline_mm);
    }
    if (result.triangulation.points > 0) {
        fmt::print(
            "board points triangulated by two cameras or more: {:.3f} mm rms from flat, over {} points\n",
            result.triangulation.rms_mm, result.triangulation.points);
    }
}

void print_warnings(const CalibrationTask& task, const Calibration& result) {
    for (std::size_t c = 0; c < result.cameras.size(); ++c) {
        const std::string& name = task.camera_names[c];
        if (result.picture_count[c] < kGoodPictures) {
            print_error(fmt::format("warning: camera {}: {} pictures; {} and more make a reliable lens", name,
                                    result.picture_count[c], kGoodPictures));
        }
        if (result.coverage[c] < kGoodCoverage) {
            print_error(fmt::format(
                "warning: camera {}: the board was seen in {:.0f} % of the picture; beyond, the lens "
                "is a guess (see the coverage picture)",
                name, 100.0 * result.coverage[c]));
        }
        if (result.uncertainty[c].fx_px > kGoodFocalShare * result.cameras[c].fx_px) {
            print_error(fmt::format(
                "warning: camera {}: its focal length is known to {:.1f} px only; tilt the board more", name,
                result.uncertainty[c].fx_px));
        }
        if (!covers_its_picture(result.cameras[c])) {
            print_error(fmt::format(
                "warning: camera {}: the lens model folds inside the picture; take pictures with the "
                "board near its rim, or try another --model",
                name));
        }
    }
    if (!result.converged) print_error("warning: the fit stopped at its cap before it settled");
}

// From the first camera's frame into the headset's.
void place_cameras(const CalibrateCommand& command, const RigReference* reference,
                   std::vector<CameraModel>& cameras) {
    if (reference == nullptr) {
        place_before_face(cameras, command.distance_mm);
        fmt::print(
            "headset frame: guessed from the way the cameras look (--reference FILE takes it from the "
            "helmet's "
            "construction, or from the rig as it was)\n");
        return;
    }
    const double off_mm = align_to_reference(cameras, reference->cameras);
    fmt::print("headset frame: from {}; cameras stand {:.2f} mm rms from where it has them\n",
               command.reference, off_mm);
    if (!reference->marks.empty()) {
        fmt::print("reference marks of the helmet: {} carried over from {}\n", reference->marks.size(),
                   command.reference);
    }
}

int save_result(const CalibrateCommand& command, const CalibrationTask& task, const Calibration& result,
                const std::vector<CameraModel>& cameras, const std::vector<HelmetMark>& marks) {
    std::vector<CameraEntry> entries;
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        if (!check_camera(cameras[c])) {
            print_error(fmt::format(
                "camera {}: the answer is no camera that a pack may hold; try --model polynomial or "
                "take more pictures",
                task.camera_names[c]));
            return kExitFailed;
        }
        entries.push_back({task.camera_names[c], cameras[c], result.rms_px[c], result.picture_count[c],
                           result.point_count[c]});
    }
    const auto saved =
        save_cameras(command.out, entries, "headrig calibrate cameras, " + board_text(task.board), marks);
    if (!saved) {
        print_error(saved.error().message);
        return kExitOutput;
    }
    for (std::size_t c = 0; c < cameras.size(); ++c) {
        std::filesystem::path path = command.out;
        path.replace_filename(fmt::format("{}_coverage_{}.png", path.stem().string(), task.camera_names[c]));
        const std::string title = fmt::format("{}: rms {:.3f} px, residuals x 100, {} points",
                                              task.camera_names[c], result.rms_px[c], result.point_count[c]);
        if (const auto drawn = draw_coverage(path, result, c, title); !drawn) {
            print_error(drawn.error().message);
            return kExitOutput;
        }
        fmt::print("{}\n", path.string());
    }
    fmt::print("{}\n", command.out);
    return kExitOk;
}

int calibrate_shots(const CalibrateCommand& command, const BoardSpec& board, const ShotList& list,
                    const RigReference* reference) {
    if (reference != nullptr && reference->cameras.size() != list.cameras.size()) {
        print_error(
            fmt::format("{}: has {} cameras and there are pictures of {}; give them in the same order",
                        command.reference, reference->cameras.size(), list.cameras.size()));
        return kExitInput;
    }
    CalibrationTask task;
    task.camera_names = list.cameras;
    task.board = board;
    task.terms = command.terms;
    task.row_time_us = command.row_time_us;
    task.pictures = search_pictures(list, board);
    if (interrupted()) return kExitInterrupted;
    Progress progress("fit", 1000);
    const auto result = calibrate(task, [&](double share) {
        progress.update(static_cast<std::uint64_t>(std::lround(1000.0 * share)));
    });
    if (!result) {
        print_error(result.error().message);
        return kExitInput;
    }
    std::vector<CameraModel> cameras = result->cameras;
    place_cameras(command, reference, cameras);
    print_rejections(task, *result);
    print_cameras(task, *result, cameras);
    print_warnings(task, *result);
    return save_result(command, task, *result, cameras,
                       reference != nullptr ? reference->marks : std::vector<HelmetMark>{});
}

int run_cameras(const CalibrateCommand& command) {
    const auto board = parse_board(command.board);
    if (!board) {
        print_error(board.error().message);
        return kExitUsage;
    }
    if (!command.make_board.empty()) return make_board(command, *board);
    const int sources = (command.images.empty() ? 0 : 1) + (command.by_name.empty() ? 0 : 1) +
                        (command.live.sources.empty() ? 0 : 1);
    if (command.out.empty() || sources != 1) {
        print_error(
            "give the cameras by --live, or the pictures by --images, one folder or pattern a camera, or by "
            "--by-name, and --out");
        return kExitUsage;
    }
    // What stands in the way is said before anybody waves a board.
    std::optional<RigReference> reference;
    if (!command.reference.empty()) {
        auto loaded = load_rig_reference(command.reference);
        if (!loaded) {
            print_error(loaded.error().message);
            return kExitInput;
        }
        reference = std::move(*loaded);
    } else if (const std::string stake = marks_at_stake(command.out); !stake.empty()) {
        print_error(stake);
        return kExitUsage;
    }
    std::vector<std::string> images = command.images;
    if (!command.live.sources.empty()) {
        const int taken = take_live_shots(command.live, *board, command.out, images);
        if (taken != kExitOk) return taken;
    }
    const auto list = command.by_name.empty() ? find_shots(images) : find_shots_by_name(command.by_name);
    if (!list) {
        print_error(list.error().message);
        return kExitInput;
    }
    return calibrate_shots(command, *board, *list, reference ? &*reference : nullptr);
}

void add_lens_option(CLI::App& verb, LensTerms& terms) {
    const std::map<std::string, LensTerms> models = {{"rational", LensTerms::kRational},
                                                     {"polynomial", LensTerms::kPolynomial},
                                                     {"fisheye", LensTerms::kFisheye}};
    verb.add_option(
            "--model", terms,
            "lens: rational (8 terms), polynomial (5 terms; for few pictures) or fisheye (4 terms; beyond "
            "100 degrees across)")
        ->transform(CLI::CheckedTransformer(models, CLI::ignore_case).description(""))
        ->type_name("NAME")
        ->default_str("rational");
}

void add_live_options(CLI::App& verb, LiveOptions& live) {
    verb.add_option(
            "--live", live.sources,
            "instead: cameras to watch, [NAME=]SOURCE each: a device (/dev/video0, or 0), or a folder or "
            "film that stands in for one. Shots are taken by themselves when the board is held still")
        ->delimiter(',')
        ->type_name("SOURCE...");
    verb.add_option(
            "--shots", live.shots,
            "with --live: folder for the shots, one folder a camera; OUT_shots beside the result when "
            "not given")
        ->type_name("FOLDER");
    verb.add_flag("--continue", live.go_on, "with --live: go on from the shots that are there");
}

void add_cameras_verb(CLI::App& calibrate_verb, int& exit_code) {
    auto command = std::make_shared<CalibrateCommand>();
    CLI::App* verb =
        calibrate_verb.add_subcommand("cameras", "Lenses and places of the cameras from pictures of a board");
    verb->add_option("--board", command->board,
                     "the printed board: charuco:COLUMNSxROWS:SQUARE_MM[:MARKER_MM[:DICTIONARY]], counting "
                     "squares, or "
                     "circles:COLUMNSxROWS:SPACING_MM[:DIAMETER_MM], counting circles, spacing between rows")
        ->required()
        ->type_name("BOARD");
    verb->add_option("--make-board", command->make_board, "write that board for printing, and end")
        ->type_name("PNG");
    verb->add_option(
            "--images", command->images,
            "one folder, or pattern with one *, a camera; pictures of one moment have one name in all")
        ->type_name("FOLDER...");
    verb->add_option("--by-name", command->by_name, "instead: one folder, pictures named MOMENT_CAMERA.png")
        ->type_name("FOLDER");
    add_live_options(*verb, command->live);
    add_lens_option(*verb, command->terms);
    verb->add_option(
            "--reference", command->reference,
            "cameras.json or pack with where the helmet's construction, or the last calibration, has the "
            "cameras, in the same order: the result is turned and moved onto it as a whole, and the "
            "helmet's reference marks of that file are carried over")
        ->type_name("FILE");
    verb->add_option("--distance-mm", command->distance_mm,
                     "without --reference: from the camera to between nose and lips, where one camera or "
                     "parallel ones "
                     "cannot tell")
        ->capture_default_str()
        ->check(CLI::Range(20.0, 2000.0))
        ->type_name("MM");
    verb->add_option("--row-time-us", command->row_time_us,
                     "rolling shutter: from one row's exposure to the next one's, from the sensor's data "
                     "sheet; 0: global")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1000.0))
        ->type_name("US");
    verb->add_option("--out", command->out,
                     "cameras.json to write; one coverage picture a camera is written beside it")
        ->type_name("JSON");
    verb->footer(
        "Take 20 and more pictures a camera: sharp, the board tilted by 20 to 40 degrees this way and that, "
        "reaching "
        "every corner of the picture, seen by two cameras at once as often as it can be. --live does that "
        "with "
        "you: move the board, hold it still for half a second, go where it says. Enter or Ctrl-C ends the "
        "pictures and calibrates. It says which tilts a camera lacks: T, B, L, R, the top, bottom, left or "
        "right "
        "of the board away from it.\n"
        "Columns: pictures used of all, points in them, rms distance of seen from computed points, share of "
        "the picture where the board was, focal lengths, centre (integers are pixel centres), standard "
        "deviation of the focal length, place in the headset frame.\n"
        "Examples:\n"
        "  headrig calibrate cameras --board charuco:9x7:12 --make-board board.png\n"
        "  headrig calibrate cameras --board charuco:9x7:12 --live a=/dev/video0 b=/dev/video2 --out "
        "cameras.json\n"
        "  headrig calibrate cameras --board charuco:9x7:12 --images cameras_shots/a cameras_shots/b --out "
        "cameras.json\n"
        "  headrig calibrate cameras --board circles:4x11:8 --images 'shots/left_*.png' 'shots/right_*.png' "
        "--model "
        "fisheye --out cameras.json\n"
        "  headrig train --rig sample --cameras cameras.json --out face.pack");
    verb->callback([command, &exit_code] {
        install_interrupt_handler();
        exit_code = run_cameras(*command);
    });
}

}  // namespace

void add_calibrate_verb(CLI::App& app, int& exit_code) {
    CLI::App* verb = app.add_subcommand("calibrate", "Measure the rig: cameras");
    verb->require_subcommand(1);
    add_cameras_verb(*verb, exit_code);
}

}  // namespace rig::host
