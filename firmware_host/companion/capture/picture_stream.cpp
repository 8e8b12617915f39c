#include "firmware_host/companion/capture/picture_stream.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "firmware_host/companion/calibrate/shot_files.hpp"

namespace rig::host {

namespace {

namespace fs = std::filesystem;

GreyImage grey_of(const cv::Mat& picture) {
    cv::Mat grey = picture;
    if (picture.channels() == 3) cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    if (picture.channels() == 4) cv::cvtColor(picture, grey, cv::COLOR_BGRA2GRAY);
    if (grey.depth() != CV_8U) grey.convertTo(grey, CV_8U, grey.depth() == CV_16U ? 1.0 / 256.0 : 1.0);
    GreyImage out{grey.cols, grey.rows, {}};
    out.pixels.reserve(grey.total());
    for (int y = 0; y < grey.rows; ++y)
        out.pixels.insert(out.pixels.end(), grey.ptr(y), grey.ptr(y) + grey.cols);
    return out;
}

// Numbers at the ends of the names, when all have one and they rise; otherwise 0, 1, 2...
std::vector<std::int64_t> picture_numbers(const std::vector<fs::path>& files) {
    std::vector<std::int64_t> numbers;
    for (const fs::path& file : files) {
        const std::string stem = file.stem().string();
        const std::size_t digits = stem.size() - (stem.find_last_not_of("0123456789") + 1);
        std::int64_t number = -1;
        if (digits > 0 && digits <= 9)
            std::from_chars(stem.data() + stem.size() - digits, stem.data() + stem.size(), number);
        if (number < 0 || (!numbers.empty() && number <= numbers.back())) {
            numbers.clear();
            for (std::size_t i = 0; i < files.size(); ++i) numbers.push_back(static_cast<std::int64_t>(i));
            return numbers;
        }
        numbers.push_back(number);
    }
    return numbers;
}

class FolderStream final : public PictureStream {
  public:
    explicit FolderStream(std::vector<fs::path> files)
        : files_(std::move(files)), numbers_(picture_numbers(files_)) {}

    Result<LivePicture, StreamEnd> picture_after(std::int64_t after_us, std::int64_t) override {
        while (next_ < files_.size() && time_of(next_) <= after_us) ++next_;
        if (!fault_.empty()) return failure(StreamEnd::kGone);
        if (next_ == files_.size()) return failure(StreamEnd::kEnded);
        auto image = read_grey_image(files_[next_]);
        if (!image) {
            fault_ = image.error().message;
            return failure(StreamEnd::kGone);
        }
        return LivePicture{std::move(*image), time_of(next_)};
    }
    std::string fault() const override { return fault_; }
    bool is_recording() const override { return true; }

  private:
    // From 1 on: after_us = 0 asks for the first.
    [[nodiscard]] std::int64_t time_of(std::size_t i) const {
        return static_cast<std::int64_t>(static_cast<double>(numbers_[i] + 1) * 1e6 / kFolderRate_hz);
    }

    std::vector<fs::path> files_;
    std::vector<std::int64_t> numbers_;
    std::size_t next_ = 0;
    std::string fault_;
};

class FilmStream final : public PictureStream {
  public:
    explicit FilmStream(cv::VideoCapture film) : film_(std::move(film)) {
        const double rate_hz = film_.get(cv::CAP_PROP_FPS);
        if (rate_hz >= 1.0 && rate_hz <= 1000.0) period_us_ = 1e6 / rate_hz;
    }

    Result<LivePicture, StreamEnd> picture_after(std::int64_t after_us, std::int64_t) override {
        while (time_us() <= after_us) {
            if (!film_.grab()) return failure(StreamEnd::kEnded);
            ++count_;
        }
        if (count_ == 0 || !film_.retrieve(picture_) || picture_.empty()) return failure(StreamEnd::kEnded);
        return LivePicture{grey_of(picture_), time_us()};
    }
    std::string fault() const override { return {}; }
    bool is_recording() const override { return true; }

  private:
    [[nodiscard]] std::int64_t time_us() const {
        return static_cast<std::int64_t>(static_cast<double>(count_) * period_us_);
    }

    cv::VideoCapture film_;
    cv::Mat picture_;
    double period_us_ = 1e6 / 30.0;
    std::int64_t count_ = 0;  // pictures grabbed
};

std::int64_t monotonic_us() {
    return std::chrono::duration_cast<std::chrono::microseconds>(
               std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

// A thread of its own takes every picture, so that the newest is at hand when the search for the board in the
// last one is done; drivers hand out the oldest that they hold.
class DeviceStream final : public PictureStream {
  public:
    DeviceStream(std::string device, cv::VideoCapture capture)
        : device_(std::move(device)), capture_(std::move(capture)) {
        taker_ = std::jthread([this](const std::stop_token& stop) { take(stop); });
    }

    Result<LivePicture, StreamEnd> picture_after(std::int64_t after_us, std::int64_t patience_us) override {
        std::unique_lock lock(mutex_);
        const auto fresh = [&] { return gone_ || (newest_ && newest_->time_us > after_us); };
        if (!arrived_.wait_for(lock, std::chrono::microseconds(patience_us), fresh))
            return failure(StreamEnd::kNothingYet);
        if (gone_) return failure(StreamEnd::kGone);
        return *newest_;
    }
    std::string fault() const override {
        const std::scoped_lock lock(mutex_);
        return gone_ ? device_ + " gives no more pictures; was it unplugged?" : std::string();
    }
    bool is_recording() const override { return false; }

  private:
    void take(const std::stop_token& stop) {
        cv::Mat picture;
        while (!stop.stop_requested()) {
            if (!capture_.grab() || !capture_.retrieve(picture) || picture.empty()) break;
            // V4L2 hands the driver's stamp on, in ms; other backends the place in the film or nothing.
            const std::int64_t arrived_us = monotonic_us();
            const auto stamp_us = static_cast<std::int64_t>(1000.0 * capture_.get(cv::CAP_PROP_POS_MSEC));
            const bool plausible = stamp_us > arrived_us - 1'000'000 && stamp_us <= arrived_us;
            LivePicture taken{grey_of(picture), plausible ? stamp_us : arrived_us};
            {
                const std::scoped_lock lock(mutex_);
                newest_ = std::move(taken);
            }
            arrived_.notify_one();
        }
        {
            const std::scoped_lock lock(mutex_);
            gone_ = true;
        }
        arrived_.notify_one();
    }

    std::string device_;
    cv::VideoCapture capture_;
    mutable std::mutex mutex_;
    std::condition_variable arrived_;
    std::optional<LivePicture> newest_;
    bool gone_ = false;
    std::jthread taker_;  // last: it ends before what it uses
};

std::string devices_present() {
    std::vector<std::string> names;
    std::error_code ignored;
    for (fs::directory_iterator at("/dev", ignored), end; at != end; at.increment(ignored)) {
        if (at->path().filename().string().starts_with("video")) names.push_back(at->path().string());
    }
    std::ranges::sort(names);
    if (names.empty()) return "this machine has no camera device at all; is the camera plugged in?";
    return fmt::format("present are: {}", fmt::join(names, ", "));
}

Result<std::unique_ptr<PictureStream>, FileError> open_device(const std::string& device) {
    std::error_code ignored;
    if (!fs::exists(device, ignored))
        return file_failure(device, "there is no such device; " + devices_present());
    if (access(device.c_str(), R_OK | W_OK) != 0) {
        return file_failure(device,
                            "no permission to use it; join the group that owns it (sudo usermod -aG video "
                            "$USER) and log in again");
    }
    cv::VideoCapture capture(device, cv::CAP_V4L2);
    cv::Mat first;
    if (!capture.isOpened() || !capture.read(first)) {
        return file_failure(device,
                            "gives no pictures: another program has it (headrigd, a video call), or it is a "
                            "camera's second node; end that program or try the next number");
    }
    return std::make_unique<DeviceStream>(device, std::move(capture));
}

bool is_number(const std::string& text) {
    return !text.empty() && text.size() <= 3 && text.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

Result<std::unique_ptr<PictureStream>, FileError> open_picture_stream(const std::string& source) {
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);  // errors are said by us
    if (is_number(source)) return open_device("/dev/video" + source);
    if (source.starts_with("/dev/")) return open_device(source);
    std::error_code ignored;
    if (fs::is_directory(source, ignored)) {
        auto files = pictures_in(source);
        if (!files) return failure(files.error());
        if (files->empty()) return file_failure(source, "has no .png, .pgm or .jpg pictures in it");
        return std::make_unique<FolderStream>(std::move(*files));
    }
    if (!fs::exists(source, ignored)) {
        return file_failure(source,
                            "is neither a device (/dev/video0, or 0) nor a folder or film that is there; " +
                                devices_present());
    }
    cv::VideoCapture film(source, cv::CAP_ANY);
    if (!film.isOpened())
        return file_failure(source, "is no film that can be read; give .avi, .mp4 or a folder");
    return std::make_unique<FilmStream>(std::move(film));
}

}  // namespace rig::host
