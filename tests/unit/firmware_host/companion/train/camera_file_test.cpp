#include "firmware_host/companion/train/camera_file.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/shared_data.hpp"

namespace rig::host {
namespace {

const std::string kPose = R"("R":[[1,0,0],[0,-1,0],[0,0,-1]],"centre_mm":[1,-40,230])";
const std::string kLens =
    R"("width":480,"height":640,"f_px":575.0,"cx":242.7,"cy":317.4,"k1":-0.11,"k2":0.018)";

std::string error_of(const std::string& text) {
    const auto cameras = parse_cameras(text, "cameras.json");
    EXPECT_FALSE(cameras.has_value()) << text;
    return cameras ? "" : cameras.error().message;
}

void expect_error(const std::string& text, std::string_view fault) {
    const std::string message = error_of(text);
    EXPECT_TRUE(message.starts_with("cameras.json: ")) << message;
    EXPECT_NE(message.find(fault), std::string::npos) << message;
}

TEST(ParseCameras, TakesTheCamerasArray) {
    const auto cameras =
        parse_cameras(R"({"cameras":[{"camera":"a",)" + kLens + "," + kPose + R"(},{"camera":"b",)" + kLens +
                          R"(,"k3":0.001,"p1":1e-4,"p2":-2e-4,)" + kPose + R"(}],"images":[{"camera":"z"}]})",
                      "cameras.json");
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    ASSERT_EQ(cameras->size(), 2U);
    const CameraModel& b = (*cameras)[1];
    EXPECT_EQ(b.width_px, 480);
    EXPECT_EQ(b.height_px, 640);
    EXPECT_EQ(b.fx_px, 575.0);
    EXPECT_EQ(b.fy_px, 575.0);
    EXPECT_EQ(b.k1, -0.11);
    EXPECT_EQ(b.k3, 0.001);
    EXPECT_EQ(b.p1, 1e-4);
    EXPECT_EQ(b.p2, -2e-4);
    EXPECT_EQ(b.camera_from_headset(1, 1), -1.0);
    EXPECT_EQ(b.centre_mm, Vec3(1.0, -40.0, 230.0));
}

TEST(ParseCameras, OfImagesTakesEachLetterOnceAndTheTopLevelLens) {
    const auto cameras =
        parse_cameras("{" + kLens + R"(,"images":[{"camera":"l",)" + kPose + R"(},{"camera":"r",)" + kPose +
                          R"(},{"camera":"l",)" + kPose + "}]}",
                      "cameras.json");
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    EXPECT_EQ(cameras->size(), 2U);
}

TEST(ParseCameras, TakesTwoFocalLengths) {
    const auto cameras = parse_cameras(
        R"({"cameras":[{"width":640,"height":480,"fx_px":500,"fy_px":510,"cx":320,"cy":240,)" + kPose + "}]}",
        "c");
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    EXPECT_EQ((*cameras)[0].fx_px, 500.0);
    EXPECT_EQ((*cameras)[0].fy_px, 510.0);
}

TEST(ParseCameras, NamesEachFault) {
    expect_error("", "not a JSON object");
    expect_error("[1,2]", "not a JSON object");
    expect_error("{\"cameras\":[", "not a JSON object");
    expect_error("{}", "neither");
    expect_error(R"({"cameras":[]})", "neither");
    expect_error(R"({"cameras":[17]})", "camera number 1 is not an object");
    expect_error(R"({"cameras":[{"camera":"a",)" + kPose + "}]}", "\"width\" is missing");
    expect_error(R"({"cameras":[{"camera":"a",)" + kLens + "}]}", "\"R\" is missing");
    expect_error(R"({"cameras":[{"camera":"a",)" + kLens + R"(,"R":[[1,0],[0,1]],"centre_mm":[0,0,0]}]})",
                 "3 x 3");
    expect_error(
        R"({"cameras":[{"camera":"a",)" + kLens + R"(,"R":[[1,0,0],[0,1,0],[0,0,1]],"centre_mm":[0,0]}]})",
        "\"centre_mm\" is not 3 numbers");
    expect_error(
        R"({"cameras":[{"camera":"a",)" + kLens + R"(,"R":[[1,0,0],[0,1,0],[0,0,2]],"centre_mm":[0,0,0]}]})",
        "camera a: a camera's rotation");
    expect_error(R"({"f_px":"575","width":1,"height":1,"cameras":[{"camera":"a",)" + kPose + "}]}",
                 "\"f_px\" is not a number");
    expect_error(R"({"width":-5,"cameras":[{"camera":"a",)" + kPose + "}]}",
                 "\"width\" is not a number of pixels");
    expect_error(R"({"width":1e300,"cameras":[{"camera":"a",)" + kPose + "}]}",
                 "\"width\" is not a number of pixels");
    std::string five = R"({"cameras":[)";
    for (const char letter : {'a', 'b', 'c', 'd', 'e'}) {
        five += std::string(letter == 'a' ? "" : ",") + R"({"camera":")" + letter + "\"," + kLens + "," +
                kPose + "}";
    }
    expect_error(five + "]}", "at most 4");
}

TEST(ParseCameras, SurvivesEveryTruncation) {
    const std::string whole = R"({"cameras":[{"camera":"a",)" + kLens + "," + kPose + "}]}";
    ASSERT_TRUE(parse_cameras(whole, "c").has_value());
    for (std::size_t length = 0; length < whole.size(); ++length) {
        EXPECT_FALSE(parse_cameras(std::string_view(whole).substr(0, length), "c").has_value()) << length;
    }
}

TEST(ParseReferenceMarks, TakesPlacesAndTheCamerasThatSeeThem) {
    const std::string cameras = R"("cameras":[{"camera":"l",)" + kLens + "," + kPose + R"(},{"camera":"r",)" +
                                kLens + "," + kPose + "}]";
    const auto marks = parse_reference_marks("{" + cameras +
                                                 R"(,"reference_marks":[)"
                                                 R"({"headset_mm":[-60,55.5,20]},)"
                                                 R"({"headset_mm":[1,2,3],"cameras":["r"]},)"
                                                 R"({"headset_mm":[4,5,6],"cameras":["r","l"]}]})",
                                             "cameras.json");
    ASSERT_TRUE(marks.has_value()) << marks.error().message;
    ASSERT_EQ(marks->size(), 3U);
    EXPECT_EQ((*marks)[0].headset_mm, Vec3(-60.0, 55.5, 20.0));
    EXPECT_EQ((*marks)[0].cameras, 3) << "all, when none is named";
    EXPECT_EQ((*marks)[1].cameras, 2);
    EXPECT_EQ((*marks)[2].cameras, 3);
    const auto none = parse_reference_marks("{" + cameras + "}", "cameras.json");
    ASSERT_TRUE(none.has_value());
    EXPECT_TRUE(none->empty());
}

TEST(ParseReferenceMarks, NamesEachFault) {
    const auto fault = [](const std::string& list) {
        const auto marks = parse_reference_marks(
            R"({"cameras":[{"camera":"l",)" + kLens + "," + kPose + R"(}],"reference_marks":)" + list + "}",
            "c");
        EXPECT_FALSE(marks.has_value()) << list;
        return marks ? std::string() : marks.error().message;
    };
    EXPECT_NE(fault("{}").find("not a list of at most 16"), std::string::npos);
    EXPECT_NE(fault("[7]").find("number 1 is not an object"), std::string::npos);
    EXPECT_NE(fault(R"([{"headset_mm":[0,0,0]},{}])").find("number 2: \"headset_mm\" is missing"),
              std::string::npos);
    EXPECT_NE(fault(R"([{"headset_mm":[0,0]}])").find("is not 3 numbers"), std::string::npos);
    EXPECT_NE(fault(R"([{"headset_mm":[0,0,1e9]}])").find("implausibly far"), std::string::npos);
    for (const char* cameras : {R"(["z"])", "[]", R"("l")", "[1]"}) {
        EXPECT_NE(fault(R"([{"headset_mm":[0,0,0],"cameras":)" + std::string(cameras) + "}]").find("cameras"),
                  std::string::npos);
    }
    std::string many = "[";
    for (int i = 0; i < 17; ++i) many += std::string(i == 0 ? "" : ",") + R"({"headset_mm":[0,0,0]})";
    EXPECT_NE(fault(many + "]").find("at most 16"), std::string::npos);
}

TEST(LoadCameras, ReadsTheRecordedOnes) {
    RIG_SHARED_DATA_OR_SKIP(path, "images/cameras.json");
    const auto cameras = load_cameras(path);
    ASSERT_TRUE(cameras.has_value()) << cameras.error().message;
    EXPECT_EQ(cameras->size(), 1U);
}

TEST(LoadCameras, SaysWhenThereIsNoFile) {
    const auto cameras = load_cameras("no/such/cameras.json");
    ASSERT_FALSE(cameras.has_value());
    EXPECT_TRUE(cameras.error().message.starts_with("no/such/cameras.json: ")) << cameras.error().message;
}

}  // namespace
}  // namespace rig::host
