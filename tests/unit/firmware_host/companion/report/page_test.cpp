#include "firmware_host/companion/report/page.hpp"

#include <gtest/gtest.h>

#include "firmware_host/companion/report/data_uri.hpp"

namespace rig::host {
namespace {

TEST(Escaped, LeavesNoMarkup) {
    EXPECT_EQ(escaped("a<b>&\"c\"'d'"), "a&lt;b&gt;&amp;&quot;c&quot;&#39;d&#39;");
    EXPECT_EQ(escaped(std::string_view("x\0y\x1b\n", 5)), "x?y??");
    EXPECT_EQ(escaped("m\xc3\xbcnd"), "m\xc3\xbcnd");
    EXPECT_EQ(escaped(""), "");
}

TEST(Page, IsOneDocumentWithoutAnythingFromElsewhere) {
    Page page("T <1>");
    page.heading("H & I");
    page.paragraph("<script>alert(1)</script>");
    page.table({"name", "mm"}, {{{"<b>", "1.0"}, true}, {{"plain", "2.0"}, false}});
    page.figure("<svg></svg>", "caption \"q\"");
    const std::string html = page.html();
    EXPECT_TRUE(html.starts_with("<!DOCTYPE html>"));
    EXPECT_TRUE(html.ends_with("</html>\n"));
    EXPECT_NE(html.find("<title>T &lt;1&gt;</title>"), std::string::npos);
    EXPECT_NE(html.find("<h2>H &amp; I</h2>"), std::string::npos);
    EXPECT_EQ(html.find("<script"), std::string::npos);
    EXPECT_EQ(html.find("http:"), std::string::npos);
    EXPECT_EQ(html.find("https:"), std::string::npos);
    EXPECT_EQ(html.find("url("), std::string::npos);
    EXPECT_NE(html.find("<tr class=\"flagged\"><td>&lt;b&gt;</td>"), std::string::npos);
    EXPECT_NE(html.find("<figcaption>caption &quot;q&quot;</figcaption>"), std::string::npos);
    EXPECT_EQ(html, page.html());
}

TEST(Page, AllowsPicturesOfItsOwnOnly) {
    Page page("p");
    page.figures({"<svg>1</svg>", "<svg>2</svg>"}, "two & more");
    const std::string html = page.html();
    EXPECT_NE(html.find("default-src 'none'; img-src data:; style-src"), std::string::npos);
    EXPECT_NE(html.find("<div><svg>1</svg></div><div><svg>2</svg></div>"), std::string::npos);
    EXPECT_NE(html.find("<figcaption>two &amp; more</figcaption>"), std::string::npos);
}

TEST(DataUri, IsBase64WithPadding) {
    const std::vector<std::uint8_t> bytes{'r', 'i', 'g', 's'};
    EXPECT_EQ(data_uri("image/png", bytes), "data:image/png;base64,cmlncw==");
    EXPECT_EQ(data_uri("image/png", std::span(bytes).first(3)), "data:image/png;base64,cmln");
    EXPECT_EQ(data_uri("image/jpeg", {}), "data:image/jpeg;base64,");
}

}  // namespace
}  // namespace rig::host
