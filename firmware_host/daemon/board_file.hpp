// What a board has, from its board.toml.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/base/result.hpp"
#include "firmware_host/settings/filter_settings.hpp"

namespace rig {

// What a camera of the kernel's video driver has to be and give; every field of [[camera]] but its name and
// source.
struct BoardVideo {
    std::string serial;  // of its USB device; "": not asked for
    int width_px = 640;
    int height_px = 480;
    std::string pixels = "auto";  // GREY, Y16, YUYV or MJPEG; auto: the first of them that it gives
    double gain_unit_db = 0.0;    // decibels a step of its gain control; 0: see gain_unity
    double gain_unity =
        0.0;             // value of a gain control that is proportional, at a gain of 1; 0: gain is not set
    int readout_us = 0;  // from the end of the exposure to the driver's stamp
    std::vector<std::pair<std::uint32_t, std::int32_t>> controls;  // set at the start
};

struct BoardCamera {
    std::string name;
    // What stands behind it: "world:0" is camera 0 of a simulated world; "v4l2:usb-1-2.1" the camera in port
    // 1 of the hub in port 2 of USB bus 1, "v4l2:" the only camera.
    std::string source;
    BoardVideo video;
};

struct BoardLine {
    std::string name;    // what the daemon knows it as: "button_neutral", "live_led"
    std::string source;  // "world:1" is line 1 of a simulated world
};

struct Board {
    std::string name;
    double rate_hz = 60.0;
    int frozen_frames = 3;
    FilterSettings smoothing;  // unless the command line says otherwise
    std::string default_link;  // as --link takes it; "" when there is none
    std::vector<BoardCamera> cameras;
    std::vector<BoardLine> lines;

    [[nodiscard]] const BoardLine* line(const std::string& wanted) const;
};

// One sentence that names the file, the fault and the remedy.
struct BoardFileError {
    std::string message;
};

// `name` is a board's name, looked up as <folder>/<name>/board.toml, or the path of such a file.
[[nodiscard]] Result<Board, BoardFileError> load_board(const std::string& name,
                                                       const std::filesystem::path& folder);

}  // namespace rig
