#include "firmware_host/companion/links/link_spec.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "hal/linux/pty_link.hpp"
#include "tests/support/temp_folder.hpp"

namespace {

using namespace rig::host;

TEST(LinkSpec, ReadsEveryForm) {
    const auto serial = parse_link_spec("serial:/dev/ttyACM0@3000000");
    ASSERT_TRUE(serial.has_value());
    EXPECT_EQ(serial->path, "/dev/ttyACM0");
    EXPECT_EQ(serial->baud, 3000000);
    EXPECT_EQ(parse_link_spec("serial:/dev/ttyACM0")->baud, 0);
    EXPECT_EQ(parse_link_spec("/dev/pts/5")->path, "/dev/pts/5");
    EXPECT_EQ(parse_link_spec("./rig")->path, "./rig");
    const auto udp = parse_link_spec("udp:127.0.0.1:7777");
    ASSERT_TRUE(udp.has_value());
    EXPECT_EQ(udp->kind, LinkSpec::Kind::kUdp);
    EXPECT_EQ(udp->host, "127.0.0.1");
    EXPECT_EQ(udp->port, 7777);
    EXPECT_EQ(parse_link_spec("udp:[::1]:7777")->host, "::1");
}

TEST(LinkSpec, RefusesTheRestAndNamesIt) {
    for (const char* bad :
         {"", "ttyACM0", "serial:", "serial:@9600", "serial:/dev/x@", "serial:/dev/x@fast",
          "serial:/dev/x@1199", "serial:/dev/x@99999999999", "udp:", "udp:host", "udp::7777",
          "udp:host:", "udp:host:0", "udp:host:65536", "udp:host:7x", "tcp:host:7777"}) {
        const auto spec = parse_link_spec(bad);
        ASSERT_FALSE(spec.has_value()) << bad;
        EXPECT_NE(spec.error().message.find(bad), std::string::npos) << spec.error().message;
    }
}

TEST(LinkSpec, OpeningSaysWhatIsWrong) {
    const rig::test::TempFolder folder;
    const auto missing = open_link((folder / "none").string());
    ASSERT_FALSE(missing.has_value());
    EXPECT_NE(missing.error().message.find("there is no"), std::string::npos);
    std::ofstream(folder / "file") << "x";
    const auto file = open_link((folder / "file").string());
    ASSERT_FALSE(file.has_value());
    EXPECT_NE(file.error().message.find("not a serial device"), std::string::npos);
}

TEST(LinkSpec, OpensAPtyAndAUdpPeer) {
    const rig::test::TempFolder folder;
    rig::PtyLink board((folder / "rig").string());
    ASSERT_TRUE(board.open().has_value());
    const auto link = open_link((folder / "rig").string());
    ASSERT_TRUE(link.has_value()) << link.error().message;
    EXPECT_FALSE((*link)->is_datagram());
    const auto udp = open_link("udp:127.0.0.1:7777");
    ASSERT_TRUE(udp.has_value()) << udp.error().message;
    EXPECT_TRUE((*udp)->is_datagram());
}

}  // namespace
