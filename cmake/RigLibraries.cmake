# Every external library, once. scripts/setup installs the Debian packages that hold them.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs calib3d aruco videoio)
# Calibration alone needs the last three, which pull in a hundred libraries more.
set(OpenCV_LIBS opencv_core opencv_imgproc opencv_imgcodecs)
set(RIG_OPENCV_CALIBRATION_LIBS opencv_calib3d opencv_aruco)
set(RIG_OPENCV_CAPTURE_LIBS opencv_videoio)
find_package(CLI11 REQUIRED)
find_package(JPEG REQUIRED)  # its headers come with libopencv-dev too, but the board needs it without OpenCV
find_package(fmt REQUIRED)
find_package(nlohmann_json REQUIRED)
pkg_check_modules(SODIUM REQUIRED IMPORTED_TARGET libsodium)
find_path(FLATBUFFERS_INCLUDE_DIR flatbuffers/flatbuffers.h REQUIRED)
find_program(FLATC flatc REQUIRED)
if(RIG_BUILD_TESTS)
    find_package(GTest REQUIRED)
endif()
if(RIG_BUILD_BENCHES)
    # To compare with, in tests/bench/solve: templates over BLAS. Its own CMake package would link X11 and more.
    find_path(DLIB_INCLUDE_DIR dlib/optimization.h REQUIRED)
    find_package(BLAS REQUIRED)
endif()
